"""Recordings as tables: CSV and Parquet, a column for each signal and one for the clock."""

import io
import re
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
    describe_missing,
    require_clock,
    sample_column,
    signal_names,
    summarise_signal,
)
from catalogs.sentences import shorten
from tasks.campaign.signals import Signal
from tasks.errors import InputError

Columns = dict[str, NDArray[np.float64]]
Take = Callable[[Path, tuple[str, ...], CsvEntry], tuple[Columns, dict[str, str]]]
ListColumns = Callable[[Path, CsvEntry], tuple[Columns, dict[str, str]]]


def _read_with(take: Take) -> Callable[[Path, ChannelMap], dict[str, Signal]]:
    def read(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
        clock, names = require_clock(path, channel_map), signal_names(channel_map)
        columns, units = take(path, tuple(dict.fromkeys((clock.source, *names))), channel_map.csv)
        stamps = columns[clock.source]
        return {name: sample_column(stamps, columns[name], clock, units.get(name, "")) for name in names}

    return read


def _summarise_with(take_all: ListColumns) -> Callable[[Path, ChannelMap | None], list[SignalSummary]]:
    def summarise(path: Path, channel_map: ChannelMap | None) -> list[SignalSummary]:
        columns, units = take_all(path, CsvEntry() if channel_map is None else channel_map.csv)
        clock = None if channel_map is None else channel_map.time
        rows = []
        for name, values in columns.items():
            if clock is None or clock.source not in columns:
                signal = Signal(time=np.empty(0), values=values, unit=units.get(name, ""))
            else:
                signal = sample_column(columns[clock.source], values, clock, units.get(name, ""))
            rows.append(summarise_signal(name, signal))
        return rows

    return summarise


def _take_parquet(path: Path, wanted: tuple[str, ...], _: CsvEntry) -> tuple[Columns, dict[str, str]]:
    content = read_content(path, "recording", LARGEST_FILE)
    columns, units = parse_columns(content, path.name, wanted)
    if problems := describe_missing(path, wanted, columns, pq.read_schema(pa.BufferReader(content)).names):
        raise InputError(problems)
    return columns, units


def _take_all_parquet(path: Path, _: CsvEntry) -> tuple[Columns, dict[str, str]]:
    content = read_content(path, "recording", LARGEST_FILE)
    try:
        schema = pq.read_schema(pa.BufferReader(content))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise InputError(f"{path.name} must be a Parquet file of numbers; {shorten(error)}") from None
    numbers = {f.name for f in schema if pa.types.is_integer(f.type) or pa.types.is_floating(f.type)}
    return parse_columns(content, path.name, numbers)


def _load_frame(path: Path, options: CsvEntry) -> pd.DataFrame:
    try:
        return pd.read_csv(
            io.BytesIO(read_content(path, "recording", LARGEST_FILE)),
            sep=options.separator,
            decimal=options.decimal,
            skiprows=options.skip_rows,
            encoding="utf-8-sig",
        )
    except InputError:
        raise
    except (ValueError, TypeError, OverflowError, re.error) as error:
        raise InputError(f"{path}: must be a table of text; {shorten(error)}") from None


def _take_csv(path: Path, wanted: tuple[str, ...], options: CsvEntry) -> tuple[Columns, dict[str, str]]:
    frame = _load_frame(path, options)
    names = [str(name).strip() for name in frame.columns]
    problems = describe_missing(path, wanted, names, names)
    columns: Columns = {}
    for name in wanted:
        if names.count(name) > 1:
            problems.append(
                f"{path.name}: signal {name} must stand once; {names.count(name)} columns have its name"
            )
        elif name in names:
            values = _convert_column(frame.iloc[:, names.index(name)])
            if values is None:
                problems.append(f"{path.name}: signal {name} must be of numbers; it has text in it")
            else:
                columns[name] = values
    if problems:
        raise InputError(problems)
    return columns, {}


def _take_all_csv(path: Path, options: CsvEntry) -> tuple[Columns, dict[str, str]]:
    frame = _load_frame(path, options)
    columns = {str(name).strip(): _convert_column(frame.iloc[:, k]) for k, name in enumerate(frame.columns)}
    return {name: values for name, values in columns.items() if values is not None}, {}


def _convert_column(column: pd.Series) -> NDArray[np.float64] | None:
    """Return a column as numbers; None if it has text in it."""
    try:
        return np.asarray(column, dtype=np.float64)
    except (TypeError, ValueError):
        return None


CSV = Form(read=_read_with(_take_csv), summarise=_summarise_with(_take_all_csv))
PARQUET = Form(read=_read_with(_take_parquet), summarise=_summarise_with(_take_all_parquet))
