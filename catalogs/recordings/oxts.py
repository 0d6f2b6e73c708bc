"""Drives of KITTI's raw data: the folder ``oxts`` with ``timestamps.txt`` and a packet of 30 numbers a file.

Format: https://www.cvlibs.net/datasets/kitti/raw_data.php, dataformat.txt of the devkit. A packet belongs to the
time stamp of its number; numbers may be missing.
"""

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from catalogs.channel_maps import ChannelMap, TimeEntry
from catalogs.documents import read_content
from catalogs.recordings.columns import Spelling, read_clock
from catalogs.recordings.forms import (
    Form,
    SignalSummary,
    describe_missing,
    sample_column,
    signal_names,
    summarise_signal,
)
from catalogs.sentences import shorten
from tasks.campaign.signals import Signal
from tasks.errors import InputError

UNITS = {
    "lat": "deg", "lon": "deg", "alt": "m", "roll": "rad", "pitch": "rad", "yaw": "rad",
    **dict.fromkeys(("vn", "ve", "vf", "vl", "vu"), "m/s"),
    **dict.fromkeys(("ax", "ay", "az", "af", "al", "au"), "m/s^2"),
    **dict.fromkeys(("wx", "wy", "wz", "wf", "wl", "wu"), "rad/s"),
    "pos_accuracy": "m", "vel_accuracy": "m/s",
    **dict.fromkeys(("navstat", "numsats", "posmode", "velmode", "orimode"), "1"),
}  # fmt: skip
"""Fields of a packet in their order, and their units."""
LARGEST_PACKET, LARGEST_STAMPS = 4096, 2**26
"""Bytes of a packet and of all time stamps [1]."""
MOST_PACKETS = 1_000_000
"""Of a drive [1]: a day at 10 Hz."""
CLOCK = TimeEntry(source="timestamps.txt")


def find_oxts_folder(path: Path) -> Path | None:
    """Return the folder of packets that a path is, or that a drive's folder holds; None without one."""
    for folder in (path, path / "oxts"):
        if (folder / "timestamps.txt").is_file() and (folder / "data").is_dir():
            return folder
    return None


def list_oxts_files(path: Path) -> tuple[Path, ...]:
    """Return the files of a drive: its time stamps and its packets in order."""
    folder = find_oxts_folder(path) or path
    return (folder / "timestamps.txt", *sorted((folder / "data").glob("*.txt")))


def read_oxts(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """Return the signals of a drive that a map names.

    Raises
    ------
    InputError
        With one sentence per problem.
    """
    names = signal_names(channel_map)
    if problems := describe_missing(path, names, UNITS, UNITS):
        raise InputError(problems)
    time, packets = _load_packets(path)
    return {
        name: sample_column(time, packets[:, list(UNITS).index(name)], channel_map.time or CLOCK, UNITS[name])
        for name in names
    }


def summarise_oxts(path: Path, _: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each field of the packets.

    Raises
    ------
    InputError
        If the drive cannot be read.
    """
    time, packets = _load_packets(path)
    return [
        summarise_signal(name, sample_column(time, packets[:, k], CLOCK, unit))
        for k, (name, unit) in enumerate(UNITS.items())
    ]


def _load_packets(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the times [s] and the packets of a drive, float64 [N] and [N, 30]."""
    stamps, *files = list_oxts_files(path)
    lines = read_content(stamps, "list of time stamps", LARGEST_STAMPS).decode("latin-1").splitlines()
    if not 0 < len(files) <= MOST_PACKETS:
        raise InputError(f"{path.name}: a drive must have 1 to {MOST_PACKETS} packets; it has {len(files)}")
    if len(
        wrong := [file.name for file in files if not file.stem.isdecimal() or int(file.stem) >= len(lines)]
    ):
        raise InputError(
            f"{path.name}: each packet must have a time stamp; {shorten(wrong[0])} has none among the {len(lines)}"
            f" lines of {stamps.name}"
        )
    column = pd.Series([lines[int(file.stem)] for file in files])
    column.index += 1
    time = read_clock(path.name, CLOCK, column, Spelling())
    return time, np.array([_read_packet(file) for file in files])


def _read_packet(file: Path) -> list[float]:
    words = read_content(file, "packet", LARGEST_PACKET).split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != len(UNITS):
        raise InputError(f"{file}: a packet must have {len(UNITS)} numbers; it has {len(words)} words")
    return numbers


OXTS = Form(read=read_oxts, summarise=summarise_oxts)
