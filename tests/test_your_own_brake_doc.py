"""docs/tutorial/your-own-brake.md: its blocks run in order, without pictures, and its tables hold what they give."""

import contextlib
import io
import re
import shlex
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from benchmarks.size import measure_documents
from flows.cli import app
from tests.documents import BLOCK, DOCS

PAGE = DOCS / "tutorial" / "your-own-brake.md"
TEXT = PAGE.read_text()


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return what each command and the Python printed."""
    printed = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("brake"))
        patch.syspath_prepend(str(Path.cwd()))
        patch.delitem(sys.modules, "my_brake", raising=False)
        for _, language, content in BLOCK.findall(TEXT):
            if language == "yaml":
                Path("approach.yaml").write_text(content)
            elif language == "python" and content.startswith("class Brake"):
                Path("my_brake.py").write_text(content)
            elif language == "python":
                with contextlib.redirect_stdout(io.StringIO()) as output:
                    exec(content, {})  # noqa: S102
                printed["python"] = output.getvalue()
            elif language == "":
                for line in content.splitlines():
                    words = shlex.split(line)[1:] + ["--no-frames"] * line.startswith("musync drive")
                    result = CliRunner().invoke(app, words)
                    assert result.exit_code == 0, f"{line}: {result.output}"
                    printed[line.split()[1]] = result.output
        assert Path("table/aeb.html").is_file() and Path("datasets/approach-report/index.html").is_file()
    return printed


def read_table(head: str) -> list[list[str]]:
    """Return the cells of the page's table that begins with a head."""
    rows = TEXT.split(f"\n| {head} |")[1].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def test_the_table_of_impacts_is_what_the_python_prints(walked):
    numbers = [[*map(float, re.findall(r"[\d.]+", row))] for row in walked["python"].splitlines()[2:]]
    told = [[*map(float, row)] for row in read_table("approach [km/h]")]
    assert numbers == told and len(told) == 4


def test_the_outcomes_are_what_the_query_answers(walked):
    cells = [
        [cell.strip() for cell in row.strip("│").split("│")]
        for row in walked["sql"].splitlines()
        if "dry" in row or "ice" in row
    ]
    assert cells == read_table("weather") and len(cells) == 2


def test_the_page_has_at_most_600_words():
    assert measure_documents([PAGE])[0] <= 600
