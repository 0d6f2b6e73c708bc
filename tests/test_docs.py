"""Commands that the documents tell a reader to type exist, and so do the targets of their links."""

import ast
import importlib
import re
import shlex
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml
from typer.exceptions import TyperException

from benchmarks.size import list_sentences, measure_documents
from catalogs.channel_maps.conditions import Conditions
from catalogs.entries import load
from flows.cli import app
from flows.making.plan import make_plan
from manifests.provenance import SOURCE_ROOT
from reference_pages.pages import WRITERS
from tasks.conventions import CHANNELS_BY_NAME
from tests.conftest import DATA
from tests.documents import DOCS, DOCUMENTS, list_blocks, list_command_lines, list_named_commands

OURS = {"musync", "flows", "manifests", "catalogs", "tasks"}
NOT_OURS = {"clip", "dask_jobqueue", "dask_kubernetes"}
"""Modules of the documents' Python that only their readers have."""
MOST_WORDS, MOST_LONG = 35_000, 0.015
"""Of all documents together: words, and the share of sentences of more than 30 words (``make size``)."""
PARTS = ["tutorial", "how-to", "reference", "explanation", "evidence"]


def find_command(line: str) -> tuple[Any, list[str]]:
    """Return the command that a line begins with, and the words after its name."""
    words = shlex.split(line, comments=True)[1:]
    command: Any = typer.main.get_command(app)
    while words and words[0] in getattr(command, "commands", {}):
        command, words = command.commands[words[0]], words[1:]
    return command, words


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_command_line_of_a_document_is_one_that_the_program_takes(document):
    refused = {}
    for line in list_command_lines(document):
        command, words = find_command(line.split(" > ")[0])
        try:
            command.make_context(
                command.name, words
            )  # takes names of options and kinds of values, and runs nothing
        except TyperException as error:
            refused[line] = str(error)
    assert refused == {}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_command_named_in_a_document_exists_with_its_options(document):
    unknown = []
    for line in list_named_commands(document):
        command, words = find_command(re.sub(r"[\[\],]+", " ", line))
        known = {name for option in command.params for name in (*option.opts, *option.secondary_opts)} | {
            "--help"
        }
        is_command = not hasattr(command, "commands") or not words or not re.match("[a-z]", words[0])
        if not is_command or not {word for word in words if word.startswith("--")} <= known:
            unknown.append(line)
    assert unknown == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_the_python_of_a_document_compiles_and_its_imports_are_there(document):
    missing = []
    for block in list_blocks(document, "python"):
        for node in ast.walk(ast.parse(block)):
            named = [name.name for name in getattr(node, "names", ()) if isinstance(node, ast.Import)]
            if isinstance(node, ast.ImportFrom):
                named = [node.module]
            tops = {name.split(".")[0] for name in named}
            missing += [name for name in tops - NOT_OURS if not find_spec(name)]
            if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] in OURS:
                module = importlib.import_module(node.module)
                missing += [f"{node.module}.{n.name}" for n in node.names if not hasattr(module, n.name)]
    assert missing == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_the_yaml_of_a_document_is_yaml(document):
    assert all(isinstance(yaml.safe_load(block), dict) for block in list_blocks(document, "yaml"))


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_files_of_the_source_that_a_document_names_exist(document):
    named = set(
        re.findall(
            r"`((?:tasks|flows|catalogs|manifests|tests|deploy)/[a-z\d_./-]+\.\w+)[`:]", document.read_text()
        )
    )
    assert sorted(file for file in named if not (SOURCE_ROOT / file).exists()) == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_link_in_a_document_leads_somewhere(document):
    for target in re.findall(r"\]\((?!http)([^)#]+)", document.read_text()):
        place = (document.parent / target).resolve()
        made = place.is_relative_to(DOCS) and place.relative_to(DOCS).as_posix() in WRITERS
        assert made or place.exists(), f"{document.name}: {target}"


def test_make_targets_in_the_documents_exist():
    targets = set(re.findall(r"^([a-z -]+):", (SOURCE_ROOT / "Makefile").read_text(), flags=re.M))
    named = {t for d in DOCUMENTS for t in re.findall(r"`?make ([a-z-]+)`", d.read_text())}
    assert named <= {target for line in targets for target in line.split()}


@pytest.mark.parametrize(("document", "clips"), [("README.md", 4), ("docs/how-to/write-a-grid.md", 88)])
def test_the_grid_in_a_document_is_sound(document, clips, tmp_path):
    block = list_blocks(SOURCE_ROOT / document, "yaml")[0]
    (tmp_path / "grid.yaml").write_text(block)
    assert len(load("grid", Path(tmp_path / "grid.yaml")).scenarios) == clips


def test_the_road_users_in_the_page_of_grids_are_sound(tmp_path):
    blocks = list_blocks(SOURCE_ROOT / "docs/how-to/write-a-grid.md", "yaml")
    (block,) = (block for block in blocks if "objects:" in block)
    (tmp_path / "grid.yaml").write_text(f"name: users\nbase: {{initial_speed_km_h: 50}}\n{block}")
    make_plan(tmp_path / "grid.yaml", "cpu")


def test_the_page_of_imports_names_every_condition_of_a_run():
    page = (DOCS / "how-to" / "import-measured-data.md").read_text()
    assert [name for name in Conditions.model_fields if f"`{name}`" not in page] == []


def test_every_page_stands_in_one_of_the_five_parts_and_in_the_navigation():
    pages = [page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")]
    assert {page.split("/")[0] for page in pages} == {*PARTS, "index.md"}
    navigation = re.search(r"^nav:\n(.*?)^\S", (SOURCE_ROOT / "mkdocs.yml").read_text(), flags=re.M | re.S)
    listed = re.findall(r"(\S+\.md)$", navigation[1], flags=re.M)
    assert sorted(listed) == sorted([*pages, *WRITERS]), "mkdocs.yml must list every page once"


def test_columns_of_the_glossary_are_columns():
    rows = re.findall(
        r"^\|.*\|$", (DOCS / "reference" / "glossary.md").read_text().split("## Words")[0], flags=re.M
    )
    of_files = {"efficiency", "slip_stiffness", "pitch_scale", "coast_deceleration", "wheel_radius"}
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} - of_files <= set(CHANNELS_BY_NAME)


def test_every_table_and_figure_of_the_paper_has_its_row():
    told = (DOCS / "evidence/paper.md").read_text()
    labels = set(re.findall(r"\b(?:tab|fig):\w+", told))
    kinds = [label.partition(":")[0] for label in labels]
    assert (kinds.count("tab"), kinds.count("fig")) == (15, 14)
    paper = DATA / "paper/musync-gs.tex"
    if not paper.is_file():
        pytest.skip("the paper's source is absent; only the number of its tables and figures was checked")
    assert labels == set(re.findall(r"\\label\{((?:tab|fig):\w+)\}", paper.read_text()))


def test_the_documents_end():
    words, long = measure_documents()
    assert words <= MOST_WORDS and long <= MOST_LONG


def test_the_first_page_is_read_in_two_minutes():
    text = (SOURCE_ROOT / "README.md").read_text()
    assert len(text.split()) <= 400
    assert all(len(sentence.split()) <= 30 for sentence in list_sentences(text))
