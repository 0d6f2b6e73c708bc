"""docs/tutorial/your-own-car.md: its commands run in order on its own files, and its tables hold what they give."""

import json
import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flows.cli import app
from manifests.provenance import SOURCE_ROOT

TEXT = (SOURCE_ROOT / "docs" / "tutorial" / "your-own-car.md").read_text()
FILES = ("my-map.yaml", "super-fj.yaml", "stops.yaml")
"""Names of the YAML blocks, in their order."""


def rows(heading: str) -> list[list[str]]:
    """Cells of the table whose header row starts with a word."""
    after = TEXT.split(f"| {heading} |", 1)[1].splitlines()[2:]
    end = next((i for i, line in enumerate(after) if not line.startswith("|")), len(after))
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in after[:end]]


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """The folder after all steps, and what the commands printed."""
    folder = tmp_path_factory.mktemp("tutorial")
    (folder / "catalogs").symlink_to(SOURCE_ROOT / "catalogs")
    printed: list[str] = []
    names = iter(FILES)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("PREFECT_API_URL", raising=False)
        patch.delenv("MUSYNC_LEDGER", raising=False)
        for language, content in re.findall(r"^```(\w*)\n(.*?)^```$", TEXT, flags=re.M | re.S):
            if language == "yaml":
                Path(next(names)).write_text(content)
                continue
            result = CliRunner().invoke(app, shlex.split(content)[1:])
            faults = [line for line in result.output.splitlines() if "must lie within" in line]
            assert result.exit_code == len(faults) == content.count("vehicle check"), (
                f"{content}: {result.output}"
            )
            printed.append(result.output)
    return folder, printed


def test_the_errors_and_the_numbers_are_those_of_the_verdict(walked: tuple[Path, list[str]]) -> None:
    verdict = json.loads((walked[0] / "closed" / "verdict.json").read_text())
    errors = verdict["error"] | verdict["manoeuvre_error"]
    assert {row[0] for row in rows("error of")} == set(errors)
    for name, unit, *figures in rows("error of"):
        assert errors[name]["unit"] == unit
        found = [errors[name][model] for model in ("frozen", "retuned", "after")]
        assert [float(figure) for figure in figures] == pytest.approx(found, rel=0.02)
    numbers = {
        name: p
        for effect in (*verdict["effects"], *verdict["calibrated"])
        for name, p in effect["parameters"].items()
    }
    assert {row[0] for row in rows("number")} == set(numbers)
    assert verdict["verdict"] == "NOTHING" and verdict["effects"] == []
    for name, value, interval in rows("number"):
        low, high = (float(end) for end in interval.split(" to "))
        assert float(value) == pytest.approx(numbers[name]["value"], rel=0.05)
        assert [low, high] == pytest.approx(
            [numbers[name][key] for key in ("ci_low", "ci_high")], rel=0.0, abs=min(0.05, 0.1 * (high - low))
        )


def test_the_pages_of_the_tutorial_are_there_and_say_what_it_says(walked: tuple[Path, list[str]]) -> None:
    page = (walked[0] / "closed" / "report.html").read_text()
    assert "super-fj against super-fj.yaml" in page and "the tyres grip 30 %" in page
    kept = (walked[0] / "datasets" / "super-fj" / "inputs" / "vehicle.yaml").read_text()
    assert "close-loop on super-fj" in kept and "brake_gain" in kept


def test_the_query_answers_as_printed(walked: tuple[Path, list[str]]) -> None:
    lines = [re.findall(r"[\w./-]+", line) for line in walked[1][-1].splitlines()]
    answer = [cells for cells in lines if cells and "/" in cells[0]]
    told = rows("label")
    assert [cells[0] for cells in told] == [cells[0] for cells in answer]
    for printed, found in zip(told, answer, strict=True):
        assert [float(c) for c in printed[1:]] == pytest.approx([float(c) for c in found[1:]], abs=0.11)
