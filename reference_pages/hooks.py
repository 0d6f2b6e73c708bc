"""Hooks of the documentation's build: pages that are made from the code join those that people write."""

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from reference_pages.pages import WRITERS


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
