"""Recordings as tables: CSV and Parquet, a column for each signal and one for the clock."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from catalogs.campaign_files import open_parquet, read_unit
from catalogs.channel_maps import ChannelMap, CsvEntry, TimeEntry
from catalogs.documents import read_content
from catalogs.entries import load
from catalogs.recordings.columns import Spelling, convert_values, make_series, read_clock, replace_numbers
from catalogs.recordings.forms import (
    LARGEST_FILE,
    Form,
    SignalSummary,
    describe_missing,
    describe_twice,
    find_clock_problem,
    number_names,
    require_clock,
    sample_column,
    signal_names,
    summarise_signal,
)
from catalogs.recordings.text_rows import find_row_of_names, read_text_table
from catalogs.sentences import shorten_value
from tasks.campaign.checks import apply_checks
from tasks.campaign.measured import Clock
from tasks.campaign.signals import Signal
from tasks.campaign.stated_units import parse_unit
from tasks.errors import InputError

Columns = dict[str, NDArray[np.float64]]


@dataclass(frozen=True, kw_only=True)
class Table:
    """A file of columns.

    Parameters
    ----------
    path : of the file
    names : of all columns, by which a map takes them
    load : returns columns by name, or why one cannot be of numbers; its rows are numbered below the names
    units : that the file states, by name
    described : where a column stands, and what is written with its name, by name
    csv : how text is written; None of a file that is no text
    """

    path: Path
    names: list[str]
    load: Callable[[Iterable[str]], Mapping[str, pd.Series | str]]
    units: Mapping[str, str]
    described: Mapping[str, str] = field(default_factory=dict)
    csv: CsvEntry | None = None

    def spell(self, channel_map: ChannelMap | None, name: str) -> Spelling:
        """Return how a column writes its values."""
        meanings = {} if channel_map is None else channel_map.meanings_of(name)
        if self.csv is None:
            return Spelling(meanings=meanings)
        return Spelling(
            meanings=self.missing | meanings, decimal=self.csv.decimal, thousands=self.csv.thousands
        )

    @property
    def missing(self) -> dict[str, float | None]:
        """What stands for no value in every column but the clock's."""
        return {} if self.csv is None else {str(word): None for word in self.csv.missing}


Open = Callable[[Path, CsvEntry], Table]


def _read_with(open_table: Open) -> Callable[[Path, ChannelMap], dict[str, Signal]]:
    def read(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
        clock, names = require_clock(path, channel_map), signal_names(channel_map)
        table = open_table(path, channel_map.csv)
        wanted = tuple(dict.fromkeys((clock.source, *names)))
        if problems := _find_name_problems(table, wanted):
            raise InputError(problems)
        series = table.load(wanted)
        columns, notes = _convert_columns(table, names, series, channel_map)
        problems = [f"{path.name}: signal {name} must be of numbers; {note}" for name, note in notes.items()]
        try:
            time = _read_times(table, clock, series[clock.source])
        except InputError as error:
            time, problems = np.full(0, np.nan), [*error.problems, *problems]
        if problems:
            of_text = _describe_rows_of_text(table, series, [time, *columns.values()])
            raise InputError(of_text or problems)
        first = 1 + len(channel_map.csv.rows_below) * bool(table.csv)
        rows = Clock(time=time, kind="row", where=" below the names", first=first)
        if restarts := apply_checks(load("table of checks").clock, rows):
            raise InputError(f"{path.name}: clock {clock.source} {restarts[0].sentence}")
        return {
            name: sample_column(time, values, clock, table.units.get(name, ""))
            for name, values in columns.items()
        }

    return read


def _summarise_with(open_table: Open) -> Callable[[Path, ChannelMap | None], list[SignalSummary]]:
    def summarise(path: Path, channel_map: ChannelMap | None) -> list[SignalSummary]:
        table = open_table(path, CsvEntry() if channel_map is None else channel_map.csv)
        series = table.load(table.names)
        columns, notes = _convert_columns(table, table.names, series, channel_map)
        clock = None if channel_map is None else channel_map.time
        time = None
        if clock is not None and clock.source in series:
            try:
                time = _read_times(table, clock, series[clock.source])
                columns[clock.source] = time if clock.source in notes else columns[clock.source]
                notes.pop(clock.source, None)
            except InputError as error:
                notes[clock.source] = error.problems[0]
        rows = []
        for name, values in columns.items():
            unit = table.units.get(name, "")
            if clock is None or time is None:
                signal = Signal(time=np.empty(0), values=values, unit=unit)
            else:
                signal = sample_column(time, values, clock, unit)
            rows.append(summarise_signal(name, signal, notes.get(name, "")))
        return rows

    return summarise


def _find_name_problems(table: Table, wanted: tuple[str, ...]) -> list[str]:
    """Return the problems of names that a table does not have, or has twice."""
    missing = [name for name in wanted if name not in table.names]
    problems = []
    for name in list(missing):
        if twice := [known for known in table.names if known.rpartition("#")[0] == name]:
            missing.remove(name)
            problems.append(describe_twice(table.path, name, {k: table.described.get(k, "") for k in twice}))
    if missing:
        plain = tuple(name.split("#")[0] for name in wanted)
        row = None if table.csv is None else find_row_of_names(table.path, table.csv, plain)
        if row is not None and table.csv is not None and row != table.csv.skip_rows:
            return [
                f"{table.path.name}: the names of the signals stand in row {row + 1}: give csv: {{skip_rows: {row}}} in"
                " the map"
            ]
        problems += describe_missing(table.path, tuple(missing), table.names, table.names)
    return problems


def _convert_columns(
    table: Table, names: Iterable[str], series: Mapping[str, pd.Series | str], channel_map: ChannelMap | None
) -> tuple[Columns, dict[str, str]]:
    """Return columns as numbers, and why some are none."""
    columns, notes = Columns(), dict[str, str]()
    rows = max((len(column) for column in series.values() if not isinstance(column, str)), default=0)
    for name in names:
        column, spelling = series[name], table.spell(channel_map, name)
        if isinstance(column, str):
            columns[name], notes[name] = np.full(rows, np.nan), column
            continue
        values, note = convert_values(column, spelling)
        columns[name] = replace_numbers(values, table.missing)
        if note:
            notes[name] = note
    return columns, notes


def _read_times(table: Table, clock: TimeEntry, column: pd.Series | str) -> NDArray[np.float64]:
    """Return the times of a table's rows, NaN where one holds none, float64 [N] [s]."""
    if isinstance(column, str):
        raise InputError(
            f"{table.path.name}: clock {clock.source} must be of numbers, dates or times; {column}"
        )
    spelling = table.spell(None, clock.source)
    values, note = convert_values(column, spelling)
    stated = table.units.get(clock.source, "")
    if problem := find_clock_problem(table.path, clock, stated, None if note else values):
        raise InputError(problem)
    return read_clock(table.path.name, clock, column, spelling)


def _describe_rows_of_text(
    table: Table, series: Mapping[str, pd.Series | str], columns: list[NDArray[np.float64]]
) -> str:
    """Return what to declare where the first rows hold a number in no column, and later ones do; empty elsewhere."""
    known = np.any([np.isfinite(values) for values in columns if len(values)], axis=0)
    first = int(np.argmax(known)) if np.ndim(known) and known.any() else 0
    if not first or table.csv is None:
        return ""
    kinds = list(table.csv.rows_below)
    shown = []
    for row in range(first):
        cells = [str(column.iloc[row]) for column in series.values() if not isinstance(column, str)]
        cells = [cell for cell in cells if cell not in ("nan", "None", "")]
        shown.append(", ".join(shorten_value(cell) for cell in cells))
        kinds.append(
            "units" if "units" not in kinds and any(parse_unit(cell) for cell in cells) else "sources"
        )
    remedy = "units_row: true" if kinds == ["units"] else f"below_names: [{', '.join(kinds)}]"
    instead = (
        f" in place of {'units_row' if table.csv.units_row else 'what it says'}"
        if table.csv.rows_below
        else ""
    )
    looks = (
        "looks like a row of units"
        if kinds[-first:] == ["units"]
        else f"looks like {' and '.join(kinds[-first:])}"
    )
    number = 1 + len(table.csv.rows_below)
    return (
        f"{table.path.name}: row {number} below the names must hold numbers; it holds {shown[0]}, which {looks}:"
        f" give csv: {{{remedy}}} in the map{instead}"
    )


def _open_csv(path: Path, options: CsvEntry) -> Table:
    text = read_text_table(path, options)
    written = [name or f"column {k + 1}" for k, name in enumerate(text.names)]
    names = number_names(written)
    cells = [[row[k] for row in text.below if k < len(row) and row[k]] for k in range(len(names))]
    units = [
        row[k].strip("[]()") if k < len(row) else ""
        for row, kind in zip(text.below, options.rows_below, strict=True)
        if kind == "units"
        for k in range(len(names))
    ]
    return Table(
        path=path,
        names=names,
        load=lambda wanted: {name: text.samples[names.index(name)] for name in wanted},
        units=dict(zip(names, units, strict=False)),
        described={n: ", ".join([f"column {k + 1}", *cells[k]]) for k, n in enumerate(names)},
        csv=options,
    )


def _open_parquet(path: Path, _: CsvEntry) -> Table:
    content = read_content(path, "recording", LARGEST_FILE)
    with open_parquet(content, path.name) as parquet:
        fields = list(parquet.schema_arrow)
    names = number_names([column.name for column in fields])

    def load(wanted: Iterable[str]) -> dict[str, pd.Series | str]:
        positions = [names.index(name) for name in wanted]
        with open_parquet(content, path.name) as parquet:
            table = parquet.read(columns=list({fields[k].name for k in positions}), use_threads=False)
            read = dict(zip(number_names(table.column_names), table.columns, strict=True))
            columns = {names[k]: make_series(read[names[k]]) for k in positions}
        return {
            name: f"it is of {fields[names.index(name)].type}"
            if column is None
            else column.set_axis(range(1, len(column) + 1))
            for name, column in columns.items()
        }

    return Table(
        path=path,
        names=names,
        load=load,
        units={name: read_unit(column) or "" for name, column in zip(names, fields, strict=True)},
        described={name: f"column {k + 1}, {fields[k].type}" for k, name in enumerate(names)},
    )


CSV = Form(read=_read_with(_open_csv), summarise=_summarise_with(_open_csv))
PARQUET = Form(read=_read_with(_open_parquet), summarise=_summarise_with(_open_parquet))
