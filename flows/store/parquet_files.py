"""Parquet files that may be a stranger's: what their footers say is bounded before a row of them is read."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from catalogs.sentences import shorten
from tasks.errors import InputError

CLIPS_PER_FILE = 100
MOST_COLUMNS, LONGEST_NAME = 500, 200
"""Columns of a table that is read, and characters of a column's name [1]. muSync writes a tenth of the columns; DuckDB
takes minutes for some thousands."""
SEALED = "musync lab repair makes it again"
STAGED = "remove it, and the same musync generate command makes its clip again"
CHECKED: Mapping[str, Any] = {"page_checksum_verification": True}
"""How pyarrow is to read Parquet: each page is held against the checksum that it was written with."""


def call_reader(
    path: Path, read: Callable[..., Any], *arguments: Any, remedy: str = SEALED, **options: Any
) -> Any:
    """Call a reader of Parquet, whose errors become sentences about the file.

    Parameters
    ----------
    path : of the file
    read : the reader
    arguments, options : what it gets
    remedy : what the sentence advises
    """
    try:
        return read(*arguments, **options)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; is this a finished muSync dataset?") from None
    except (pa.ArrowException, OSError, ValueError, TypeError) as error:
        raise InputError(
            f"{path}: must be a Parquet table as muSync writes it; {shorten(error)}: {remedy}"
        ) from None


def refuse_footer(path: Path, most: int, remedy: str = SEALED) -> None:
    """Refuse a table by its footer: a few kilobytes hold rows and names that no memory does.

    Parameters
    ----------
    path : of a Parquet file
    most : rows that it may have by its dataset's plan [1]
    remedy : what the sentence advises

    Raises
    ------
    InputError
        If it cannot be read, has more rows, more columns or longer names, or a column twice.
    """
    footer = call_reader(path, pq.read_metadata, path, remedy=remedy)
    counts = {
        "rows": (footer.num_rows, most),
        "columns": (footer.num_columns, MOST_COLUMNS),
        "characters in a column's name": (max(map(len, footer.schema.names), default=0), LONGEST_NAME),
    }
    problems = [
        f"{path}: must have at most {bound:,} {what}; it has {count:,}: {remedy}"
        for what, (count, bound) in counts.items()
        if not 0 <= count <= bound
    ]
    if problems:
        raise InputError(problems)
    names = call_reader(path, footer.schema.to_arrow_schema, remedy=remedy).names
    if len({*names}) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"{path}: each column must stand once; {shorten(twice)} stands twice: {remedy}")
