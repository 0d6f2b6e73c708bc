"""Signals of a car's bus in JSON: as A2D2 has them, a unit and [time, value] pairs for each name, or as nuScenes."""

from pathlib import Path
from typing import Any

import numpy as np

from catalogs.campaign_files import find_name_bounds
from catalogs.channel_maps import ChannelMap
from catalogs.documents import parse_json, read_content
from catalogs.recordings.forms import (
    LARGEST_FILE,
    Form,
    SignalSummary,
    describe_missing,
    signal_names,
    summarise_signal,
)
from catalogs.recordings.nuscenes_bus import is_list_of_messages, read_scene, summarise_scene
from tasks.campaign.clocks import convert_to_seconds
from tasks.campaign.signals import Signal
from tasks.errors import InputError


def read_bus(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """Return the signals of a bus file that a map names; the unit of its times is the map's.

    Raises
    ------
    InputError
        With one sentence per problem.
    """
    content, names = _load_content(path), signal_names(channel_map)
    if not isinstance(content, dict):
        return read_scene(path, channel_map)
    problems = describe_missing(path, names, content, content)
    found = {
        name: _take_signal(content[name], _find_time_unit(channel_map)) for name in names if name in content
    }
    problems += [
        f"{path.name}: signal {name} must have values of [time, value], and a unit as text"
        for name, signal in found.items()
        if signal is None
    ]
    if problems:
        raise InputError(problems)
    return {name: signal for name, signal in found.items() if signal is not None}


def summarise_bus(path: Path, channel_map: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each signal; without a map its times are taken as s.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    time_unit, content = _find_time_unit(channel_map), _load_content(path)
    if not isinstance(content, dict):
        return summarise_scene(path, channel_map)
    return [
        summarise_signal(name, signal)
        for name, entry in content.items()
        if (signal := _take_signal(entry, time_unit)) is not None
    ]


def _load_content(path: Path) -> dict[str, Any] | list[Any]:
    """Return a table of signals, or a list of messages as nuScenes has them."""
    content = parse_json(
        read_content(path, "recording", LARGEST_FILE), path, "recording", large_integers=True
    )
    if not isinstance(content, dict) and not is_list_of_messages(content):
        raise InputError(
            f"{path}: must be a table of signals, each with values of [time, value], or a list of messages, each with"
            " its utime"
        )
    if isinstance(content, dict) and (problems := find_name_bounds(list(content), path.name)):
        raise InputError(problems)
    return content


def _find_time_unit(channel_map: ChannelMap | None) -> str:
    return "s" if channel_map is None or channel_map.time is None else channel_map.time.unit


def _take_signal(entry: Any, time_unit: str) -> Signal | None:
    """Return the signal that an entry holds; None if it holds none."""
    try:
        pairs = np.asarray(entry["values"], dtype=np.float64)
        unit = entry.get("unit") or ""
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError):
        return None
    if (pairs.size and pairs.shape[1:] != (2,)) or not isinstance(unit, str):
        return None
    pairs = pairs.reshape(-1, 2)
    return Signal(time=convert_to_seconds(pairs[:, 0], time_unit), values=pairs[:, 1], unit=unit)


BUS_JSON = Form(read=read_bus, summarise=summarise_bus)
