"""Logged signals from files: CSV, Parquet, MDF4 and bus JSON, each as its own samples on its own clock."""

import json
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from catalogs.channel_maps import ChannelMap
from tasks.errors import InputError
from tasks.recordings.channels import unit_factor
from tasks.recordings.signals import Signal

SUFFIXES = (".csv", ".parquet", ".mf4", ".mdf", ".json")


def recording_files(source: Path, channel_map: ChannelMap) -> tuple[Path, ...]:
    """The files that a map asks for: those its runs name, else all in the folder, or the one file.

    Raises
    ------
    InputError
        If there is none, or one that a run names is missing.
    """
    if not source.exists():
        raise InputError(f"{source}: no such file or folder of measurements")
    folder = source if source.is_dir() else source.parent
    if channel_map.runs:
        files = tuple(dict.fromkeys(folder / run.file for run in channel_map.runs))
        missing = [file for file in files if not file.is_file()]
        if missing:
            raise InputError([f"{file}: the map's runs name it, but it is not there" for file in missing])
        return files
    if source.is_file():
        return (source,)
    files = tuple(sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES))
    if not files:
        raise InputError(f"{source}: a folder of measurements needs files of {', '.join(SUFFIXES)}")
    return files


def read_signals(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """The signals of one file that a map names.

    Parameters
    ----------
    path : .csv, .parquet, .mf4, .mdf or .json
    channel_map : names the signals and the clock

    Raises
    ------
    InputError
        Listing every signal that is missing or is not of numbers, with names that come near.
    """
    names = tuple(dict.fromkeys(name for rule in channel_map.rules for name in rule.sources))
    suffix = path.suffix.lower()
    if suffix in (".mf4", ".mdf"):
        return _read_mdf(path, names)
    if suffix not in SUFFIXES:
        raise InputError(
            f"{path}: measurements must be of {', '.join(SUFFIXES)}; it is {suffix or 'without suffix'}"
        )
    if suffix == ".json":
        return _read_bus(path, names, channel_map.time.unit if channel_map.time else "s")
    if channel_map.time is None:
        raise InputError(f"{path}: a file without its own clock needs time: {{source: COLUMN}} in the map")
    columns, units = _read_parquet(path) if suffix == ".parquet" else _read_csv(path, channel_map)
    wanted = (channel_map.time.source, *names)
    problems = _missing(path, wanted, columns)
    arrays: dict[str, NDArray[np.float64]] = {}
    for name in wanted:
        if name in columns:
            try:
                arrays[name] = np.asarray(columns[name], dtype=np.float64)
            except (TypeError, ValueError):
                problems.append(f"{path.name}: signal {name} must be of numbers; it has text in it")
    if problems:
        raise InputError(problems)
    time = arrays[channel_map.time.source] * unit_factor(channel_map.time.unit, "s")
    usable = np.isfinite(time)
    if channel_map.time.repeats == "keep_first":
        usable &= np.concatenate(([True], np.diff(time) != 0.0))
    signals = {}
    for name in names:
        # in tables of several rates a cell is empty where the signal has no sample: not a sample at all
        there = usable & ~np.isnan(arrays[name])
        signals[name] = Signal(time=time[there], values=arrays[name][there], unit=units.get(name, ""))
    return signals


def _read_parquet(path: Path) -> tuple[dict[str, Any], dict[str, str]]:
    try:
        table = pq.read_table(path)
    except (pa.ArrowInvalid, OSError) as error:
        raise InputError(f"{path}: must be a readable Parquet file; {_brief(error)}") from None
    units = {
        f.name: f.metadata[b"units"].decode() for f in table.schema if f.metadata and b"units" in f.metadata
    }
    return {name: table.column(name).to_numpy() for name in table.column_names}, units


def _read_csv(path: Path, channel_map: ChannelMap) -> tuple[dict[str, Any], dict[str, str]]:
    options = channel_map.csv
    try:
        frame = pd.read_csv(
            path,
            sep=options.separator,
            decimal=options.decimal,
            skiprows=options.skip_rows,
            encoding="utf-8-sig",
        )
    except ValueError as error:
        raise InputError(f"{path}: must be a table of text; {_brief(error)}") from None
    frame.columns = [str(name).strip() for name in frame.columns]
    return {name: frame[name].to_numpy() for name in frame.columns}, {}


def _read_bus(path: Path, names: tuple[str, ...], time_unit: str) -> dict[str, Signal]:
    """Signals as A2D2 stores its bus: per name a unit and [time, value] pairs."""
    try:
        content = json.loads(path.read_text())
    except ValueError as error:
        raise InputError(f"{path}: must be JSON; {_brief(error)}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: must be a table of signals, each with values of [time, value]")
    problems = _missing(path, names, content)
    signals = {}
    for name in names:
        if name not in content:
            continue
        try:
            pairs = np.asarray(content[name]["values"], dtype=np.float64).reshape(-1, 2)
        except (KeyError, TypeError, ValueError):
            problems.append(f"{path.name}: signal {name} must have values of [time, value]")
            continue
        signals[name] = Signal(
            time=pairs[:, 0] * unit_factor(time_unit, "s"),
            values=pairs[:, 1],
            unit=content[name].get("unit") or "",
        )
    if problems:
        raise InputError(problems)
    return signals


def _read_mdf(path: Path, names: tuple[str, ...]) -> dict[str, Signal]:
    asammdf = _asammdf()
    try:
        recording = asammdf.MDF(path)
    except Exception as error:  # whatever a damaged file makes the library raise
        raise InputError(f"{path}: must be a readable MDF file; {_brief(error)}") from None
    with recording:
        problems = _missing(path, names, recording.channels_db)
        signals = {}
        for name in names:
            places = recording.channels_db.get(name, ())
            if len(places) > 1:
                problems.append(
                    f"{path.name}: signal {name} stands in {len(places)} groups; export the group that you mean"
                )
            elif places:
                channel = recording.get(name, group=places[0][0], index=places[0][1])
                if not np.issubdtype(channel.samples.dtype, np.number) or channel.samples.ndim != 1:
                    problems.append(f"{path.name}: signal {name} must be of numbers, one a sample")
                    continue
                signals[name] = Signal(
                    time=np.asarray(channel.timestamps, dtype=np.float64),
                    values=np.asarray(channel.samples, dtype=np.float64),
                    unit=channel.unit or "",
                )
    if problems:
        raise InputError(problems)
    return signals


def _asammdf() -> ModuleType:
    try:
        import asammdf
    except ImportError:
        raise InputError(
            'reading MDF4 needs the package asammdf: install it with pip install "musync[mdf]"'
        ) from None
    module: ModuleType = asammdf
    return module


def _brief(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def _missing(path: Path, names: tuple[str, ...], there: Iterable[str]) -> list[str]:
    known = [str(name) for name in there]
    problems = []
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, n=3) or known[:12]
            problems.append(f"{path.name}: signal {name} is missing; there are: {', '.join(near)}")
    return problems
