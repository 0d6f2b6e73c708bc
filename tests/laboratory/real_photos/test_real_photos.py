"""What our frames are worth on real photographs: parts that share nothing, fair draws, and scores that tell."""

import json

import cv2
import numpy as np
import pytest
import torch

import musync
from studies.real_photos.comparison import (
    DEVELOPMENT,
    HELD_OUT,
    ZERO_SHOT,
    Score,
    compare_trainings,
    measure_confusion,
)
from studies.real_photos.network import train_network
from studies.real_photos.pictures import (
    CLASSES,
    SIDE,
    Pictures,
    read_frames,
    read_photographs,
    split_photographs,
)
from studies.real_photos.study import PAGE, REPORT, compare_with_photographs, read_folder_names

LOOKS = {"dry": (0, 1), "wet": (1, 0), "snow": (1, 1)}
"""Whether the drawn photographs of each class have stripes along each axis [1]."""


@pytest.fixture(scope="module")
def photographs(tmp_path_factory):
    """A folder of 12 noisy photographs a class, with stripes across, along or both."""
    folder, draw = tmp_path_factory.mktemp("photographs"), np.random.default_rng(5)
    rows, columns = (np.sin(np.arange(side) / 2) for side in (40, 60))
    for kind, (along, across) in LOOKS.items():
        (folder / kind).mkdir()
        for number in range(12):
            light = 128 + 50 * (along * rows[:, None] + across * columns)[..., None]
            picture = np.clip(light + draw.normal(0, 10, (40, 60, 3)), 0, 255).astype(np.uint8)
            cv2.imwrite(str(folder / kind / f"{number:02}.png"), picture)
    return folder


@pytest.fixture(autouse=True)
def _as_the_study_computes():
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    yield
    torch.use_deterministic_algorithms(False)
    torch.set_num_threads(threads)


def test_the_parts_share_no_photograph_and_are_the_same_each_time(photographs) -> None:
    pictures, _ = read_photographs(photographs, {})
    parts = split_photographs(pictures)
    assert [np.bincount(part.label).tolist() for part in parts] == [[4] * 3] * 3
    assert len(set(np.concatenate([part.name for part in parts]))) == 36
    assert all(
        np.array_equal(a.name, b.name) for a, b in zip(parts, split_photographs(pictures), strict=True)
    )


def test_a_folder_may_have_other_names_and_what_cannot_be_read_is_told(photographs, tmp_path) -> None:
    for kind in CLASSES:
        (tmp_path / kind).symlink_to(photographs / kind)
    (tmp_path / "wet").unlink()
    with pytest.raises(musync.InputError, match="must be the folder of the wet photographs"):
        read_photographs(tmp_path, {})
    (tmp_path / "rainy").mkdir()
    for file in sorted((photographs / "wet").iterdir()):
        (tmp_path / "rainy" / file.name).write_bytes(file.read_bytes())
    (tmp_path / "rainy" / "torn.jpg").write_bytes(b"no picture")
    pictures, unread = read_photographs(tmp_path, read_folder_names(["wet=rainy"]))
    assert unread == ["rainy/torn.jpg"] and np.bincount(pictures.label).tolist() == [12] * 3
    with pytest.raises(musync.InputError, match="must be CLASS=NAME, CLASS one of dry, wet, snow"):
        read_folder_names(["fog=misty"])
    for file in sorted((tmp_path / "rainy").glob("0*")):
        file.unlink()
    with pytest.raises(
        musync.InputError, match="must hold at least 6 photographs that can be read; it holds 2"
    ):
        read_photographs(tmp_path, {"wet": "rainy"})


def test_frames_carry_the_class_of_their_weather(toy_dataset) -> None:
    data = musync.open(toy_dataset.root)
    with pytest.raises(musync.InputError, match="it has no clip of wet"):
        read_frames(data, "toy", of_a_clip=2)


def test_a_draw_takes_as_many_of_each_class_and_depends_on_its_seed(photographs) -> None:
    pictures, _ = read_photographs(photographs, {})
    drawn, other = (pictures.draw_each(3, seed) for seed in (1, 2))
    assert np.bincount(drawn.label).tolist() == [3] * 3
    assert np.array_equal(drawn.name, pictures.draw_each(3, 1).name) and not np.array_equal(
        drawn.name, other.name
    )


def test_every_source_weighs_the_same_however_many_pictures_it_has(monkeypatch) -> None:
    seen: list[torch.Tensor] = []
    monkeypatch.setattr(
        "studies.real_photos.network.vary_pictures", lambda chosen, _: seen.append(chosen) or chosen / 255
    )

    def paint(value: int, labels: list[int]) -> Pictures:
        pixels = np.full((len(labels), SIDE, SIDE, 3), value, np.uint8)
        return Pictures(pixels=pixels, label=np.array(labels), name=np.array(["picture"] * len(labels)))

    train_network([paint(0, [0, 1, 2]), paint(255, [0] * 100 + [1] * 10 + [2] * 10)], seed=1, steps=20)
    assert float(torch.cat(seen).float().mean() / 255) == pytest.approx(0.5, abs=0.05)


def test_a_confusion_counts_true_classes_in_rows_and_the_score_is_their_mean() -> None:
    label, answer = np.array([0, 0, 0, 0, 1, 1, 2]), np.array([0, 0, 0, 2, 1, 0, 2])
    table = measure_confusion(label, answer)
    assert table.tolist() == [[0.75, 0, 0.25], [0.5, 0.5, 0], [0, 0, 1]]
    score = Score(training="any", count=0, part=HELD_OUT, confusion=table[None], answers=answer[None])
    assert score.accuracies.tolist() == [0.75] and score.by_class.tolist() == [0.75, 0.5, 1]


def test_real_photographs_teach_and_frames_whose_labels_are_wrong_teach_the_wrong(photographs) -> None:
    pictures, _ = read_photographs(photographs, {})
    held_out, development, rest = split_photographs(pictures)
    rolled = Pictures(pixels=rest.pixels, label=np.roll(rest.label, 4), name=rest.name)
    found = {
        (score.training, score.part): score.accuracies[0]
        for score in compare_trainings(
            rolled, rest, {HELD_OUT: held_out, DEVELOPMENT: development}, seeds=[0], counts=[3], steps=60,
            say=lambda _: None,
        )
    }  # fmt: skip
    assert found["3 real", HELD_OUT] > 0.6 and found["3 real", DEVELOPMENT] > 0.6
    assert found[ZERO_SHOT, HELD_OUT] < 0.4 < found["3 real", HELD_OUT]


def test_the_study_writes_report_and_page_and_writes_the_same_again(
    photographs, tmp_path, monkeypatch
) -> None:
    pictures, _ = read_photographs(photographs, {})
    monkeypatch.setattr("studies.real_photos.study.read_frames", lambda *_, **__: pictures)
    monkeypatch.setattr(musync, "open", lambda place: place)
    reports = []
    for name in ("one", "two"):
        out = tmp_path / name
        compare_with_photographs(str(photographs), ["ours"], out=str(out), seeds=1, counts=[2], steps=5)
        reports.append((out / REPORT).read_bytes())
    assert reports[0] == reports[1]
    told = json.loads(reports[0])
    assert told["facts"]["held out"] == 12 and len(told["rows"]) == 2 * 5
    assert {row["real_per_class"] for row in told["rows"]} == {0, 2, None}
    page = (tmp_path / "one" / PAGE).read_text()
    assert page.count("data:image/jpeg") == 3 * (8 + 4 + 4) and "keep" not in page.split("<body", 1)[0]
