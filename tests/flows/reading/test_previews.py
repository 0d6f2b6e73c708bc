"""Films of clips: the pictures of the dataset, the same bytes each time, and what is not there is named."""

import av
import numpy as np
import pytest

from flows.reading.previews import make_films, name_films
from flows.store.frames import read_clip
from flows.store.layout import read_json
from flows.store.outputs import find_name_problem
from tasks.errors import InputError
from tasks.render.traces import STRIP_HEIGHT


def frames_of(path: str) -> np.ndarray:
    with av.open(path) as film:
        return np.stack([frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)])


def test_a_film_shows_every_frame_of_its_clip_over_the_traces(toy_dataset, tmp_path):
    films = make_films(str(toy_dataset.root), str(tmp_path / "films"), clips=["snow-3/hump"])["films"]
    assert [film.rsplit("/", 1)[1] for film in films] == ["snow-3_hump.mp4"]
    row = next(r for r in read_json(toy_dataset.manifest)["clips"] if r["label"] == "snow-3/hump")
    wanted = read_clip(toy_dataset.frames, row["index"], "rgb").astype(float)
    shown = frames_of(films[0]).astype(float)
    height = wanted.shape[1]
    assert shown.shape == (len(wanted), height + STRIP_HEIGHT, *wanted.shape[2:])
    assert np.sqrt(np.mean((shown[:, :height] - wanted) ** 2)) < 8


def test_a_film_without_traces_has_the_size_of_the_picture(toy_dataset, tmp_path):
    films = make_films(str(toy_dataset.root), str(tmp_path), clips=["dry/flat"], traces=False)["films"]
    assert frames_of(films[0]).shape[1:] == read_clip(toy_dataset.frames, 0, "rgb").shape[1:]


def test_labels_that_differ_have_films_of_their_own_with_names_that_stay_in_the_folder():
    labels = [
        "a/b", "a_b", "A_b", "..", "../../x", ".hidden", "", "-rf", "x" * 300, "x" * 299 + "y", "é" * 200,
        "a\x1bb", "$(id)", "a_b-0000000000000000", "snow-3/hump",
    ]  # fmt: skip
    rows = [{"clip_id": f"{k:016x}", "label": label} for k, label in enumerate(labels)]
    names = name_films(rows)
    assert len({name.casefold() for name in names.values()}) == len(labels)
    assert all(find_name_problem(name) is None and "/" not in name for name in names.values())
    assert not any(name.startswith((".", "-")) for name in names.values())
    assert names[f"{labels.index('snow-3/hump'):016x}"] == "snow-3_hump.mp4"
    assert names["0000000000000000"] == "a_b-0000000000000000.mp4"


def test_a_film_of_one_s_own_is_not_overwritten(toy_dataset, tmp_path):
    (tmp_path / "dry_flat.mp4").write_text("mine")
    with pytest.raises(InputError, match=r"dry_flat\.mp4 is not a file that musync lab preview wrote"):
        make_films(str(toy_dataset.root), str(tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == ["dry_flat.mp4"]


def test_clips_and_datasets_that_are_not_there_are_named(toy_dataset, tmp_path):
    with pytest.raises(InputError, match=r"clip 'fog': there is none of this name; .*: dry/flat"):
        make_films(str(toy_dataset.root), str(tmp_path), clips=["fog", "dry/flat"])
    with pytest.raises(InputError, match="must be a finished dataset"):
        make_films(str(tmp_path), str(tmp_path))
