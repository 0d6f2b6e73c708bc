"""docs/tutorial/first-dataset.md: its commands run in order, and its tables hold what they give.

Telemetry alone, and of the demo its stops on a flat road: pictures take minutes, and change no number here.
"""

import contextlib
import io
import re
import shlex
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from flows.cli import app
from flows.making.generate import generate_dataset
from manifests.provenance import SOURCE_ROOT
from tests.documents import BLOCK, DOCS

PAGE = DOCS / "tutorial" / "first-dataset.md"
TEXT = PAGE.read_text()


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return the text that each command and the Python printed."""
    folder = tmp_path_factory.mktemp("first")
    grid = yaml.safe_load((SOURCE_ROOT / "catalogs" / "grids" / "demo.yaml").read_text())
    grid["axes"]["road"] = {"flat-braking": grid["axes"]["road"]["flat-braking"]}
    printed = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("PREFECT_API_URL", raising=False)
        Path("demo.yaml").write_text(yaml.safe_dump(grid, sort_keys=False))
        generate_dataset("demo.yaml", "datasets/demo", pictures=False, runner="threads", workers=1)
        for _, language, content in BLOCK.findall(TEXT):
            if language == "yaml":
                Path("my-stops.yaml").write_text(content)
            elif language == "python":
                with contextlib.redirect_stdout(io.StringIO()) as output:
                    exec(content, {})  # noqa: S102
                printed["python"] = output.getvalue()
            elif language == "":
                for line in content.splitlines():
                    if line != "make demo":
                        result = CliRunner().invoke(app, shlex.split(line)[1:])
                        assert result.exit_code == 0, f"{line}: {result.output}"
                        printed[line] = result.output
        assert Path("stop.html").is_file()
    return printed


@pytest.mark.parametrize(("head", "dataset"), [("label", "datasets/demo"), ("stop", "datasets/my-stops")])
def test_the_tables_are_what_the_queries_answer(walked: dict[str, str], head: str, dataset: str) -> None:
    after = TEXT.split(f"\n| {head} |")[1].split("\n\n")[0].splitlines()[2:]
    told = [[cell.strip() for cell in row.strip("|").split("|")] for row in after]
    (answer,) = (output for line, output in walked.items() if line.startswith(f"musync sql {dataset} "))
    cells = [
        [cell.strip() for cell in row.strip("│").split("│")] for row in answer.splitlines() if "/" in row
    ]
    assert told == cells and len(told) in (5, 8)


def test_the_reading_of_the_curves_is_that_of_the_telemetry(walked: dict[str, str]) -> None:
    dry, snow = (
        {name: float(value) for name, value in re.findall(r"'(\w+)': ([\d.]+)", line)}
        for line in walked["python"].splitlines()
    )
    said = re.search(
        r"lost (\d+) km/h, the one on snow (\d+);\n.*?([\d.]+) on the dry.*?([\d.]+) on snow", TEXT, re.S
    )
    assert [float(number) for number in said.groups()] == pytest.approx(
        [60 - 3.6 * dry["speed"], 60 - 3.6 * snow["speed"], dry["braking_slip_f"], snow["braking_slip_f"]],
        rel=0.03,
    )
    pitches = re.search(r"([\d.]+) degrees nose-down against ([\d.]+)", TEXT).groups()
    found = [57.29578 * stop["pitch"] for stop in (dry, snow)]
    assert [float(pitch) for pitch in pitches] == pytest.approx(found, abs=0.06)


def test_the_explanation_is_what_the_command_prints(walked: dict[str, str]) -> None:
    (quoted,) = re.findall(r"```text\n(.*?)```", TEXT, flags=re.S)
    (printed,) = (output for line, output in walked.items() if line.startswith("musync explain"))
    assert quoted in printed
