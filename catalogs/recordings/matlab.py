"""MATLAB files: vectors, structs and columns of matrices as signals, each with the clock that stands nearest to it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from catalogs.campaign_files import MOST_SAMPLES
from catalogs.channel_maps import ChannelMap, TimeEntry
from catalogs.documents import read_content
from catalogs.recordings.forms import (
    LARGEST_FILE,
    MOST_COLUMNS,
    MOST_NAMES,
    Form,
    SignalSummary,
    describe_missing,
    require_clock,
    sample_column,
    signal_names,
    summarise_signal,
)
from catalogs.recordings.matlab_hdf import HDF_SIGNATURE, open_hdf_variables
from catalogs.recordings.matlab_v5 import load_v5_variables
from catalogs.recordings.matlab_values import Array, Refused, Struct
from catalogs.sentences import shorten
from tasks.campaign.clocks import convert_to_seconds
from tasks.campaign.signals import Signal
from tasks.errors import InputError

UNIT_NAMES = ("Units", "units", "Unit", "unit")
"""Names of text beside a signal that states its unit; in a saved timeseries it stands in DataInfo."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """A vector, or a column of a matrix, as a signal.

    Parameters
    ----------
    array : holds it
    index : of the column, from 0
    scopes : structs around it, from the file's variables inwards
    """

    array: Array
    index: int
    scopes: tuple[Struct, ...]

    @property
    def samples(self) -> int:
        """Number of values [1]."""
        return self.array.shape[0]

    def read(self) -> NDArray[np.float64]:
        """Return the values."""
        return self.array.read().reshape(self.array.shape)[:, self.index]

    @property
    def unit(self) -> str:
        """Unit that stands beside it; empty if none does."""
        inner = self.scopes[-1]
        if len(self.scopes) == 1:  # text among the file's variables says nothing of one of them
            return ""
        info = inner.get("DataInfo")
        groups = [inner, info] if isinstance(info, dict) else [inner]
        return next(
            (text for group in groups for name in UNIT_NAMES if isinstance(text := group.get(name), str)), ""
        )


def read_matlab(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """Return the signals of a MATLAB file that a map names.

    The map's clock is looked up beside each signal, then in the structs around it, then among the file's variables.

    Raises
    ------
    InputError
        With one sentence per problem: a damaged file, a signal that is missing, no vector, or without a clock.
    """
    clock, names = require_clock(path, channel_map), signal_names(channel_map)
    with _open_variables(path) as variables:
        columns, refused = _collect_columns(path, variables)
        kinds = {name: kind for name in names if (kind := _find_refused(name, refused)) is not None}
        problems = [f"{path.name}: signal {name} {kind}" for name, kind in kinds.items()]
        problems += describe_missing(path, tuple(n for n in names if n not in kinds), columns, columns)
        signals = {}
        for name in names:
            if name in columns:
                stamps = _find_clock(path, name, columns[name], clock)
                if isinstance(stamps, str):
                    problems.append(stamps)
                else:
                    column = columns[name]
                    signals[name] = sample_column(
                        convert_to_seconds(stamps.read(), clock.unit), column.read(), clock, column.unit
                    )
    if problems:
        raise InputError(problems)
    return signals


def summarise_matlab(path: Path, channel_map: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each vector and each column of a matrix; rates need a map with a clock.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    clock = None if channel_map is None else channel_map.time
    rows = []
    with _open_variables(path) as variables:
        for name, column in _collect_columns(path, variables)[0].items():
            stamps = None if clock is None else _find_clock(path, name, column, clock)
            if clock is not None and isinstance(stamps, Column):
                signal = sample_column(
                    convert_to_seconds(stamps.read(), clock.unit), column.read(), clock, column.unit
                )
            else:
                signal = Signal(time=np.empty(0), values=column.read(), unit=column.unit)
            rows.append(summarise_signal(name, signal))
    return rows


@contextmanager
def _open_variables(path: Path) -> Iterator[Struct]:
    """Open a file's variables; whatever is raised while they are read becomes a sentence."""
    content = read_content(path, "recording", LARGEST_FILE)
    try:
        if HDF_SIGNATURE in (content[:8], content[512:520]):
            with open_hdf_variables(content) as variables:
                yield variables
        else:
            yield load_v5_variables(content)
    except InputError as error:
        raise InputError(
            [p if p.startswith(path.name) else f"{path.name}: {p}" for p in error.problems]
        ) from None
    except Exception as error:  # whatever a damaged file makes the libraries raise
        raise InputError(f"{path}: must be a readable MATLAB file; {shorten(error)}") from None


def _collect_columns(path: Path, variables: Struct) -> tuple[dict[str, Column], dict[str, str]]:
    """Return the signals by name, and why other values are none."""
    columns: dict[str, Column] = {}
    refused: dict[str, str] = {}

    def visit(prefix: str, scopes: tuple[Struct, ...]) -> None:
        for name, value in scopes[-1].items():
            where = f"{prefix}{name}"
            if isinstance(value, dict):
                visit(f"{where}.", (*scopes, value))
            elif isinstance(value, Refused):
                refused[where] = value.reason
            elif isinstance(value, Array):
                add(where, value, scopes)
            if len(columns) + len(refused) > MOST_NAMES:
                raise InputError(f"{path.name}: must have at most {MOST_NAMES} signals; it has more")

    def add(where: str, array: Array, scopes: tuple[Struct, ...]) -> None:
        if len(array.shape) == 1 and array.shape[0] <= MOST_SAMPLES:
            flat = Array(shape=(array.shape[0], 1), read=array.read)
            columns[where] = Column(array=flat, index=0, scopes=scopes)
        elif (
            len(array.shape) == 2 and array.shape[1] <= MOST_COLUMNS and np.prod(array.shape) <= MOST_SAMPLES
        ):
            for k in range(array.shape[1]):
                columns[f"{where}(:,{k + 1})"] = Column(array=array, index=k, scopes=scopes)
        else:
            size = "x".join(map(str, array.shape)) or "1"
            refused[where] = (
                f"must be a vector, or a matrix of at most {MOST_COLUMNS} columns and {MOST_SAMPLES} values;"
                f" it is {size}"
            )

    visit("", (variables,))
    return columns, refused


def _find_refused(name: str, refused: dict[str, str]) -> str | None:
    """Return why a name is no signal: it, or the value that it would stand in, is none."""
    return next(
        (
            kind
            for where, kind in refused.items()
            if name == where or name.startswith((f"{where}.", f"{where}("))
        ),
        None,
    )


def _find_clock(path: Path, name: str, column: Column, clock: TimeEntry) -> Column | str:
    """Return the nearest vector that the map names as the clock; or what is wrong."""
    for scopes in (column.scopes[:depth] for depth in range(len(column.scopes), 0, -1)):
        value: object = scopes[-1]
        for part in clock.source.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        if isinstance(value, Array) and len(value.shape) == 1:
            if value.shape[0] != column.samples:
                return (
                    f"{path.name}: signal {name} must have a time for each of its {column.samples} values;"
                    f" {clock.source} has {value.shape[0]}"
                )
            flat = Array(shape=(value.shape[0], 1), read=value.read)
            return Column(array=flat, index=0, scopes=scopes)
    return (
        f"{path.name}: signal {name} needs its clock; no vector {clock.source} stands beside it or around it"
    )


MATLAB = Form(read=read_matlab, summarise=summarise_matlab)
