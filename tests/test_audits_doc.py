"""docs/how-to/audit-a-dataset.md: the commands about signatures and installations run as they stand."""

import re
import shlex
import shutil
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from flows.cli import app
from manifests.environment import environment_bom
from manifests.provenance import SOURCE_ROOT
from manifests.signing import ENVELOPE, PREDICATE_TYPE

TEXT = (SOURCE_ROOT / "docs" / "how-to" / "audit-a-dataset.md").read_text()


def section(title: str) -> str:
    return re.split(r"^## ", TEXT.split(f"\n## {title}\n")[1], flags=re.M)[0]


def commands(title: str) -> list[list[str]]:
    blocks = re.findall(r"```\n(.*?)```", section(title), flags=re.S)
    return [shlex.split(line) for block in blocks for line in block.strip().splitlines()]


@pytest.fixture
def beside_demo(toy_dataset, tmp_path, monkeypatch):
    """A folder in which datasets/demo is a dataset."""
    shutil.copytree(toy_dataset.root, tmp_path / "datasets" / "demo")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    return tmp_path


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")
def test_the_four_lines_make_keys_sign_and_verify(beside_demo):
    lines = commands("Signatures")
    assert [line[:2] for line in lines] == [
        ["openssl", "genpkey"], ["openssl", "pkey"], ["musync", "lab"], ["musync", "verify"]
    ]  # fmt: skip
    for program, *words in lines:
        if program == "openssl":
            subprocess.run([program, *words], check=True, capture_output=True)
        else:
            result = CliRunner().invoke(app, words)
            assert result.exit_code == 0, f"{words}: {result.output}"
    assert (beside_demo / "datasets" / "demo" / ENVELOPE).is_file()
    assert PREDICATE_TYPE in section("Signatures")


def test_the_line_that_lists_the_environment_lists_it(beside_demo):
    ((program, *words),) = commands("The same installation again")
    assert program == "python"
    said = subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True).stdout
    assert said.split() == [f"{row['name']}=={row['version']}" for row in environment_bom()["components"]]
