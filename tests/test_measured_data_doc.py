"""docs/evidence/measured-drives.md: its commands run as they stand, and its tables hold what they give."""

import json
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flows.cli import app
from manifests.provenance import SOURCE_ROOT
from tests.documents import DOCS, list_blocks

pytestmark = pytest.mark.minutes
PAGES = [DOCS / "how-to/import-measured-data.md", DOCS / "evidence/measured-drives.md"]
TEXT = "".join(page.read_text() for page in PAGES)
COMMANDS = [line for page in PAGES for block in list_blocks(page, "") for line in block.splitlines()]


def table(heading: str) -> list[list[str]]:
    """Cells of the table whose header row starts with a word."""
    lines = TEXT.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(f"| {heading} |"))
    rows = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("doc")
    (folder / "catalogs").symlink_to(SOURCE_ROOT / "catalogs")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("PREFECT_API_URL", raising=False)
        for command in COMMANDS:
            words = shlex.split(command)[1:]
            result = CliRunner().invoke(app, words)
            assert result.exit_code == 0, f"{command}: {result.exception}"
    return folder


def test_the_ladder_of_the_stop_is_what_the_command_gives(made: Path) -> None:
    rungs = json.loads((made / "m8-study" / "stop_study.json").read_text())["rungs"]
    names = ("speed_rmse", "acceleration_rmse", "wheel_speed_rmse", "pitch_rmse", "distance_error")
    printed = table("rung")
    assert [row[0] for row in printed] == [row["rung"] for row in rungs]
    for row, rung in zip(printed, rungs, strict=True):
        found = [rung["held_out"][name] for name in names]
        assert [float(cell) for cell in row[1:]] == pytest.approx(found, abs=0.006)


def test_the_attrition_and_the_scores_are_what_the_command_gives(made: Path) -> None:
    result = json.loads((made / "a2d2-protocol" / "brake_protocol.json").read_text())
    printed = table("criterion")
    assert [row[2:] for row in printed] == [
        [str(row["fails"]), str(row["left"]), str(row["paper_fails"])] for row in result["attrition"]
    ]
    for row, macro in zip(table("calibration"), result["macro"], strict=False):
        numbers = [float(cell.split()[0]) for cell in row[1:]]
        found = [
            macro[name]
            for name in ("pitch_rmse", "pitch_correlation", "rate_rmse", "rate_correlation", "no_dive_rmse")
        ]
        assert numbers == pytest.approx(found, abs=0.001)
