"""Every page that is made from the code: what writes it, by its path below ``docs/``."""

from collections.abc import Callable

from reference_pages import catalogues, modules
from reference_pages.schema import write_schema_page

WRITERS: dict[str, Callable[[], str]] = {
    **catalogues.WRITERS,
    **modules.WRITERS,
    "reference/schema.md": write_schema_page,
}
