"""The answer to a query as a CSV or Parquet file, which Python writes: SQL itself stays shut out of the disk."""

import csv
import json
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from flows.store.address import is_address
from flows.store.outputs import Outputs
from tasks.errors import InputError

FORMATS = ("csv", "parquet")
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters of a text that a spreadsheet takes for a formula."""


def open_answer_file(dataset: str, to: str | None, out: str | None) -> Outputs | None:
    """Return where the answer goes, before the query runs; None where it is printed.

    Parameters
    ----------
    dataset : that is asked: the file must lie outside it
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
    elif not is_address(dataset) and Path(out).resolve().is_relative_to(Path(dataset).resolve()):
        problems.append(
            f"--out {out}: must lie outside the dataset, whose files are all recorded; name another file"
        )
    if problems or out is None:
        raise InputError(problems)
    file = Path(out)
    return Outputs(file.parent, "sql", file.name)


def format_csv(names: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return CSV: numbers in the shortest form that reads back to the same double, NULL empty, lists as JSON.

    Text that a spreadsheet would take for a formula gets an apostrophe in front, as in the CSV of ``musync report``.

    Parameters
    ----------
    names : of the columns
    rows : of plain values, as `flows.reading.query.make_plain` gives them
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(_format_cell, names))
    writer.writerows(map(_format_cell, row) for row in rows)
    return text.getvalue()


def format_parquet(table: pa.Table) -> memoryview:
    """Return a table as the bytes of a Parquet file, with the types that DuckDB gave it."""
    buffer = pa.BufferOutputStream()
    pq.write_table(table, buffer, compression="zstd")
    return memoryview(buffer.getvalue())


def _format_cell(value: Any) -> Any:
    if isinstance(value, list):
        return json.dumps(value)
    if isinstance(value, str) and value.startswith(_FORMULA):
        return f"'{value}"
    return value
