"""Logged signals from files, each with its own samples on its own clock: a form for each suffix."""

from pathlib import Path

from catalogs.channel_maps import ChannelMap
from catalogs.recordings.bags import BAG, is_bag_folder, list_storage_files
from catalogs.recordings.bus_json import BUS_JSON
from catalogs.recordings.forms import Form, SignalSummary
from catalogs.recordings.matlab import MATLAB
from catalogs.recordings.mdf import MDF
from catalogs.recordings.tables import CSV, PARQUET
from tasks.campaign.signals import Signal
from tasks.errors import InputError

FORMS: dict[str, Form] = {
    ".csv": CSV, ".parquet": PARQUET, ".mf4": MDF, ".mdf": MDF, ".json": BUS_JSON, ".mat": MATLAB,
    ".mcap": BAG, ".bag": BAG, ".db3": BAG,
}  # fmt: skip
SUFFIXES = tuple(FORMS)


def recording_root(source: Path) -> Path:
    """Return the folder in which the recordings of a source lie: itself, or that of a file or a ROS 2 bag folder."""
    return source if source.is_dir() and not is_bag_folder(source) else source.parent


def recording_files(source: Path, channel_map: ChannelMap | None = None) -> tuple[Path, ...]:
    """Return the recordings that a map reads: those its runs name, otherwise all in the folder, or the one file.

    A ROS 2 bag folder is one recording, like a file.

    Raises
    ------
    InputError
        If there is none, or one that a run names is missing.
    """
    if not source.exists():
        raise InputError(f"{source}: no such file or folder of measurements")
    folder = recording_root(source)
    if channel_map is not None and channel_map.runs:
        files = tuple(dict.fromkeys(folder / run.file for run in channel_map.runs))
        missing = [file for file in files if not (file.is_file() or is_bag_folder(file))]
        if missing:
            raise InputError([f"{file}: the map's runs name it, but it is not there" for file in missing])
        return files
    if source != folder:
        return (source,)
    files = tuple(
        sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES or is_bag_folder(path))
    )
    if not files:
        raise InputError(f"{source}: a folder of measurements needs files of {', '.join(SUFFIXES)}")
    return files


def stored_files(recording: Path) -> tuple[Path, ...]:
    """Return the files that hold a recording: itself, or those of a ROS 2 bag folder."""
    return list_storage_files(recording) if recording.is_dir() else (recording,)


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
    return _find_form(path).read(path, channel_map)


def summarise_signals(path: Path, channel_map: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each signal of numbers that a recording holds.

    Parameters
    ----------
    path : a file of one of the forms, or a ROS 2 bag folder
    channel_map : tells the clock of tables, and the form of text; None if there is no map yet

    Raises
    ------
    InputError
        If the recording cannot be read.
    """
    return _find_form(path).summarise(path, channel_map)


def _find_form(path: Path) -> Form:
    if is_bag_folder(path):
        return BAG
    suffix = path.suffix.lower()
    if suffix not in FORMS:
        raise InputError(
            f"{path}: measurements must be of {', '.join(SUFFIXES)}; it is {suffix or 'without suffix'}"
        )
    return FORMS[suffix]
