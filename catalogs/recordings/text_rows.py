"""Text files as rows: those above the names, the names, what stands below them, and the samples."""

import csv
import io
import json
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from catalogs.campaign_files import find_name_bounds
from catalogs.channel_maps import CsvEntry
from catalogs.documents import read_content
from catalogs.recordings.forms import LARGEST_FILE
from catalogs.sentences import shorten, shorten_value
from tasks.errors import InputError

SEPARATORS = (";", ",", "\t", "|")
NUMBER = re.compile(r"[+-]?\d*[.,]?\d+([eE][+-]?\d+)?")
SEARCHED = 100
"""Rows from the top among which the names are looked for [1]."""


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """A file of text.

    Parameters
    ----------
    names : of its columns, as they stand
    below : cells of each declared row between the names and the samples
    samples : a column for each name, with numbers from 0; its rows are numbered below the names
    """

    names: list[str]
    below: list[list[str]]
    samples: pd.DataFrame


def read_text_table(path: Path, options: CsvEntry) -> TextTable:
    """Return a table of text.

    Parameters
    ----------
    path : of the file
    options : how it is written

    Raises
    ------
    InputError
        If it is no table as the options describe it, or has more or longer names than a recording has.
    """
    content = read_content(path, "recording", LARGEST_FILE)
    encoding = _find_encoding(path, content)
    raw = io.BytesIO(content)
    try:
        rows = _read_rows(raw, encoding, options)
        names = next(
            (cells for number, cells in enumerate(rows) if number >= options.skip_rows and any(cells)), []
        )
        below = [next((cells for cells in rows if any(cells)), []) for _ in options.rows_below]
    except csv.Error as error:
        raise InputError(f"{path}: must be a table of text; {shorten(error)}") from None
    if problems := find_name_bounds(names, path.name):
        raise InputError(problems)
    if problem := _find_separator_problem(names, options):
        raise InputError(f"{path}: {problem}")
    for kind, cells in zip(options.rows_below, below, strict=True):
        _check_row_below(path, kind, cells, options)
    return TextTable(
        names=names, below=below, samples=_read_samples(path, raw, encoding, len(names), options)
    )


def find_row_of_names(path: Path, options: CsvEntry, wanted: tuple[str, ...]) -> int | None:
    """Return the rows above the first row that holds all wanted names; None where there is no such row at the top.

    Parameters
    ----------
    path, options : as of `read_text_table`
    wanted : names
    """
    content = read_content(path, "recording", LARGEST_FILE)
    rows = _read_rows(io.BytesIO(content), _find_encoding(path, content), options)
    try:
        return next(
            (k for k, cells in zip(range(SEARCHED), rows, strict=False) if {*wanted} <= {*cells}), None
        )
    except csv.Error:
        return None


def _find_encoding(path: Path, content: bytes) -> str:
    """Return how a text is written: UTF-8, else Latin-1, in which loggers write the signs of degree and square.

    Raises
    ------
    InputError
        If it holds zero bytes, as UTF-16 does, and files that are no text.
    """
    if b"\0" in content:
        raise InputError(f"{path}: must be UTF-8 or Latin-1 text; it holds zero bytes: save it as UTF-8")
    try:
        content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def _read_rows(raw: io.BytesIO, encoding: str, options: CsvEntry) -> Iterator[list[str]]:
    """Yield the cells of each row, of which one may go over several lines, and read no line beyond it."""
    lines = (line.decode(encoding).removeprefix("\ufeff") for line in raw)
    rows: Iterator[list[str]] = (re.split(options.separator, line.strip()) for line in lines)
    if len(options.separator) == 1:
        rows = csv.reader(lines, delimiter=options.separator)
    return ([cell.strip() for cell in cells] for cells in rows)


def _find_separator_problem(names: list[str], options: CsvEntry) -> str | None:
    found = [separator for separator in SEPARATORS if len(names) == 1 and separator in names[0]]
    if not found:
        return None
    return (
        f"names of signals must be separated by {shorten_value(options.separator)}; the first line is"
        f" {shorten_value(names[0])}: give csv: {{separator: {json.dumps(found[0])}}} in the map"
    )


def _check_row_below(path: Path, kind: str, cells: list[str], options: CsvEntry) -> None:
    """Refuse a row below the names that holds samples, or more than a row."""
    given = "units_row: true" if options.units_row else f"below_names: [{', '.join(options.rows_below)}]"
    if any("\n" in cell for cell in cells):
        raise InputError(f"{path}: the row of {kind} must be a row of text; it goes over several lines")
    if any(NUMBER.fullmatch(cell) and cell != "1" for cell in cells) and kind == "units":
        raise InputError(
            f"{path}: with csv: {{{given}}} the row below the names must hold {kind}; it is"
            f" {shorten_value(options.separator.join(cells))}: leave"
            f" {'units_row' if options.units_row else 'it'} away"
        )


def _read_samples(
    path: Path, raw: io.BytesIO, encoding: str, columns: int, options: CsvEntry
) -> pd.DataFrame:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            frame = pd.read_csv(
                io.BytesIO(raw.read()),
                sep=options.separator,
                decimal=options.decimal,
                thousands=options.thousands or None,
                header=None,
                names=range(columns),
                encoding=encoding,
                index_col=False,  # else rows that end in a separator move every value to its neighbour's name
            )
    except pd.errors.ParserWarning:
        raise InputError(
            f"{path}: rows must have a name for each value; they have more values than the first line has names:"
            " add the missing names"
        ) from None
    except (ValueError, TypeError, OverflowError, re.error) as error:
        raise InputError(f"{path}: must be a table of text; {shorten(error)}") from None
    frame.index += 1 + len(options.rows_below)
    return frame
