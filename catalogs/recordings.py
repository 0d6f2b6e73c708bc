"""Logged signals from files: CSV, Parquet, MDF4 and bus JSON, each as its own samples on its own clock."""

import io
import re
from collections.abc import Collection, Iterable
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from catalogs.campaign_files import parse_columns
from catalogs.channel_maps import ChannelMap
from catalogs.documents import parse_json, read_content
from catalogs.sentences import shorten
from tasks.campaign.channels import unit_factor
from tasks.campaign.signals import Signal
from tasks.errors import InputError

SUFFIXES = (".csv", ".parquet", ".mf4", ".mdf", ".json")
LARGEST_FILE = 2**30
"""Bytes of a recording [1]: a day of twenty channels at 100 Hz as text."""


def recording_files(source: Path, channel_map: ChannelMap) -> tuple[Path, ...]:
    """Return the files that a map reads: those its runs name, otherwise all in the folder, or the one file.

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
    wanted = tuple(dict.fromkeys((channel_map.time.source, *names)))
    read = _read_parquet if suffix == ".parquet" else _read_csv
    arrays, units = read(path, wanted, channel_map)
    time = arrays[channel_map.time.source] * unit_factor(channel_map.time.unit, "s")
    usable = np.isfinite(time)
    if channel_map.time.repeats == "keep_first":
        usable &= np.concatenate(([True], np.diff(time) != 0.0))[: len(time)]
    signals = {}
    for name in names:
        # in tables of several rates a cell is empty where the signal has no sample: not a sample at all
        there = usable & ~np.isnan(arrays[name])
        signals[name] = Signal(time=time[there], values=arrays[name][there], unit=units.get(name, ""))
    return signals


def _read_parquet(
    path: Path, wanted: tuple[str, ...], _: ChannelMap
) -> tuple[dict[str, NDArray[np.float64]], dict[str, str]]:
    content = read_content(path, "recording", LARGEST_FILE)
    columns, units = parse_columns(content, path.name, wanted)
    if problems := _describe_missing(path, wanted, columns, pq.read_schema(pa.BufferReader(content)).names):
        raise InputError(problems)
    return columns, units


def _read_csv(
    path: Path, wanted: tuple[str, ...], channel_map: ChannelMap
) -> tuple[dict[str, NDArray[np.float64]], dict[str, str]]:
    options = channel_map.csv
    try:
        frame = pd.read_csv(
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
    names = [str(name).strip() for name in frame.columns]
    problems = _describe_missing(path, wanted, names, names)
    arrays: dict[str, NDArray[np.float64]] = {}
    for name in wanted:
        if names.count(name) > 1:
            problems.append(
                f"{path.name}: signal {name} must stand once; {names.count(name)} columns have its name"
            )
        elif name in names:
            try:
                arrays[name] = np.asarray(frame.iloc[:, names.index(name)], dtype=np.float64)
            except (TypeError, ValueError):
                problems.append(f"{path.name}: signal {name} must be of numbers; it has text in it")
    if problems:
        raise InputError(problems)
    return arrays, {}


def _read_bus(path: Path, names: tuple[str, ...], time_unit: str) -> dict[str, Signal]:
    """Signals as A2D2 stores its bus: per name a unit and [time, value] pairs."""
    content = parse_json(
        read_content(path, "recording", LARGEST_FILE), path, "recording", large_integers=True
    )
    if not isinstance(content, dict):
        raise InputError(f"{path}: must be a table of signals, each with values of [time, value]")
    problems = _describe_missing(path, names, content, content)
    signals = {}
    for name in names:
        if name not in content:
            continue
        try:
            pairs = np.asarray(content[name]["values"], dtype=np.float64)
            unit = content[name].get("unit") or ""
        except (KeyError, TypeError, ValueError, OverflowError):
            pairs, unit = np.empty(0), None
        if (pairs.size and pairs.shape[1:] != (2,)) or not isinstance(unit, str):
            problems.append(
                f"{path.name}: signal {name} must have values of [time, value], and a unit as text"
            )
            continue
        pairs = pairs.reshape(-1, 2)
        signals[name] = Signal(time=pairs[:, 0] * unit_factor(time_unit, "s"), values=pairs[:, 1], unit=unit)
    if problems:
        raise InputError(problems)
    return signals


def _read_mdf(path: Path, names: tuple[str, ...]) -> dict[str, Signal]:
    asammdf = _import_asammdf()
    try:
        with asammdf.MDF(path) as recording:
            return _mdf_signals(path, recording, names)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes the library raise
        raise InputError(f"{path}: must be a readable MDF file; {shorten(error)}") from None


def _mdf_signals(path: Path, recording: Any, names: tuple[str, ...]) -> dict[str, Signal]:
    problems = _describe_missing(path, names, recording.channels_db, recording.channels_db)
    signals = {}
    for name in names:
        places = recording.channels_db.get(name, ())
        if len(places) > 1:
            problems.append(
                f"{path.name}: signal {name} is in {len(places)} groups; export only the group to be read"
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


def _import_asammdf() -> ModuleType:
    try:
        import asammdf
    except ImportError:
        raise InputError(
            'reading MDF4 needs the package asammdf: install it with pip install "musync[mdf]"'
        ) from None
    module: ModuleType = asammdf
    return module


def _describe_missing(
    path: Path, names: tuple[str, ...], there: Collection[str], known: Iterable[str]
) -> list[str]:
    """Return a sentence for each missing name, with similar names of the file."""
    listed = [str(name) for name in known]
    problems = []
    for name in names:
        if name not in there:
            near = get_close_matches(name, listed, n=3) or listed[:12]
            problems.append(f"{path.name}: signal {name} is missing; there are: {shorten(', '.join(near))}")
    return problems
