"""Logged signals from files, each with its own samples on its own clock: a form for each suffix."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from catalogs.channel_maps import ChannelMap
from catalogs.entries import load
from catalogs.recordings.bags import BAG, is_bag_folder, list_storage_files
from catalogs.recordings.bus_json import BUS_JSON
from catalogs.recordings.columns import replace_numbers
from catalogs.recordings.forms import Form, SignalSummary
from catalogs.recordings.matlab import MATLAB
from catalogs.recordings.mdf import MDF
from catalogs.recordings.nuscenes_bus import SCENE, find_scene, list_scene_files
from catalogs.recordings.oxts import OXTS, find_oxts_folder, list_oxts_files
from catalogs.recordings.tables import CSV, PARQUET
from catalogs.recordings.vbo import VBO
from tasks.campaign.checks import apply_checks
from tasks.campaign.measured import Clock
from tasks.campaign.signals import Signal
from tasks.errors import InputError

FORMS: dict[str, Form] = {
    ".csv": CSV, ".parquet": PARQUET, ".mf4": MDF, ".mdf": MDF, ".json": BUS_JSON, ".mat": MATLAB,
    ".mcap": BAG, ".bag": BAG, ".db3": BAG, ".vbo": VBO,
}  # fmt: skip
SUFFIXES = tuple(FORMS)


def recording_root(source: Path) -> Path:
    """Return the folder in which the recordings of a source lie: itself, or that of what is one recording."""
    return source if source.is_dir() and not is_recording(source) else source.parent


def is_recording(path: Path) -> bool:
    """Return whether a path is read as one recording: a file, the folder of a ROS 2 bag or of a drive, or a scene."""
    return path.is_file() or is_bag_folder(path) or bool(find_oxts_folder(path) or list_scene_files(path))


def recording_files(source: Path, channel_map: ChannelMap | None = None) -> tuple[Path, ...]:
    """Return the recordings that a map reads: those its runs name, otherwise all in the folder, or the one file.

    The folder of a ROS 2 bag or a drive of KITTI is one recording, and so are a scene's files of nuScenes.

    Raises
    ------
    InputError
        If there is none, or one that a run names is missing.
    """
    if not source.exists() and not is_recording(source):
        raise InputError(f"{source}: no such file or folder of measurements")
    folder = recording_root(source)
    if channel_map is not None and channel_map.runs:
        files = tuple(dict.fromkeys(folder / run.file for run in channel_map.runs))
        if missing := [file for file in files if not is_recording(file)]:
            raise InputError([f"{file}: the map's runs name it, but it is not there" for file in missing])
        return files
    if source != folder:
        return (source,)
    there = sorted(
        path
        for path in folder.iterdir()
        if path.suffix.lower() in SUFFIXES or (path.is_dir() and is_recording(path))
    )
    files = tuple(dict.fromkeys(find_scene(path) or path for path in there))
    if not files:
        raise InputError(
            f"{source}: a folder of measurements needs files of {', '.join(SUFFIXES)}, or timestamps.txt and data as a"
            " drive of KITTI has"
        )
    return files


def stored_files(recording: Path) -> tuple[Path, ...]:
    """Return the files that hold a recording: itself, or those of a bag folder, a drive or a scene."""
    if is_bag_folder(recording):
        return list_storage_files(recording)
    if find_oxts_folder(recording):
        return list_oxts_files(recording)
    return list_scene_files(recording) or (recording,)


def read_signals(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """The signals of one recording that a map names.

    Parameters
    ----------
    path : a file of one of the forms, or a ROS 2 bag folder
    channel_map : names the signals and the clock

    Raises
    ------
    InputError
        Listing every signal that is missing or is not of numbers, with names that come near.
    """
    signals = _find_form(path).read(path, channel_map)
    restarts = {
        one.sentence: name
        for name, signal in signals.items()
        for one in apply_checks(load("table of checks").clock, Clock(time=signal.time))
    }
    if restarts:
        raise InputError(
            [f"{path.name}: the clock of {name} {sentence}" for sentence, name in restarts.items()]
        )
    return {name: _replace_values(signal, channel_map.meanings_of(name)) for name, signal in signals.items()}


def _replace_values(signal: Signal, meanings: Mapping[str, float | None]) -> Signal:
    """Return a signal whose numbers stand for what a map says, without those that stand for no value."""
    if not meanings:
        return signal
    values = replace_numbers(signal.values, meanings)
    known = ~np.isnan(values) | np.isnan(signal.values)
    return replace(signal, time=signal.time[known], values=values[known])


def summarise_signals(path: Path, channel_map: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each signal of numbers that a recording holds.

    Parameters
    ----------
    path : a file of one of the forms, or a ROS 2 bag folder
    channel_map : gives the clock of tables, and the form of text; None if there is no map yet

    Raises
    ------
    InputError
        If the recording cannot be read.
    """
    return _find_form(path).summarise(path, channel_map)


def _find_form(path: Path) -> Form:
    if is_bag_folder(path):
        return BAG
    if find_oxts_folder(path):
        return OXTS
    if list_scene_files(path):
        return SCENE
    suffix = path.suffix.lower()
    if suffix not in FORMS:
        raise InputError(
            f"{path}: measurements must be of {', '.join(SUFFIXES)}; it is {suffix or 'without suffix'}"
        )
    return FORMS[suffix]
