"""Results of commands as text for people: a line for each value, a table for each list of rows."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from flows.running.terminal import escape_controls, open_console, print_lines


def print_json(value: dict[str, Any]) -> None:
    """Print a result as JSON."""
    print_lines(json.dumps(value, indent=1))


def print_result(value: dict[str, Any]) -> None:
    """Print a result: a line for each value, a table where the value is a list of rows."""
    for key, entry in value.items():
        if isinstance(entry, list) and entry and isinstance(entry[0], dict):
            _print_table(key, entry)
        else:
            print_lines(f"{key}: {_format_value(entry)}")


def _print_table(title: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Print a table; one of few rows that is too wide for the terminal lies on its side, a line a column."""
    # its import takes longer than many a command
    from rich.measure import Measurement
    from rich.table import Table

    console = open_console()
    names = [escape_controls(name) for name in rows[0]]
    lines = [[_format_value(row.get(name)) for name in rows[0]] for row in rows]
    table = Table(*names, title=title, title_justify="left")
    for line in lines:
        table.add_row(*line)
    unfolded = console.options.update(width=10_000)
    if len(rows) < len(names) and Measurement.get(console, unfolded, table).maximum > console.width:
        table = Table(title=title, title_justify="left", show_header=False)
        for cells in zip(names, *lines, strict=True):
            table.add_row(*cells)
    for column in table.columns:
        column.overflow = "fold"
    console.print(table)


def _format_value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, list):
        return ", ".join(_format_value(item) for item in value)
    return "-" if value is None else escape_controls(str(value))
