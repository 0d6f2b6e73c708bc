"""The page of a dataset's schema: its views, arrays and grid file, from the tables that name the columns."""

from typing import Any

from flows.reading.query import list_columns
from flows.store.arrays import arrays_of
from reference_pages.markdown import format_table

MEANINGS = {
    "clips": "a row a clip: controls, surface, outcome, verdict",
    "ticks": "a row a millisecond of a clip: all physics",
    "frames": "a row a frame: the tick that it shows, the rig's pose, the recovered motion",
    "verdicts": "a row a clip: its pose check",
    "pairs": "a row two clips that differ in one control, and what that changes",
}
"""Rows of each view."""


def write_schema_page() -> str:
    """Return the page of the dataset's schema as Markdown."""
    columns = list_columns()
    page = (
        "# Schema of a dataset\n\nEvery column of every view and every array of the frames: made from"
        " `tasks/conventions.py` and `flows/store/arrays.py`, from which the Parquet and Zarr files take their metadata"
        " too. `musync lab schema` prints the same. [Architecture](../explanation/architecture.md#dataset) lists the files,"
        " [Query a dataset](../how-to/query-a-dataset.md) says how to read them. A unit of 1 is dimensionless; NaN in"
        ' Parquet, and NULL in a view, mean "not represented".\n'
    )
    for view, meaning in MEANINGS.items():
        rows = [
            (f"`{c['name']}`", c["unit"], c["symbol"], c["standard_name"], c["description"])
            for c in columns[view]
        ]
        head = ("column", "unit", "symbol", "CF standard name", "meaning")
        page += f"\n## View `{view}`\n\n{meaning.capitalize()}.\n\n" + format_table(head, rows)
    return page + "\n## Arrays of the frames\n\n" + _write_arrays(columns["arrays"])


def _write_arrays(described: list[dict[str, Any]]) -> str:
    always = arrays_of(labels=False)
    rows = [
        (
            f"`{row['name']}`",
            row["dtype"],
            ", ".join(row["dimensions"]),
            row["unit"],
            row["description"],
            "" if row["name"] in always else "where the grid asks for labels",
        )
        for row in described
    ]
    classes = arrays_of(labels=True)["class"].flags
    return (
        format_table(("array", "type", "dimensions", "unit", "meaning", "written"), rows)
        + "\n## Classes of a pixel\n\n"
        + format_table(("code", "class"), [(code, f"`{name}`") for code, name in enumerate(classes)])
    )
