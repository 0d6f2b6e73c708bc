"""Recordings as tables: CSV and Parquet, a column for each signal and one for the clock."""

import io
import json
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from catalogs.campaign_files import parse_columns
from catalogs.channel_maps import ChannelMap, CsvEntry
from catalogs.documents import read_content
from catalogs.recordings.forms import (
    LARGEST_FILE,
    Form,
    SignalSummary,
    describe_clock_unit,
    describe_missing,
    require_clock,
    sample_column,
    signal_names,
    summarise_signal,
)
from catalogs.sentences import shorten, shorten_value
from tasks.campaign.signals import Signal
from tasks.errors import InputError

Columns = dict[str, NDArray[np.float64]]
Take = Callable[[Path, tuple[str, ...], CsvEntry], tuple[Columns, dict[str, str]]]
ListColumns = Callable[[Path, CsvEntry], tuple[Columns, dict[str, str], dict[str, str]]]
SEPARATORS = (";", ",", "\t", "|")
UNITS_REMEDY = "give csv: {units_row: true} in the map"
NUMBER = re.compile(r"[+-]?\d*[.,]?\d+([eE][+-]?\d+)?")
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def _read_with(take: Take) -> Callable[[Path, ChannelMap], dict[str, Signal]]:
    def read(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
        clock, names = require_clock(path, channel_map), signal_names(channel_map)
        columns, units = take(path, tuple(dict.fromkeys((clock.source, *names))), channel_map.csv)
        stamps = columns[clock.source]
        if problem := describe_clock_unit(path, clock, units.get(clock.source, ""), stamps):
            raise InputError(problem)
        return {name: sample_column(stamps, columns[name], clock, units.get(name, "")) for name in names}

    return read


def _summarise_with(take_all: ListColumns) -> Callable[[Path, ChannelMap | None], list[SignalSummary]]:
    def summarise(path: Path, channel_map: ChannelMap | None) -> list[SignalSummary]:
        columns, units, notes = take_all(path, CsvEntry() if channel_map is None else channel_map.csv)
        clock = None if channel_map is None else channel_map.time
        rows = []
        for name, values in columns.items():
            if clock is None or clock.source not in columns:
                signal = Signal(time=np.empty(0), values=values, unit=units.get(name, ""))
            else:
                signal = sample_column(columns[clock.source], values, clock, units.get(name, ""))
            rows.append(summarise_signal(name, signal, notes.get(name, "")))
        return rows

    return summarise


def _take_parquet(path: Path, wanted: tuple[str, ...], _: CsvEntry) -> tuple[Columns, dict[str, str]]:
    content = read_content(path, "recording", LARGEST_FILE)
    columns, units = parse_columns(content, path.name, wanted)
    if problems := describe_missing(path, wanted, columns, pq.read_schema(pa.BufferReader(content)).names):
        raise InputError(problems)
    return columns, units


def _take_all_parquet(path: Path, _: CsvEntry) -> tuple[Columns, dict[str, str], dict[str, str]]:
    content = read_content(path, "recording", LARGEST_FILE)
    try:
        schema = pq.read_schema(pa.BufferReader(content))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise InputError(f"{path.name} must be a Parquet file of numbers; {shorten(error)}") from None
    numbers = {f.name for f in schema if pa.types.is_integer(f.type) or pa.types.is_floating(f.type)}
    columns, units = parse_columns(content, path.name, numbers)
    notes = {f.name: f"not of numbers, but of {f.type}" for f in schema if f.name not in numbers}
    rows = pq.read_metadata(pa.BufferReader(content)).num_rows
    return columns | {name: np.full(rows, np.nan) for name in notes}, units, notes


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
    return "utf-8-sig"


def _load_frame(path: Path, options: CsvEntry) -> tuple[pd.DataFrame, list[str]]:
    """Return a table below its names, and the unit of each column, none without a row of units."""
    content = read_content(path, "recording", LARGEST_FILE)
    encoding = _find_encoding(path, content)
    filled = (
        (number, line)
        for number, line in enumerate(io.BytesIO(content))
        if number >= options.skip_rows and line.strip()
    )
    names = next(filled, (0, b""))[1].decode(encoding, "replace").strip()
    found = [separator for separator in SEPARATORS if separator in names]
    if found and len(options.separator) == 1 and options.separator not in names:
        raise InputError(
            f"{path}: names of signals must be separated by {shorten_value(options.separator)}; the first line is"
            f" {shorten_value(names)}: give csv: {{separator: {json.dumps(found[0])}}} in the map"
        )
    skipped: int | list[int] = options.skip_rows
    row = next(filled, None) if options.units_row else None
    if row is not None:
        skipped = [*range(options.skip_rows), row[0]]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            frame = pd.read_csv(
                io.BytesIO(content),
                sep=options.separator,
                decimal=options.decimal,
                skiprows=skipped,
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
    return frame, [] if row is None else _split_units(path, row[1].decode(encoding), options)


def _split_units(path: Path, row: str, options: CsvEntry) -> list[str]:
    """Return the units of a row, without brackets.

    Raises
    ------
    InputError
        If it cannot be read, or holds numbers, and so is a row of samples.
    """
    try:
        cells = pd.read_csv(
            io.StringIO(row), sep=options.separator, header=None, dtype=str, keep_default_na=False
        )
    except pd.errors.ParserError as error:
        raise InputError(f"{path}: the row of units must be a row of text; {shorten(error)}") from None
    units = [str(cell).strip().strip("[]()") for cell in cells.iloc[0]]
    if any(NUMBER.fullmatch(unit) and unit != "1" for unit in units):
        raise InputError(
            f"{path}: with csv: {{units_row: true}} the row below the names must hold units; it is"
            f" {shorten_value(row.strip())}: leave units_row away"
        )
    return units


def _take_csv(path: Path, wanted: tuple[str, ...], options: CsvEntry) -> tuple[Columns, dict[str, str]]:
    frame, units = _load_frame(path, options)
    names = [str(name).strip() for name in frame.columns]
    problems = describe_missing(path, wanted, names, names)
    columns: Columns = {}
    notes: dict[str, str] = {}
    for name in wanted:
        if names.count(name) > 1:
            problems.append(
                f"{path.name}: signal {name} must stand once; {names.count(name)} columns have its name"
            )
        elif name in names:
            columns[name], notes[name] = _convert_column(frame.iloc[:, names.index(name)])
    if any(notes.values()) and _is_first_row_of_units(columns):
        first = ", ".join(
            shorten_value(str(frame.iloc[0, names.index(name)])) for name in columns if notes[name]
        )
        problems.append(
            f"{path.name}: row 1 below the names must hold numbers; it holds {first}, which looks like a row of units:"
            f" {UNITS_REMEDY}"
        )
    else:
        problems += [
            f"{path.name}: signal {name} must be of numbers; {note}" for name, note in notes.items() if note
        ]
    if problems:
        raise InputError(problems)
    return columns, dict(zip(names, units, strict=False))


def _is_first_row_of_units(columns: Columns) -> bool:
    """Return whether the first row has a number in no column, while later rows have some."""
    table = np.isfinite(np.column_stack(list(columns.values())))
    return not table[:1].any() and bool(table[1:].any())


def _take_all_csv(path: Path, options: CsvEntry) -> tuple[Columns, dict[str, str], dict[str, str]]:
    frame, units = _load_frame(path, options)
    read = {str(name).strip(): _convert_column(frame.iloc[:, k]) for k, name in enumerate(frame.columns)}
    notes = {name: note for name, (_, note) in read.items() if note}
    columns = {name: values for name, (values, _) in read.items()}
    return columns, dict(zip(read, units, strict=False)), notes


def _convert_column(column: pd.Series) -> tuple[NDArray[np.float64], str]:
    """Return a column as numbers, NaN in place of text; and its first text with what to do, empty if there is none."""
    try:
        return np.asarray(column, dtype=np.float64), ""
    except (TypeError, ValueError):
        values = pd.to_numeric(column, errors="coerce").to_numpy(np.float64)
    wrong = np.isnan(values) & column.notna().to_numpy()
    row, text = int(np.argmax(wrong)), str(column.iloc[int(np.argmax(wrong))])
    if DECIMAL_COMMA.fullmatch(text.strip()):
        remedy = "give csv: {decimal: ','} in the map"
    elif re.search(r"\d[:-]\d", text):
        remedy = "write times as a number of seconds"
    elif row == 0 and np.count_nonzero(wrong) == 1:
        remedy = f"if this is a row of units, {UNITS_REMEDY}; else correct it"
    else:
        remedy = "correct it, or leave it empty"
    return values, f"row {row + 1} below the names has {shorten_value(text)}: {remedy}"


CSV = Form(read=_read_with(_take_csv), summarise=_summarise_with(_take_all_csv))
PARQUET = Form(read=_read_with(_take_parquet), summarise=_summarise_with(_take_all_parquet))
