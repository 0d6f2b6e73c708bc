"""docs/tutorial/your-own-street.md: its steps run in order, and its tables hold what they give."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flows.cli import app
from manifests.provenance import SOURCE_ROOT
from tests.documents import BLOCK, DOCS

TEXT = (DOCS / "tutorial" / "your-own-street.md").read_text()
FILES = {"python": "picture_street.py", "yaml": "my-street-stops.yaml"}
"""Names that the page gives its blocks."""


def rows(head: str) -> list[list[str]]:
    after = TEXT.split(f"\n| {head} |")[1].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in after]


@pytest.mark.minutes
def test_the_street_that_is_built_is_as_good_as_said_and_its_stops_are_as_long(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    printed = {}
    for _, language, content in BLOCK.findall(TEXT):
        if language in FILES:
            Path(FILES[language]).write_text(content)
        for line in content.splitlines() if language == "" else ():
            program, *words = shlex.split(line)
            if program == "python":
                env = os.environ | {"PYTHONPATH": str(SOURCE_ROOT)}
                subprocess.run([sys.executable, *words], check=True, env=env)
            else:
                result = CliRunner().invoke(app, words)
                assert result.exit_code == 0, f"{line}: {result.output}"
                printed[" ".join(words[:2])] = result.output
    for figure, value in rows("figure"):
        found = float(re.search(rf"^{figure}: ([\d.]+)", printed["scene from-stereo"], flags=re.M)[1])
        assert found == pytest.approx(float(value), rel=0.01)
    answer = [re.findall(r"[\w.-]+", line) for line in printed["sql datasets/my-street"].splitlines()]
    assert rows("label") == [cells for cells in answer if len(cells) == 3 and cells[0] != "label"]
    assert Path("sheets/weather.png").is_file()
