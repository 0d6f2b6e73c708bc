"""Pages of the Python reference, of the schema and of equations: complete, and in the form that their tools read."""

from importlib.util import find_spec
from xml.etree import ElementTree

import pytest

import musync
from flows.store.arrays import EVERY_ARRAY
from reference_pages.modules import PAGES, write_module_page
from reference_pages.schema import write_schema_page
from tasks.conventions import CHANNELS_BY_NAME
from tests.browsers import open_chromium
from tests.documents import DOCUMENTS, list_blocks

OBJECTS = [path for _, _, objects in PAGES.values() for path in objects]


def test_every_module_of_the_reference_exists_and_stands_there_once():
    assert len(set(OBJECTS)) == len(OBJECTS)
    assert [path for path in OBJECTS if path.startswith("tasks.") and path != "tasks.errors.InputError"
            and find_spec(path) is None] == []  # fmt: skip


def test_all_that_musync_offers_is_described_under_its_public_name():
    page = write_module_page(*PAGES["musync"])
    assert {name for name in musync.__all__ if f"\n## `musync.{name}`\n" not in page} == set()


def test_the_schema_has_every_column_and_every_array():
    page = write_schema_page()
    names = [*CHANNELS_BY_NAME, *EVERY_ARRAY]
    assert [name for name in names if f"| `{name}` |" not in page] == []
    assert "| `pitch` | rad | theta | platform\\_pitch\\_fore\\_down |" in page


def test_docstrings_name_meanings_where_numpy_has_types():
    pytest.importorskip("griffe", reason="griffe reads docstrings: pip install 'musync-gs[docs]'")
    from reference_pages.docstrings import rewrite_docstring

    text = "Do it [1].\n\nParameters\n----------\na, b : two [m],\n    both `x[0]`\nc : [s]\n\n"
    text += "Returns\n-------\nfloat64 [N] poses\n"
    assert rewrite_docstring(text) == (
        "Do it \\[1].\n\nParameters\n----------\na, b\n    two \\[m],\n    both `x[0]`\nc\n    \\[s]\n\n"
        "**Returns**\n\nfloat64 \\[N] poses\n"
    )
    assert "Returns\n-------\nStereoSequence" in rewrite_docstring(
        "Read.\n\nReturns\n-------\nStereoSequence\n"
    )


def test_every_equation_of_the_documents_becomes_mathml():
    pytest.importorskip("latex2mathml", reason="latex2mathml draws equations: pip install 'musync-gs[docs]'")
    from reference_pages.equations import format_equation

    blocks = [block for document in DOCUMENTS for block in list_blocks(document, "math")]
    assert len(blocks) > 8
    for block in blocks:
        drawn = ElementTree.fromstring(f"<body>{format_equation(block)}</body>")  # noqa: S314
        assert len(drawn) == block.count("\\\\") + 1
        words = "".join(drawn.itertext())
        assert "\\" not in words and "&" not in words, block


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("mkdocs", reason="mkdocs builds the site: pip install 'musync-gs[docs]'")
    import subprocess
    import sys

    from manifests.provenance import SOURCE_ROOT

    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=SOURCE_ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.minutes
def test_the_site_builds_without_a_warning(site):
    page = (site / "reference" / "python" / "vehicle.html").read_text()
    assert "compute_contact_load" in page and "(paper, Eq. app_unilateral_contact)" in page


@pytest.mark.minutes
def test_the_search_works_from_files_and_fetches_nothing(site):
    asked = []
    with open_chromium() as browser:
        tab = browser.new_page()
        tab.on("request", lambda request: asked.append(request.url))
        tab.goto((site / "how-to" / "write-a-grid.html").as_uri())
        tab.click(".md-search__input")
        tab.keyboard.type("quarantine")
        assert tab.get_attribute(".md-search-result__link", "href").startswith("file:")
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
