"""The answer to a query as a CSV or Parquet file, which Python writes: SQL itself stays shut out of the disk."""

import csv
import json
import math
from collections.abc import Sequence
from decimal import Decimal
from io import StringIO
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from flows.store.missing import null_missing
from flows.store.outputs import Outputs
from tasks.errors import InputError

FORMATS = ("csv", "parquet")
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters of a text that a spreadsheet takes for a formula."""


def open_answer_file(to: str | None, out: str | None) -> Outputs | None:
    """Return where the answer goes, before the query runs; None where it is printed.

    Parameters
    ----------
    to : csv, parquet or None
    out : the file, or None

    Raises
    ------
    InputError
        Listing every option that is wrong, or naming a file in the way that ``musync sql`` did not write.
    """
    if to is None and out is None:
        return None
    problems = []
    if to not in FORMATS:
        problems.append(f"--to {to or 'is missing'}: must be {' or '.join(FORMATS)}, the form of --out")
    if not out:
        problems.append("--out: must name the file that --to writes")
    if problems or out is None:
        raise InputError(problems)
    file = Path(out)
    return Outputs(file.parent, "sql", file.name)


def format_csv(names: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return CSV: numbers in the shortest form that reads back to the same double, lists and structures as JSON.

    NULL and numbers that are not finite are empty; decimals keep all their digits.

    Text that a spreadsheet would take for a formula gets an apostrophe in front, as in the CSV of ``musync report``.

    Parameters
    ----------
    names : of the columns
    rows : values as DuckDB gives them
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(_format_cell, names))
    writer.writerows(map(_format_cell, row) for row in rows)
    return text.getvalue()


def format_parquet(table: pa.Table) -> memoryview:
    """Return a table as the bytes of a Parquet file, with the types that DuckDB gave it; NaN is NULL."""
    buffer = pa.BufferOutputStream()
    pq.write_table(null_missing(table), buffer, compression="zstd")
    return memoryview(buffer.getvalue())


def make_plain(value: Any) -> Any:
    """Return a value that JSON has: a decimal as a number, a structure or map as an object; other values as text."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() else float(value)
    if isinstance(value, dict):
        return {str(make_plain(key)): make_plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [make_plain(entry) for entry in value]
    return value if isinstance(value, bool | int | float | str | None) else str(value)


def _format_cell(value: Any) -> Any:
    if isinstance(value, Decimal):
        return value
    if isinstance(value, bool | list | tuple | dict):
        return json.dumps(make_plain(value))
    if isinstance(value, str) and value.startswith(_FORMULA):
        return f"'{value}"
    return make_plain(value)
