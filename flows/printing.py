"""Results of commands as text for people: a line for each value, a table for each list of rows."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from flows.running.terminal import escape_controls, open_console, print_lines

LEAST_WIDTH = 12
"""To which a column is folded where a table is too wide [characters]."""


def print_json(value: dict[str, Any]) -> None:
    """Print a result as JSON."""
    print_lines(json.dumps(value, indent=1))


def print_result(value: dict[str, Any]) -> None:
    """Print a result: a line for each value and each sentence of a list, a table where it is a list of rows."""
    for key, entry in value.items():
        if isinstance(entry, list) and entry and isinstance(entry[0], dict):
            _print_table(key, entry)
        elif isinstance(entry, list) and any(isinstance(item, str) and ", " in item for item in entry):
            print_lines("\n".join([f"{key}:", *(f"  - {_format_value(item)}" for item in entry)]))
        else:
            print_lines(f"{key}: {_format_value(entry)}")


def _print_table(title: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Print a table so that every column can be read.

    One that is too wide for the terminal lies on its side, a line a column, where its rows are few; else its long
    values are folded, or it comes in blocks of columns, each with the first one.
    """
    # its import takes longer than many a command
    from rich.table import Table

    console = open_console()
    columns = [[escape_controls(name), *(_format_value(row.get(name)) for row in rows)] for name in rows[0]]
    lines = [list(line) for line in zip(*columns, strict=True)]
    upright, blocks = True, [columns]
    if _measure(columns) > console.width:
        if len(rows) < len(columns) and _measure(lines, LEAST_WIDTH) <= console.width:
            upright, blocks = False, [lines]
        elif _measure(columns, LEAST_WIDTH) > console.width:
            blocks = _part_columns(columns, console.width)
    for block in blocks:
        table = Table(title=title, title_justify="left", show_header=upright)
        for head, *_ in block:
            table.add_column(head if upright else "", overflow="fold")
        for line in list(zip(*block, strict=True))[upright:]:
            table.add_row(*line)
        console.print(table)


def _measure(columns: Sequence[Sequence[str]], folded: int | None = None) -> int:
    """Characters across a table, whose columns may be folded to a least width."""
    from rich.cells import cell_len

    widths = [max(map(cell_len, column)) for column in columns]
    return 1 + sum(3 + (width if folded is None else min(width, folded)) for width in widths)


def _part_columns(columns: list[list[str]], room: int) -> list[list[list[str]]]:
    """Blocks of columns that have room beside each other, the first column in all of them."""
    blocks = [columns[:2]]
    for column in columns[2:]:
        if _measure([*blocks[-1], column]) <= room:
            blocks[-1].append(column)
        else:
            blocks.append([columns[0], column])
    return blocks


def _format_value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, list):
        return ", ".join(_format_value(item) for item in value)
    return "-" if value is None else escape_controls(str(value))
