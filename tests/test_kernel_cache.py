"""A compiled kernel never outlives the source of anything it calls."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from manifests.provenance import SOURCE_ROOT
from tasks.kernel_cache import KEPT, _forget_old, sources_hash

CALLED = """
from numba import njit
from tasks.level import LEVEL

@njit(cache=True)
def height(x):
    return x + {}
"""
CALLING = """
from numba import njit
from tasks.called import height

@njit(cache=True)
def twice(x):
    return 2.0 * height(x)
"""


@pytest.fixture
def package(tmp_path) -> Path:
    """A copy of the rule with two kernels, one calling the other."""
    folder = tmp_path / "tasks"
    folder.mkdir()
    for name in ("__init__.py", "kernel_cache.py"):
        (folder / name).write_bytes((SOURCE_ROOT / "tasks" / name).read_bytes())
    (folder / "level.py").write_text("LEVEL = 1.0\n")
    (folder / "called.py").write_text(CALLED.format("LEVEL"))
    (folder / "calling.py").write_text(CALLING)
    return folder


def result(package: Path, cache: str = "cache", umask: int = -1) -> float:
    env = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    env |= {"MUSYNC_CACHE": str(package.parent / cache), "PYTHONPATH": str(package.parent)}
    done = subprocess.run(
        [sys.executable, "-c", "from tasks.calling import twice; print(twice(3.0))"],
        cwd=package.parent,
        env=env,
        capture_output=True,
        text=True,
        check=True,
        umask=umask,
    )
    return float(done.stdout)


def test_a_change_in_a_called_file_or_a_constant_reaches_the_caller_and_the_oldest_state_is_forgotten(
    package,
):
    """Whatever the umask, nobody else writes where compiled kernels lie."""
    kernels = package.parent / "cache" / "kernels"
    old = {f"{number:016x}" for number in range(KEPT + 2)}
    for name in old:
        (kernels / name).mkdir(parents=True)
    kernels.chmod(0o777)
    assert result(package, umask=0) == 8.0
    (state,) = (path for path in kernels.iterdir() if path.name not in old)
    assert [stat.S_IMODE(path.stat().st_mode) for path in (kernels, state)] == [0o700, 0o700]
    left = {path.name for path in kernels.iterdir()}
    assert len(left) == KEPT and len(left - old) == 1
    (package / "called.py").write_text(CALLED.format("2 * LEVEL"))
    assert result(package) == 10.0
    (package / "level.py").write_text("LEVEL = 5.0\n")
    assert result(package) == 26.0


def test_a_file_without_kernels_changes_nothing(package):
    before = sources_hash(package)
    (package / "prose.py").write_text("TEXT = 'words'\n")
    assert sources_hash(package) == before


def test_only_states_are_forgotten_and_no_link_is_followed(tmp_path):
    kernels, mine = tmp_path / "kernels", tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.txt").touch()
    states = [f"{number:016x}" for number in range(KEPT + 2)]
    for number, name in enumerate(["notes", *states]):
        (kernels / name).mkdir(parents=True)
        os.utime(kernels / name, (number, number))
    (kernels / ("f" * 16)).symlink_to(mine)
    (kernels / ("e" * 16)).symlink_to(tmp_path / "nowhere")
    _forget_old(kernels)
    kept = {path.name for path in kernels.iterdir()}
    assert kept == {"notes", "f" * 16, "e" * 16, *states[-KEPT + 1 :]}
    assert (mine / "thesis.txt").is_file()


def test_an_unusable_cache_keeps_no_kernel_and_stops_none(package):
    (package.parent / "file").touch()
    assert result(package, "file/cache") == 8.0
