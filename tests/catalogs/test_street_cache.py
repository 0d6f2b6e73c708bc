"""The cached street: made once, made anew where it is damaged, and nothing of a killed or second maker stays."""

import json
import multiprocessing
import os
import signal
import time
from pathlib import Path

import pytest

from catalogs.scenes import street_cache
from catalogs.scenes.folder import OPTIONAL_FILES, read_scene
from catalogs.scenes.street import STREET_FILE
from catalogs.scenes.street_cache import HALF_MADE, MARKER, cached_street
from tasks.errors import InputError
from tests.toy_street import toy_street


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    """An empty cache, and a street that is built at once."""
    monkeypatch.setenv("MUSYNC_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(street_cache, "_build_street", toy_street)
    return tmp_path / "cache"


def names(cache: Path) -> list[str]:
    return sorted(path.name for path in cache.iterdir())


def break_byte(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_a_street_is_made_once(cache, monkeypatch):
    first = cached_street()
    monkeypatch.setattr(street_cache, "_build_street", None)
    assert cached_street() == first
    assert names(cache) == [first.name, "street.lock"]


@pytest.mark.parametrize(
    "damage",
    [
        lambda folder: break_byte(folder / "means.npy"),
        lambda folder: break_byte(folder / "scene.json"),
        lambda folder: break_byte(folder / MARKER),
        lambda folder: (folder / "sh.npy").unlink(),
        lambda folder: (folder / "scene.json").unlink(),
        lambda folder: (folder / MARKER).unlink(),
        lambda folder: (folder / "scene.json").write_text(
            (folder / "scene.json").read_text().replace('"carriageway_left": 4.0', '"carriageway_left": 5.0')
        ),
    ],
)
def test_a_damaged_street_is_made_anew(cache, damage):
    folder = cached_street()
    whole = {path.name: path.read_bytes() for path in folder.iterdir()}
    damage(folder)
    assert cached_street() == folder
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == whole
    assert names(cache) == [folder.name, "street.lock"]


def test_what_muSync_did_not_write_is_left_and_told(cache):
    folder = cached_street()
    (folder / "thesis.txt").touch()
    break_byte(folder / "means.npy")
    before = sorted(path.name for path in folder.iterdir())
    with pytest.raises(InputError, match="move it away"):
        cached_street()
    assert sorted(path.name for path in folder.iterdir()) == before


def test_a_link_in_the_street_s_place_is_not_followed(cache, tmp_path):
    folder = cached_street()
    folder.rename(tmp_path / "elsewhere")
    folder.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="move it away"):
        cached_street()
    assert len(list((tmp_path / "elsewhere").iterdir())) == len(street_cache.WRITTEN) - len(OPTIONAL_FILES)


def test_what_killed_makers_left_goes_and_everything_else_stays(cache):
    folder = cached_street()
    for name in (
        f"{folder.name}.4711",
        f"{folder.name}.4711.partial",
        f"{folder.name}.4711.0a1b2c3d.partial",
    ):
        assert HALF_MADE.fullmatch(name)
        (cache / name).mkdir()
        (cache / name / "means.npy").touch()
    (cache / f"{folder.name}.99.partial").mkdir()
    (cache / f"{folder.name}.99.partial" / "thesis.txt").touch()
    (cache / "street-of-mine.1.partial").mkdir()
    (folder / MARKER).unlink()
    cached_street()
    assert names(cache) == sorted(
        [folder.name, f"{folder.name}.99.partial", "street-of-mine.1.partial", "street.lock"]
    )


def slow_street(seed: int):
    time.sleep(0.5)
    return toy_street()


def make(folder: str, built: str) -> None:
    os.environ["MUSYNC_CACHE"] = folder
    street_cache._build_street = {"slow": slow_street, "never": lambda seed: time.sleep(60)}[built]
    with open(f"{folder}.{os.getpid()}", "w") as told:
        told.write(str(cached_street()))


def test_of_two_cold_starts_one_makes_the_street_and_nothing_else_stays(cache, tmp_path):
    context = multiprocessing.get_context("fork")
    makers = [context.Process(target=make, args=(str(cache), "slow")) for _ in range(3)]
    for maker in makers:
        maker.start()
    for maker in makers:
        maker.join(30)
    told = {path.read_text() for path in tmp_path.glob("cache.*")}
    (folder,) = (Path(place) for place in told)
    assert names(cache) == [folder.name, "street.lock"]
    read_scene(folder)


def test_a_maker_that_is_killed_holds_nobody_up_and_leaves_nothing(cache):
    maker = multiprocessing.get_context("fork").Process(target=make, args=(str(cache), "never"))
    maker.start()
    deadline = time.monotonic() + 20
    while not (cache / "street.lock").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.1)
    os.kill(maker.pid, signal.SIGKILL)
    maker.join(10)
    folder = cached_street()
    assert names(cache) == [folder.name, "street.lock"]


def test_of_many_streets_that_used_least_recently_goes(cache, monkeypatch):
    monkeypatch.setattr(street_cache, "KEPT", 2)
    first, second = (cached_street(seed=seed) for seed in (1, 2))
    os.utime(first, (1, 1))
    os.utime(second, (2, 2))
    assert cached_street(seed=1) == first
    third = cached_street(seed=3)
    assert names(cache) == sorted([first.name, third.name, "street.lock"])


@pytest.mark.parametrize("place", ["file/cache", "x" * 5_000])
def test_a_cache_that_cannot_be_written_is_one_sentence(tmp_path, monkeypatch, place):
    (tmp_path / "file").touch()
    monkeypatch.setenv("MUSYNC_CACHE", str(tmp_path / place))
    with pytest.raises(InputError, match="set MUSYNC_CACHE to one that is") as caught:
        cached_street()
    assert len(caught.value.problems) == 1


def test_the_facts_of_a_cached_street_name_its_source(cache):
    assert json.loads((cached_street() / "scene.json").read_text())["source"] == "generated"


def test_the_street_is_built_from_its_entry_and_anew_where_that_changes(tmp_path, monkeypatch):
    monkeypatch.setattr("tasks.scene.street.build.build_street", lambda layout, seed: layout.lane_width)
    own = tmp_path / "street.yaml"
    own.write_text(STREET_FILE.read_text().replace("lane_width: {value: 3.5", "lane_width: {value: 3.25"))
    stamps = [((path,), (street_cache._stamp_file(path),)) for path in (STREET_FILE, own)]
    monkeypatch.setattr(street_cache, "STREET_FILE", own)
    assert street_cache._build_street(1) == 3.25
    assert street_cache._recipe_hash(*stamps[0]) != street_cache._recipe_hash(*stamps[1])
