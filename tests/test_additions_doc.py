"""docs/how-to: the diffs of a tyre, an effect, a weather, a column and an export format are additions that work."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flows.making.generate import generate_dataset
from manifests.provenance import SOURCE_PACKAGES, SOURCE_ROOT
from tests.documents import BLOCK, DOCS, list_blocks
from tests.toy_street import write_toy_grid

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="no git, which applies the diffs")
PAGE = DOCS / "how-to" / "add-to-the-project.md"
WEATHER_PAGE = DOCS / "how-to" / "add-a-weather-kind.md"
COUNTS = {
    addition: int(files)
    for addition, files in re.findall(r"^\| (an? [\w ]+) \| (\d) \|", PAGE.read_text(), re.M)
}
"""Files of each addition, as the page's table tells them."""
GRID = """\
name: toy
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 11
frame_rate_hz: 10
axes:
  road:
    flat: {{initial_speed_km_h: 40, peak_pressure_mpa: 2.3, brake_onset_s: 0.2}}
    hump: {{initial_speed_km_h: 40, hazard_center_m: 4, hazard_length_m: 3.7, hazard_height_m: 0.075}}
"""


def list_diffs() -> dict[str, str]:
    """Return the diff of each addition, by its name in the table."""
    diffs = {"a kind of weather": "".join(list_blocks(WEATHER_PAGE, "diff"))}
    for section in PAGE.read_text().split("\n## ")[1:]:
        blocks = [content for _, language, content in BLOCK.findall(section) if language == "diff"]
        if blocks:
            diffs[section.split("\n")[0].lower()] = "".join(blocks)
    return diffs


def apply_diff(folder: Path, diff: str) -> str:
    """Apply a diff in a folder, which is taken for no part of a repository, and return what git has against it."""
    env = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    done = subprocess.run(
        ["git", "apply", "-"], cwd=folder, input=diff, capture_output=True, text=True, check=False,
        env=env | {"GIT_CEILING_DIRECTORIES": str(folder.parent)},
    )  # fmt: skip
    return done.stderr if done.returncode else ""


@pytest.fixture
def touched(tmp_path: Path) -> Path:
    """A copy of every file of the source that a diff changes."""
    for name in re.findall(r"^--- a/(\S+)", "".join(list_diffs().values()), re.M):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(SOURCE_ROOT / name, tmp_path / name)
    return tmp_path


@pytest.mark.parametrize("addition", [*COUNTS, "all"])
def test_the_diff_of_an_addition_applies_to_the_source_and_has_as_many_files_as_the_table_says(
    touched, addition
):
    diffs = list_diffs()
    if addition == "a pose check":
        assert addition not in diffs
        return
    diff = "".join(diffs.values()) if addition == "all" else diffs[addition]
    assert apply_diff(touched, diff) == ""
    if addition != "all":
        assert len(set(re.findall(r"^\+\+\+ b/(\S+)", diff, re.M))) == COUNTS[addition]


@pytest.mark.minutes
def test_a_source_with_all_additions_drives_generates_audits_and_exports_and_reads_an_older_dataset(tmp_path):
    """What it must do stands in ``tests.grown_tree``, which runs in the copy that the diffs changed."""
    tree, work = tmp_path / "tree", tmp_path / "work"
    for package in (*SOURCE_PACKAGES, "musync", "studies", "tests"):
        shutil.copytree(SOURCE_ROOT / package, tree / package, ignore=shutil.ignore_patterns("__pycache__"))
    work.mkdir()
    grid = write_toy_grid(work, GRID)
    generate_dataset(grid, str(work / "older"), pictures=False, runner="threads", workers=1)
    assert [(name, said) for name, diff in list_diffs().items() if (said := apply_diff(tree, diff))] == []
    env = {
        name: value
        for name, value in os.environ.items()
        if name not in ("NUMBA_CACHE_DIR", "PREFECT_API_URL")
    }
    done = subprocess.run(
        [sys.executable, "-m", "tests.grown_tree", str(work)], cwd=tree, capture_output=True, text=True, check=False,
        env=env | {"PYTHONPATH": str(tree), "MUSYNC_CACHE": str(tmp_path / "cache")},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
