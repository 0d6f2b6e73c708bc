"""Routes from outside: CSV of road points, or camera poses as KITTI, TUM or nerfstudio write them."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from catalogs.documents import parse_json, read_content
from catalogs.sentences import shorten
from tasks.errors import InputError
from tasks.scene.route import Route, route_from_poses, route_from_positions

FORMS = (
    "a .csv with x, y, z columns, KITTI poses (12 numbers a line), TUM (8 numbers a line), or transforms.json"
)
LOOKING_FORWARD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""OpenCV camera axes in rig axes."""
OPENGL_TO_OPENCV = np.diag([1.0, -1.0, -1.0])
PRINTED_DIGITS = 1e-3
"""How far a rotation printed with few digits may be from an exact one [1]."""
PROBLEMS_SHOWN = 10
LARGEST_FILE = 2**26
"""Bytes of a route's file [1]: KITTI's longest takes 1 MB."""
UNITS_M = (1e-6, 1e6)
"""Shortest and longest unit of a file [m]."""


def read_route(
    path: Path, camera_height: float, metres_per_unit: float = 1.0
) -> tuple[Route, NDArray[np.float64]]:
    """A route, and the transform that takes the file's frame to the route's world (z up).

    The rows of a CSV are points on the road, or rig poses where it has qw, qx, qy, qz too, in a world that
    already has z up. Camera poses are brought down to the road, and the first rig pose becomes the world's
    origin.

    Parameters
    ----------
    path : the file
    camera_height : height of the camera above the road, for camera poses [m]
    metres_per_unit : length of the file's unit; structure from motion has one of its own [m]

    Returns
    -------
    route, T_world_source float64 [4, 4] with ``metres_per_unit`` as its scale

    Raises
    ------
    InputError
        If the file is missing, unreadable, of another form, or no route; listing the lines at fault.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file; give {FORMS}")
    low, high = UNITS_M
    if not low <= metres_per_unit <= high:
        raise InputError(f"metres_per_unit must be {low:g} to {high:g}; it is {metres_per_unit:g}")
    scaled = np.diag([metres_per_unit, metres_per_unit, metres_per_unit, 1.0])
    try:
        text = read_content(path, "route", LARGEST_FILE).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: must be {FORMS}; it is not text") from None
    try:
        if path.suffix == ".csv":
            return _csv_route(text, metres_per_unit), scaled
        rigs = _camera_poses(text, path.suffix)
        rigs[:, :3, :3] = rigs[:, :3, :3] @ LOOKING_FORWARD.T
        rigs[:, :3, 3] = metres_per_unit * rigs[:, :3, 3] - camera_height * rigs[:, :3, 2]
        T_world_rig0 = np.linalg.inv(rigs[0])
        return route_from_poses(T_world_rig0 @ rigs), T_world_rig0 @ scaled
    except InputError as error:
        shown = error.problems[:PROBLEMS_SHOWN]
        more = len(error.problems) - len(shown)
        rest = [f"{path}: {more} more problems like these"] if more else []
        raise InputError([f"{path}: {problem}" for problem in shown] + rest) from None


def _csv_route(text: str, metres_per_unit: float) -> Route:
    try:
        rows = [[word.strip() for word in row] for row in csv.reader(text.splitlines())]
    except csv.Error as error:
        raise InputError(f"a route CSV must be a table of text; {error}") from None
    header = rows[0] if rows else []
    missing = [name for name in "xyz" if name not in header]
    if missing:
        raise InputError(f"a route CSV needs the columns x, y, z; {', '.join(missing)} missing")
    attitude = [name for name in ("qw", "qx", "qy", "qz") if name in header]
    if 0 < len(attitude) < 4:
        raise InputError(f"a route CSV has all of qw, qx, qy, qz or none; it has {', '.join(attitude)}")
    names = [*"xyz", *attitude]
    if twice := [name for name in names if header.count(name) > 1]:
        raise InputError(f"a route CSV must have each column once; {', '.join(twice)} stand twice")
    lines = [(i, row) for i, row in enumerate(rows[1:], start=2) if any(row)]
    numbers = _read_numbers(lines, [header.index(name) for name in names], len(header))
    positions = metres_per_unit * numbers[:, :3]
    if not attitude:
        return route_from_positions(positions)
    return route_from_poses(_make_poses(positions, numbers[:, 3:]))


def _camera_poses(text: str, suffix: str) -> NDArray[np.float64]:
    """OpenCV camera poses [M, 4, 4] of a file, in its own unit and frame."""
    if suffix == ".json":
        return _read_nerfstudio(text)
    lines = [
        (i, line.replace(",", " ").split())
        for i, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.startswith("#")
    ]
    width = len(lines[0][1]) if lines else 0
    if width not in (8, 12):
        raise InputError(f"poses need 12 (KITTI) or 8 (TUM) numbers on every line; the first has {width}")
    numbers = _read_numbers(lines, range(width), width)
    if width == 8:
        # TUM writes time, position, and the quaternion's scalar last
        return _make_poses(numbers[:, 1:4], numbers[:, [7, 4, 5, 6]])
    poses = np.tile(np.eye(4), (len(numbers), 1, 1))
    poses[:, :3] = numbers.reshape(-1, 3, 4)
    return _make_orthonormal(poses)


def _read_nerfstudio(text: str) -> NDArray[np.float64]:
    content = parse_json(text.encode(), "transforms.json", "route")
    frames = content.get("frames") if isinstance(content, dict) else None
    if not isinstance(frames, list) or not frames:
        raise InputError("transforms.json must have a list of frames, at least one; it has none")
    poses, problems = [], []
    for i, frame in enumerate(frames):
        try:
            pose = np.array(frame["transform_matrix"], dtype=np.float64)
        except (TypeError, KeyError, ValueError):
            pose = np.empty(0)
        if pose.shape != (4, 4) or not np.isfinite(pose).all() or (pose[3] != (0, 0, 0, 1)).any():
            problems.append(
                f"frame {i} must have a transform_matrix of 4x4 finite numbers, the last row 0 0 0 1; it has not"
            )
        poses.append(pose)
    if problems:
        raise InputError(problems)
    # frames are stored in any order; their names count the pictures, with leading zeros or without
    order = sorted(range(len(frames)), key=lambda i: _split_digits(str(frames[i].get("file_path", ""))))
    cameras = np.stack([poses[i] for i in order])
    cameras[:, :3, :3] = cameras[:, :3, :3] @ OPENGL_TO_OPENCV
    return _make_orthonormal(cameras)


def _split_digits(name: str) -> list[tuple[int, str]]:
    """Sorting key under which picture 2 comes before picture 10; a number of too many digits is read in parts."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d{1,18})", name)]


def _read_numbers(
    lines: Sequence[tuple[int, list[str]]], columns: Sequence[int], width: int
) -> NDArray[np.float64]:
    """Finite numbers [M, columns] of numbered lines of ``width`` words; every line at fault is a problem."""
    values = np.full((len(lines), len(columns)), np.nan)
    count = f"{width} numbers" if len(columns) == width else f"{width} fields, {len(columns)} of them numbers"
    problems = []
    for row, (i, words) in enumerate(lines):
        shown = shorten(" ".join(words), 60)
        try:
            values[row] = [float(words[column]) for column in columns if len(words) == width]
        except ValueError:
            problems.append(f"line {i} must hold {count}; it holds {shown!r}")
            continue
        if not np.isfinite(values[row]).all():
            problems.append(f"line {i} must hold finite numbers; it holds {shown!r}")
    if problems:
        raise InputError(problems)
    return values


def _make_poses(positions: NDArray[np.float64], quats_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(quats_wxyz, axis=1)
    if len(length) and np.abs(length - 1).max() > PRINTED_DIGITS:
        bad = int(np.abs(length - 1).argmax())
        raise InputError(f"pose {bad} must have a unit quaternion; its length is {length[bad]:g}")
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(quats_wxyz, scalar_first=True).as_matrix()
    poses[:, :3, 3] = positions
    return poses


def _make_orthonormal(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses whose rotations, printed with few digits, are made exact."""
    R = poses[:, :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)).max(axis=(1, 2))
    wrong = np.flatnonzero(~(off <= PRINTED_DIGITS) | (np.linalg.det(R) < 0))
    if len(wrong):
        raise InputError(
            f"a pose must be a right-handed rotation and a translation; {len(wrong)} of {len(poses)} are not,"
            f" the first is number {wrong[0]}"
        )
    poses[:, :3, :3] = Rotation.from_matrix(R).as_matrix()
    return poses
