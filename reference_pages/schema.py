"""The page of a dataset's schema, and tables of symbols and of measured channels, from the tables that name columns."""

import re
from typing import Any

from flows.reading.query import list_columns
from flows.store.arrays import EVERY_ARRAY, INSTANCE_ARRAYS, LABEL_ARRAYS
from reference_pages.markdown import format_table
from tasks.campaign.channels import MAIN_CHANNELS, SIDE_CHANNELS
from tasks.conventions import CHANNELS_BY_NAME

MEANINGS = {
    "clips": "a row a clip: controls, surface, outcome, verdict",
    "ticks": "a row a millisecond of a clip: all physics",
    "frames": "a row a frame: the tick that it shows, the rig's pose, the recovered motion",
    "objects": "a row a road user and frame: its boxes, motion and how much of it one sees",
    "verdicts": "a row a clip: its pose check",
    "pairs": "a row two clips that differ in one control, and what that changes",
}
"""Rows of each view."""
FOLLOWING = re.compile("_(p05|p50|p95|change)$")
"""End of the name of a column that is a range or a change of another one."""


def write_schema_page() -> str:
    """Return the page of the dataset's schema as Markdown."""
    columns = list_columns()
    page = (
        "# Schema of a dataset\n\nEvery column of every view and every array of the frames. `musync lab schema` prints"
        " the same, and the Parquet and Zarr files carry it. [Query a dataset](../how-to/query-a-dataset.md) shows how"
        " to read them. A unit of 1 is dimensionless. NULL in a view, and NaN in files of old datasets, mean"
        ' "not represented".\n'
    )
    for view, meaning in MEANINGS.items():
        rows = [
            (f"`{c['name']}`", c["unit"], c["symbol"], c["standard_name"], c["description"])
            for c in columns[view]
        ]
        head = ("column", "unit", "symbol", "CF standard name", "meaning")
        page += f"\n## View `{view}`\n\n{meaning.capitalize()}.\n\n" + format_table(head, rows)
    return page + "\n## Arrays of the frames\n\n" + _write_arrays(columns["arrays"])


def write_symbol_table() -> str:
    """Return the table of the paper's symbols with their columns, of two axles the front one's, as Markdown."""
    rows = [
        (channel.symbol, channel.description, f"`{name}`", channel.unit)
        for name, channel in CHANNELS_BY_NAME.items()
        if channel.symbol
        and not FOLLOWING.search(name)
        and f"{name.removesuffix('_r')}_f" not in CHANNELS_BY_NAME
    ]
    return format_table(("symbol", "meaning", "column", "unit"), rows)


def _write_arrays(described: list[dict[str, Any]]) -> str:
    asked = dict.fromkeys(LABEL_ARRAYS, "where the grid asks for labels")
    asked |= dict.fromkeys(INSTANCE_ARRAYS, "where the grid has road users")
    rows = [
        (
            f"`{row['name']}`",
            row["dtype"],
            ", ".join(row["dimensions"]),
            row["unit"],
            row["description"],
            asked.get(row["name"], ""),
        )
        for row in described
    ]
    classes = EVERY_ARRAY["class"].flags
    return (
        format_table(("array", "type", "dimensions", "unit", "meaning", "written"), rows)
        + "\n## Classes of a pixel\n\n"
        + format_table(("code", "class"), [(code, f"`{name}`") for code, name in enumerate(classes)])
    )


def write_channel_table() -> str:
    """Return the table of the columns of a measured run, those first that every map must name, as Markdown."""
    rows = [
        (f"`{channel.name}`", "yes" if channel in MAIN_CHANNELS else "", channel.unit, channel.description)
        for channel in (*MAIN_CHANNELS, *SIDE_CHANNELS)
    ]
    return format_table(("channel", "main", "unit", "meaning"), rows)


TABLES = {"symbols": write_symbol_table, "measured channels": write_channel_table}
"""Function that writes each table, by the name under which a page asks for it."""
