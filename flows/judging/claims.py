"""The motion that somebody claims for a video, from a Parquet file."""

from pathlib import Path

import numpy as np

from catalogs.campaign_files import find_unit_problems, open_parquet, parse_columns
from catalogs.documents import read_content
from catalogs.sentences import shorten
from tasks.errors import InputError
from tasks.eval.foreign_video import VideoClaim

LARGEST_CLAIM = 2**28
"""Bytes of a claim [1]."""
CLAIMED = {"t_ns": "ns", "time": "s", "pitch": "rad", "station": "m", "speed": "m/s"}
"""Columns of a claim that are read, and their units."""
NEEDED = {
    "a column t_ns or time": {"t_ns", "time"},
    "the column pitch [rad]": {"pitch"},
    "a column station [m] or speed [m/s]": {"station", "speed"},
}
"""Columns of which a claim needs one each."""
LARGEST_MOTION = 1e8
"""Farthest station [m], and greatest speed [m/s], that a claim may hold."""


def read_claim(path: Path) -> VideoClaim:
    """Claimed pitch and station over time.

    Raises
    ------
    InputError
        If the file cannot be read, or lacks or repeats what is needed.
    """
    content = read_content(path, "claim", LARGEST_CLAIM)
    columns, units = parse_columns(content, f"{path}: the claim", CLAIMED)
    problems = find_unit_problems(units, CLAIMED, str(path))
    lacks = [name for name, wanted in NEEDED.items() if not columns.keys() & wanted]
    if lacks:
        with open_parquet(content, f"{path}: the claim") as file:
            there = ", ".join(file.schema_arrow.names)
        problems.append(
            f"{path}: the claim lacks {', '.join(lacks)}; its columns are {shorten(there) or 'none'}."
        )
    if (clips := _clip_count(path, content)) > 1:
        problems.append(f"{path}: the claim holds {clips} clips; give one clip's rows.")
    if problems:
        raise InputError(problems)
    time = columns["t_ns"] * 1e-9 if "t_ns" in columns else columns["time"]
    if len(time) < 2 or not np.isfinite(time).all() or not (np.diff(time) > 0).all():
        raise InputError(f"{path}: the claim's time must rise from row to row, over two rows at least.")
    motion = columns["station" if "station" in columns else "speed"]
    if not (np.abs(columns["pitch"]) <= np.pi).all() or not (np.abs(motion) <= LARGEST_MOTION).all():
        raise InputError(
            f"{path}: the claim's pitch must be within {np.pi:.3f} rad, and its station [m] or speed [m/s] a finite"
            f" number of at most {LARGEST_MOTION:g}, throughout."
        )
    if "station" not in columns:
        motion = np.concatenate([[0.0], np.cumsum(0.5 * (motion[1:] + motion[:-1]) * np.diff(time))])
    return VideoClaim(time=time - time[0], pitch=columns["pitch"], station=motion)


def _clip_count(path: Path, content: bytes) -> int:
    """How many clips a claim's rows name; 0 where they name none."""
    with open_parquet(content, f"{path}: the claim") as file:
        if "clip_id" not in file.schema_arrow.names:
            return 0
    # as a dictionary a long name that every row repeats takes its place once
    with open_parquet(content, f"{path}: the claim", read_dictionary=["clip_id"]) as file:
        return len(file.read(columns=["clip_id"], use_threads=False)["clip_id"].unique())
