"""MDF4 recordings, read by asammdf: each signal has its own clock and unit."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from catalogs.channel_maps import ChannelMap
from catalogs.recordings.forms import (
    Form,
    SignalSummary,
    describe_missing,
    import_package,
    signal_names,
    summarise_signal,
)
from catalogs.sentences import shorten
from tasks.campaign.signals import Signal
from tasks.errors import InputError

Result = TypeVar("Result")


def read_mdf(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """Return the signals of an MDF4 file that a map names.

    Raises
    ------
    InputError
        With one sentence per problem: a damaged file, a signal that is missing, in several groups or not of numbers.
    """
    return _open_recording(path, lambda recording: _take_signals(path, recording, signal_names(channel_map)))


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


def _take_signals(path: Path, recording: Any, names: tuple[str, ...]) -> dict[str, Signal]:
    problems = describe_missing(path, names, recording.channels_db, recording.channels_db)
    signals = {}
    for name in names:
        places = recording.channels_db.get(name, ())
        if len(places) > 1:
            problems.append(
                f"{path.name}: signal {name} is in {len(places)} groups; export only the group to be read"
            )
        elif places:
            signal = _take_channel(recording, name, places[0])
            if signal is None:
                problems.append(f"{path.name}: signal {name} must be of numbers, one a sample")
            else:
                signals[name] = signal
    if problems:
        raise InputError(problems)
    return signals


def _take_channel(recording: Any, name: str, place: tuple[int, int]) -> Signal | None:
    """Return a channel of numbers; None if it holds other things."""
    channel = recording.get(name, group=place[0], index=place[1])
    if not np.issubdtype(channel.samples.dtype, np.number) or channel.samples.ndim != 1:
        return None
    return Signal(
        time=np.asarray(channel.timestamps, dtype=np.float64),
        values=np.asarray(channel.samples, dtype=np.float64),
        unit=channel.unit or "",
    )


def _summarise_channels(recording: Any) -> list[SignalSummary]:
    clocks = {(group, index) for group, index in recording.masters_db.items()}
    return [
        summarise_signal(name, signal)
        for name, places in recording.channels_db.items()
        for place in places
        if place not in clocks and (signal := _take_channel(recording, name, place)) is not None
    ]


MDF = Form(read=read_mdf, summarise=summarise_mdf)
