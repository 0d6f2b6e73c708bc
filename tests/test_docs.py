"""What the documents tell a reader to type exists, and what they link to is there."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from catalogs.grids import load_grid
from flows.cli import app
from flows.registry import COMMANDS
from manifests.provenance import SOURCE_ROOT

DOCUMENTS = sorted([*SOURCE_ROOT.glob("*.md"), *(SOURCE_ROOT / "docs").rglob("*.md")])
NAMED = sorted(
    {
        match
        for document in DOCUMENTS
        for match in re.findall(r"`musync ((?:scene )?[a-z][a-z-]+)[ `]", document.read_text())
    }
)


@pytest.mark.parametrize("command", NAMED)
def test_every_command_in_the_documents_exists(command):
    result = CliRunner().invoke(app, [*command.split(), "--help"])
    assert result.exit_code == 0, result.output


def test_the_page_of_commands_says_of_each_what_its_help_says():
    text = (SOURCE_ROOT / "docs" / "reference" / "commands.md").read_text()
    said = {c.name: re.findall(rf"^\| `musync {c.name}[ `].*", text, flags=re.M) for c in COMMANDS}
    assert not [c.name for c in COMMANDS if not any(c.sentence.rstrip(".") in row for row in said[c.name])]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_link_in_a_document_leads_somewhere(document):
    for target in re.findall(r"\]\((?!http)([^)#]+)", document.read_text()):
        assert (document.parent / target).exists(), f"{document.name}: {target}"


def test_make_targets_in_the_documents_exist():
    targets = set(re.findall(r"^([a-z-]+):", (SOURCE_ROOT / "Makefile").read_text(), flags=re.M))
    named = {t for d in DOCUMENTS for t in re.findall(r"`?make ([a-z-]+)`", d.read_text())}
    assert named <= targets


@pytest.mark.parametrize(("document", "clips"), [("README.md", 4), ("docs/how-to/write-a-grid.md", 88)])
def test_the_grid_in_a_document_is_sound(document, clips, tmp_path):
    block = re.search(r"```yaml\n(.*?)```", (SOURCE_ROOT / document).read_text(), flags=re.S)
    assert block is not None
    (tmp_path / "grid.yaml").write_text(block.group(1))
    assert len(load_grid(Path(tmp_path / "grid.yaml")).scenarios) == clips
