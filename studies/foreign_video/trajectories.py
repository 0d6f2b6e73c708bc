"""Trajectories from outside, in the TUM format: what VGGT, COLMAP or DROID recovered, for our judges."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from catalogs.documents import read_content
from catalogs.sentences import cap_problems, shorten
from tasks.errors import InputError

SUFFIXES = (".txt", ".tum")
"""Of files that are read as trajectories."""
LARGEST_FILE = 2**28
"""Bytes of a trajectory [1]: a day of poses at 30 Hz."""
FARTHEST = 1e8
"""Greatest coordinate [unit of the file]: more than ten times the radius of the Earth in metres."""
COLUMNS = "time tx ty tz qx qy qz qw"


def read_trajectory(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times [N] [s] and camera-to-world poses [N, 4, 4] of a TUM file; lengths in whatever unit it has.

    Raises
    ------
    InputError
        If the file cannot be read, a line has not eight numbers, times do not rise or a rotation is none.
    """
    try:
        lines = read_content(path, "trajectory", LARGEST_FILE).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{path}: a trajectory must be a text file in UTF-8; it is not") from None
    rows, problems = [], []
    for number, line in enumerate(lines, start=1):
        words = line.replace(",", " ").split("#")[0].split()
        if not words:
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) != 8 or not np.isfinite(values).all() or np.abs(values[1:4]).max() > FARTHEST:
            problems.append(
                f"{path}: line {number} must hold eight numbers, {COLUMNS}, lengths up to"
                f" {FARTHEST:g}; it is {shorten(line, 60)!r}"
            )
        elif abs(np.linalg.norm(values[4:]) - 1.0) > 0.01:
            problems.append(f"{path}: line {number}: the quaternion's length must be 1; give qx qy qz qw")
        else:
            rows.append(values)
    if not problems and len(rows) < 2:
        problems.append(f"{path}: a trajectory needs at least two poses; there are {len(rows)}")
    table = np.asarray(rows)
    if not problems and not (np.diff(table[:, 0]) > 0).all():
        problems.append(f"{path}: the times must rise from line to line")
    if problems:
        raise InputError(cap_problems(problems))
    poses = np.tile(np.eye(4), (len(table), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(table[:, 4:]).as_matrix()
    poses[:, :3, 3] = table[:, 1:4]
    return table[:, 0], poses


def trajectory_files(folder: Path, clip_ids: list[str]) -> dict[str, dict[str, Path]]:
    """The files METHOD/CLIP_ID.txt of a folder, by clip and method.

    Raises
    ------
    InputError
        For a folder without any, and for each file that belongs to no clip.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give one that holds METHOD/CLIP_ID.txt")
    files = sorted(path for path in folder.glob("*/*") if path.suffix in SUFFIXES)
    problems = [f"{path}: belongs to no clip of the dataset; name it CLIP_ID.txt"
                for path in files if path.stem not in clip_ids]  # fmt: skip
    if not files:
        problems = [f"{folder}: holds no METHOD/CLIP_ID.txt; there is nothing to score"]
    if problems:
        raise InputError(problems)
    found: dict[str, dict[str, Path]] = {}
    for path in files:
        found.setdefault(path.stem, {})[path.parent.name] = path
    return found
