"""Every page and table that is made from the code: what writes it."""

import re
from collections.abc import Callable

from reference_pages import (
    campaign_checks,
    catalogues,
    commands,
    grids,
    modules,
    schema,
    vehicle,
    verdict_rules,
)

WRITERS: dict[str, Callable[[], str]] = {
    **catalogues.WRITERS,
    **modules.WRITERS,
    "reference/schema.md": schema.write_schema_page,
}
"""Pages, by their path below ``docs/``."""
TABLES: dict[str, Callable[[], str]] = {
    name: write
    for module in (campaign_checks, commands, grids, schema, vehicle, verdict_rules)
    for name, write in module.TABLES.items()
}
"""Tables of pages that people write, by the name under which a page asks for them."""
ASKED = re.compile(r"^<!-- table: (.+) -->$", flags=re.M)
"""Line of a page at whose place a table belongs."""


def insert_tables(page: str) -> str:
    """Return a page with the tables that it asks for.

    Parameters
    ----------
    page : Markdown

    Raises
    ------
    KeyError
        Where no table has the name.
    """
    return ASKED.sub(lambda asked: TABLES[asked[1]](), page)
