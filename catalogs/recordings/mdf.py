"""MDF4 recordings, read by asammdf: each signal has its own clock and unit."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from catalogs.channel_maps import ChannelMap
from catalogs.recordings.columns import Spelling, convert_values
from catalogs.recordings.forms import (
    Form,
    SignalSummary,
    describe_missing,
    describe_twice,
    import_package,
    number_names,
    signal_names,
    summarise_signal,
)
from catalogs.sentences import shorten
from tasks.campaign.signals import Signal
from tasks.errors import InputError

Result = TypeVar("Result")
Position = tuple[int, int]
"""Group and index of a channel."""
LISTS = "it is of lists or records"
"""Why a channel is no signal, and is not listed."""


def read_mdf(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """Return the signals of an MDF4 file that a map names.

    Raises
    ------
    InputError
        With one sentence per problem: a damaged file, a signal that is missing, in several groups or not of numbers.
    """
    return _open_recording(path, lambda recording: _take_signals(path, recording, channel_map))


def summarise_mdf(path: Path, _: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each signal of numbers.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    return _open_recording(path, _summarise_channels)


def _open_recording(path: Path, use: Callable[[Any], Result]) -> Result:
    asammdf = import_package("asammdf", "MDF4", "mdf")
    try:
        with asammdf.MDF(path) as recording:
            return use(recording)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes the library raise
        raise InputError(f"{path}: must be a readable MDF file; {shorten(error)}") from None


def _take_signals(path: Path, recording: Any, channel_map: ChannelMap) -> dict[str, Signal]:
    choices = _name_channels(recording)
    problems, signals = [], {}
    for name in signal_names(channel_map):
        position = choices.get(name) or _find_by_group(recording, name)
        if position is None:
            twice = {
                choice: ""
                for choice in choices
                if choice.endswith(f".{name}") or choice.startswith(f"{name}#")
            }
            problems += (
                [describe_twice(path, name, twice)] if twice else describe_missing(path, (name,), (), choices)
            )
            continue
        signals[name], note = _take_channel(recording, position, channel_map.meanings_of(name))
        if note:
            problems.append(f"{path.name}: signal {name} must be of numbers, one a sample; {note}")
    if problems:
        raise InputError(problems)
    return signals


def _name_channels(recording: Any) -> dict[str, Position]:
    """Return the position of each channel by the name for a map: GROUP.NAME where a name stands in several groups."""
    clocks = set(recording.masters_db.items())
    named: dict[str, Position] = {}
    for name, occurrences in recording.channels_db.items():
        own = [position for position in occurrences if position not in clocks]
        labels = [_label_group(recording, position[0], [other for other, _ in own]) for position in own]
        names = [name] if len(own) == 1 else number_names([f"{label}.{name}" for label in labels])
        named |= zip(names, own, strict=True)
    return named


def _list_labels(recording: Any, group: int) -> list[str]:
    """Return what a group may be called: the last word of its name or comment, these as they are, and its number."""
    header = recording.groups[group].channel_group
    texts = [text.strip() for text in (header.acq_name, header.comment) if text and text.strip()]
    return [*(text.split()[-1] for text in texts), *texts, str(group), f"group {group}"]


def _label_group(recording: Any, group: int, groups: list[int]) -> str:
    """Return the first label of a group that none of the other groups has."""
    others = {label for other in groups if other != group for label in _list_labels(recording, other)}
    return next(label for label in _list_labels(recording, group) if label not in others)


def _find_by_group(recording: Any, wanted: str) -> Position | None:
    """Return the one channel that a name of the form GROUP.NAME means, by any label of its group; else None."""
    found = [
        position
        for name, occurrences in recording.channels_db.items()
        if wanted.endswith(f".{name}")
        for position in occurrences
        if wanted.removesuffix(f".{name}") in _list_labels(recording, position[0])
    ]
    return found[0] if len(found) == 1 else None


def _take_channel(
    recording: Any, position: Position, meanings: Mapping[str, float | None]
) -> tuple[Signal, str]:
    """Return a channel, and why it is none of numbers; a table of values may give text for some of them."""
    channel = recording.get(group=position[0], index=position[1])
    values, note = np.full(len(channel.timestamps), np.nan), LISTS
    if channel.samples.ndim == 1 and channel.samples.dtype.kind in "biufSU":
        samples = channel.samples
        text = np.char.decode(samples, "utf-8", "replace") if samples.dtype.kind == "S" else samples
        values, note = convert_values(pd.Series(text), Spelling(meanings=meanings))
    known = ~np.isnan(values) | (channel.samples.dtype.kind == "f")
    time = np.asarray(channel.timestamps, dtype=np.float64)
    return Signal(time=time[known], values=values[known], unit=channel.unit or ""), note.replace(
        "row", "sample", 1
    )


def _summarise_channels(recording: Any) -> list[SignalSummary]:
    read = {
        name: _take_channel(recording, position, {}) for name, position in _name_channels(recording).items()
    }
    return [summarise_signal(name, signal, note) for name, (signal, note) in read.items() if note != LISTS]


MDF = Form(read=read_mdf, summarise=summarise_mdf)
