"""The signals of recordings as a list, from which a channel map can be written."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from catalogs.channel_maps import ChannelMap, FaultyMap
from catalogs.entries import load
from catalogs.recordings import recording_files, recording_root, summarise_signals
from tasks.errors import InputError


def list_recorded_signals(source: str, map: str | None) -> dict[str, Any]:
    """Return a row for each signal of each recording: unit, samples, rate, times and range.

    Parameters
    ----------
    source : a recording, or a folder of them
    map : channel map by name or YAML file, as far as it is written: it gives the clock of tables and the form of text

    Returns
    -------
    ``signals``: rows by the recording's path in its folder.

    Raises
    ------
    InputError
        Listing every recording that cannot be read.
    """
    path = Path(source)
    channel_map = None if map is None else _load_readable_map(map)
    listed: dict[str, list[dict[str, Any]]] = {}
    problems: list[str] = []
    for file in recording_files(path):
        try:
            rows = summarise_signals(file, channel_map)
            listed[file.relative_to(recording_root(path)).as_posix()] = [asdict(row) for row in rows]
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return {"signals": listed}


def _load_readable_map(map: str) -> ChannelMap:
    """Return a map, or what a map that is not finished says of signals, clock and text."""
    try:
        return load("channel map", map)[0]
    except FaultyMap as faults:
        if faults.readable is None:
            raise
        return faults.readable
