"""Hooks of the documentation's build: pages that are made from the code join those that people write."""

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from reference_pages.catalogues import write_catalogue_pages
from reference_pages.modules import write_module_pages
from reference_pages.schema import write_schema_page


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to those found in ``docs/``.

    Parameters
    ----------
    files : found by MkDocs
    config : of the build
    """
    pages = write_catalogue_pages() | write_module_pages() | {"reference/schema.md": write_schema_page()}
    for path, content in pages.items():
        files.append(File.generated(config, path, content=content))
    return files
