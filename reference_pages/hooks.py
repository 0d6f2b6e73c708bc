"""Hooks of the documentation's build: pages and tables that are made from the code join those that people write."""

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from reference_pages.pages import WRITERS, insert_tables


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to those found in ``docs/``.

    Parameters
    ----------
    files : found by MkDocs
    config : of the build
    """
    for path, write in WRITERS.items():
        files.append(File.generated(config, path, content=write()))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Return a page with the tables that it asks for.

    Parameters
    ----------
    markdown : of the page
    page, config, files : of the build
    """
    return insert_tables(markdown)
