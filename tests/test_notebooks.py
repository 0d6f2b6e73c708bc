"""The notebooks: without outputs, of public names alone, and every cell of theirs runs on a small dataset."""

import ast
import json
import re
import warnings
from pathlib import Path

import pytest

from manifests.provenance import SOURCE_ROOT

FOLDER = SOURCE_ROOT / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
DEMO = '"../../datasets/demo"'
LIBRARIES = {"musync", "numpy", "pandas", "plotly"}


def read_cells(path: Path, kind: str) -> list[str]:
    return ["".join(c["source"]) for c in json.loads(path.read_text())["cells"] if c["cell_type"] == kind]


def read_code(path: Path, dataset: object) -> list[str]:
    """The cells of code, on another dataset."""
    first, *others = read_cells(path, "code")
    assert first.count(DEMO) == 1 and DEMO not in "".join(others)
    return [first.replace(DEMO, repr(str(dataset))), *others]


def run_cell(source: str, names: dict[str, object]) -> None:
    """Run a cell, and show its last value as a notebook would."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)  # noqa: S102
    if isinstance(last, ast.Expr):
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)  # noqa: S307
        if hasattr(value, "_repr_html_"):
            assert value._repr_html_()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_stored_without_outputs_and_uses_public_names(path):
    cells = json.loads(path.read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert code and all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    for node in ast.walk(ast.parse("\n".join(read_cells(path, "code")))):
        if isinstance(node, ast.Attribute):
            assert not node.attr.startswith("_"), node.attr
        if isinstance(node, ast.Import):
            assert {alias.name.split(".")[0] for alias in node.names} <= LIBRARIES
        if isinstance(node, ast.ImportFrom):
            assert str(node.module).split(".")[0] in LIBRARIES


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_cells_of_a_notebook_run(path, toy_dataset):
    names: dict[str, object] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for source in read_code(path, toy_dataset.root):
            run_cell(source, names)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_links_of_a_notebook_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)#]+)", "\n".join(read_cells(path, "markdown"))):
        assert (FOLDER / target).exists(), target


@pytest.mark.minutes
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_in_its_own_kernel(path, toy_dataset):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    book.cells[1].source = read_code(path, toy_dataset.root)[0]
    nbclient.NotebookClient(book, timeout=300, kernel_name="python3").execute(cwd=str(FOLDER))
    shown = [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [output for output in shown if output.output_type == "stream" and output.name == "stderr"]
