"""Frames that are made when they are read are those of an ordinary run, and their cache may be lost at any time."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import musync
from flows.auditing.audit import audit_dataset
from flows.auditing.verify import verify_dataset
from flows.making.generate import generate_dataset
from flows.reading import recipes
from flows.reading.describe import validate_grid
from flows.reading.materialise import materialise_frames
from flows.reading.previews import make_films
from flows.reading.recipes import open_recipes
from flows.store.layout import Layout
from flows.store.sealed import require_frames
from manifests.canonical import sha256_of_file
from tasks.errors import InputError

ARRAYS = ("rgb", "depth", "class")


@pytest.fixture(scope="module")
def later(toy_dataset, tmp_path_factory) -> Layout:
    """The toy dataset, whose frames are made when they are read."""
    grid, folder = str(toy_dataset.root.parent / "grid.yaml"), tmp_path_factory.mktemp("later")
    return generate_dataset(grid, str(folder / "data"), runner="threads", workers=1, pictures="later").layout


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch) -> Path:
    """An empty cache of frames."""
    monkeypatch.setattr("flows.reading.recipes.cache_root", lambda: tmp_path / "cache")
    return tmp_path / "cache" / "frames"


@pytest.fixture
def made(monkeypatch) -> list[int]:
    """Indices of the clips that are made, as they are."""
    indices: list[int] = []
    make = recipes.make_clip
    monkeypatch.setattr(
        recipes, "make_clip", lambda layout, index, scene: (indices.append(index), make(layout, index, scene))
    )
    return indices


def list_files(folder: Path) -> dict[Path, str]:
    return {path: sha256_of_file(path) for path in folder.rglob("*") if path.is_file()}


def list_kept(cache: Path) -> set[str]:
    return {path.stem for path in cache.glob("*/.staging/*.json")}


def test_frames_are_those_of_an_ordinary_run_and_nothing_is_written_to_the_dataset(
    toy_dataset, later, cache, made
):
    before = list_files(later.root)
    ours, theirs = musync.open(later.root), musync.open(toy_dataset.root)
    assert [clip["clip_id"] for clip in ours.manifest["clips"]] == [
        clip["clip_id"] for clip in theirs.manifest["clips"]
    ]
    assert not any("frames.zarr" in str(path) for path in before)
    windows, stored = (data.torch(window=4, stride=3, arrays=ARRAYS) for data in (ours, theirs))
    for item in reversed(range(len(stored))):
        for name in ARRAYS:
            assert windows[item][name].numpy().tobytes() == stored[item][name].numpy().tobytes()
    picture = ours["snow-3/hump"].picture(7)
    assert np.array_equal(picture, theirs["snow-3/hump"].picture(7))
    assert not cache.exists() and made == []  # windows and pictures are kept by nobody
    for name in ARRAYS:
        assert np.array_equal(ours.frames[name][:], theirs.frames[name][:], equal_nan=name == "depth")
    assert sorted(made) == [0, 1, 2, 3]
    for name in ARRAYS:
        for index in range(4):
            shard = ours.source.find(index).frame_shard(name, index)
            assert shard.read_bytes() == toy_dataset.frame_shard(name, index).read_bytes()
    assert windows[0]["rgb"].numpy().tobytes() == stored[0]["rgb"].numpy().tobytes()
    assert sorted(made) == [0, 1, 2, 3] and list_files(later.root) == before


def test_no_clip_is_judged_before_its_frames_are_made(toy_dataset, later):
    with_frames, without = (json.loads(x.manifest.read_bytes())["clips"] for x in (toy_dataset, later))
    assert {clip["verdict"]["passed"] for clip in without} == {None}
    assert {reason for clip in without for reason in clip["verdict"]["reasons"]} == {"frames are made later"}
    failed = {clip["label"] for clip in with_frames if clip["verdict"]["passed"] is False}
    assert materialise_frames(str(later.root), runner="threads")["quarantined"].keys() == failed
    with pytest.raises(InputError, match="needs them stored"):
        require_frames(json.loads(later.manifest.read_bytes()), later, stored=True)


def test_clips_made_beforehand_are_found_and_those_of_a_killed_run_made_again(later, cache, made):
    one = materialise_frames(str(later.root), clips=["snow-3/flat"], runner="threads")
    assert one["made"] == 1 and len(list_kept(cache)) == 1
    next(cache.glob("*/frames.zarr/rgb/c/2")).rename(cache / "lost")  # of which the receipt knows
    assert materialise_frames(str(later.root), runner="threads", workers=1)["made"] == 4
    assert materialise_frames(str(later.root), runner="threads", workers=1)["made"] == 0
    musync.open(later.root).frames["rgb"][:]
    assert made == []


def test_films_are_those_of_an_ordinary_run(toy_dataset, later, tmp_path):
    films = [
        make_films(str(layout.root), str(tmp_path / name), clips=["snow-3/hump"])["films"]
        for name, layout in (("later", later), ("stored", toy_dataset))
    ]
    assert Path(films[0][0]).read_bytes() == Path(films[1][0]).read_bytes()


def test_a_cache_beyond_its_bound_forgets_what_was_read_least_recently(later, cache, made, monkeypatch):
    data = musync.open(later.root)
    data.source.read(0, "rgb")
    size = sum(path.stat().st_size for path in cache.rglob("*") if path.is_file())
    monkeypatch.setenv("MUSYNC_FRAMES_GB", str(2.5e-9 * size))
    for index in (1, 0, 2):
        data.source.read(index, "rgb")
    assert list_kept(cache) == {data.source.plan.clips[index].clip_id for index in (0, 2)}
    data.source.read(1, "rgb")
    assert made == [0, 1, 2, 1]
    monkeypatch.setenv("MUSYNC_FRAMES_GB", "1e-9")
    assert data.frames["rgb"][3].any() and len(list_kept(cache)) == 1
    with pytest.raises(InputError, match="the cache of frames holds 1e-09: name fewer"):
        materialise_frames(str(later.root), runner="threads")
    monkeypatch.setenv("MUSYNC_FRAMES_GB", "none")
    with pytest.raises(InputError, match="MUSYNC_FRAMES_GB must be a number above 0"):
        data.source.read(0, "rgb")


def test_two_readers_at_once_make_a_clip_once(later, made):
    readers = [musync.open(later.root) for _ in range(2)]
    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(lambda data: data.source.read(0, "rgb"), readers)
    assert np.array_equal(first, second) and made == [0]


def test_damage_in_the_cache_is_reported_and_made_again(later, cache, made):
    before = verify_dataset(str(later.root))
    assert before["verified"] and before["recipes"] == {"clips": 4, "made": 0, "damaged": []}
    frames = musync.open(later.root).source
    shard = frames.find(1).frame_shard("rgb", 1)
    content = bytearray(shard.read_bytes())
    content[100] ^= 255
    shard.write_bytes(content)
    found = verify_dataset(str(later.root))
    assert not found["verified"] and found["recipes"] == {"clips": 4, "made": 1, "damaged": ["dry/hump"]}
    assert "1 not as made" in found["verdict"]
    assert frames.read(1, "rgb").any() and made == [1, 1]
    assert verify_dataset(str(later.root))["verified"]


def test_an_audit_holds_the_telemetry_and_says_that_no_picture_is_recorded(later):
    audit = audit_dataset(str(later.root), share=1.0, runner="threads", workers=1)
    assert audit["verified"] and audit["compared"] == {"tables": 8, "arrays": 0}
    assert "pictures and pose check of 4 of 4 clips (made when they are read)" in audit["not_checked"]


def test_frames_that_show_another_motion_are_refused_and_other_tools_named(later, monkeypatch):
    manifest = musync.open(later.root).manifest
    here = recipes.tools_here()
    other = here | {
        "made_with": here["made_with"] | {"libraries": here["made_with"]["libraries"] | {"numpy": "9"}}
    }
    monkeypatch.setattr(recipes, "tools_here", lambda: other)
    with pytest.warns(UserWarning, match="made with other tools than its telemetry.*numpy"):
        opened = open_recipes(later, manifest)
    assert opened.read_window(0, slice(0, 1), ["rgb"])["rgb"].any()
    lying = replace(opened, ticks=("0" * 64, *opened.ticks[1:]))
    for read in (lambda: lying.read_window(0, slice(0, 1), ["rgb"]), lambda: lying.read(0, "rgb")):
        with pytest.raises(InputError, match=r"clip dry/flat must show the recorded telemetry.*numpy"):
            read()


def test_what_is_missing_is_said_in_a_sentence(later, cache, toy_dataset, monkeypatch):
    data = musync.open(later.root)
    cache.parent.mkdir(parents=True)
    cache.write_bytes(b"")
    with pytest.raises(InputError, match="the cache of frames must be a folder that can be written"):
        data.source.read(0, "rgb")
    monkeypatch.setattr("flows.reading.recipes.find_scene", refuse_scene)
    with pytest.raises(InputError, match="no folder is known here"):
        data.torch(window=2)[0]
    with pytest.raises(InputError, match="stores its frames; there are none to make"):
        materialise_frames(str(toy_dataset.root))


def refuse_scene(record):
    raise InputError(f"scene {record['name']}: no folder is known here that holds it")


def test_a_grid_is_priced_both_ways(toy_dataset):
    grid = str(toy_dataset.root.parent / "grid.yaml")
    stored, asked_later = (validate_grid(grid, pictures=pictures) for pictures in (True, "later"))
    first, second = stored["frames_estimates"]
    assert (
        asked_later["frames_estimates"] == [first, second] and asked_later["frames"] == stored["frames"] == 44
    )
    assert stored["megabytes_estimate"] == first["megabytes"] > second["megabytes"]
    assert asked_later["megabytes_estimate"] == second["megabytes"]
    assert second["cpu_minutes_when_read"] == first["cpu_minutes"] > second["cpu_minutes"]
