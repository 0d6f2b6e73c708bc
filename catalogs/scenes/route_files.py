"""Routes from outside: a CSV of road points, or camera poses, and the frame that nerfstudio gives a cloud."""

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from catalogs.documents import parse_json, read_content
from catalogs.scenes.pose_files import (
    LARGEST_FILE,
    LAST_ROW,
    PoseFile,
    decode_text,
    make_poses,
    read_matrix,
    read_numbers,
    read_pose_file,
)
from catalogs.sentences import shorten_value
from tasks.conventions import POSE_FORMS
from tasks.errors import InputError
from tasks.scene.pose_forms import LOOKING_FORWARD, find_turns_back, find_way_problems, read_cameras
from tasks.scene.route import Route, route_from_poses, route_from_positions

Floats = NDArray[np.float64]
KINDS = (
    "a .csv with x, y, z columns, poses of KITTI, KITTI-360 or TUM, 4x4 matrices a line, COLMAP's images.txt or"
    " images.bin, or transforms.json"
)
PROBLEMS_SHOWN = 10
UNITS_M = (1e-6, 1e6)
"""Shortest and longest unit of a file [m]."""
LARGEST_DATAPARSER = 2**16
"""Bytes of dataparser_transforms.json [1]: nerfstudio's take 600."""


def read_route(
    path: Path,
    camera_height: float,
    metres_per_unit: float = 1.0,
    poses: str | None = None,
    dataparser: str | Path | None = None,
) -> tuple[Route, Floats]:
    """A route, and the transform that takes the cloud's frame to the route's world (z up).

    The rows of a CSV are points on the road, or rig poses where it has qw, qx, qy, qz too, in a world that
    already has z up. Camera poses are brought down to the road, and the first rig pose becomes the world's
    origin.

    Parameters
    ----------
    path : the file
    camera_height : height of the camera above the road, for camera poses [m]
    metres_per_unit : length of the file's unit; structure from motion has one of its own [m]
    poses : their form, of `tasks.conventions.POSE_FORMS`; None for that of the kind of file
    dataparser : nerfstudio's dataparser_transforms.json, which leads from the frame of the route's file to that of the
        cloud; None where both are one

    Returns
    -------
    route, T_world_cloud float64 [4, 4], whose scale is the length of the cloud's unit [m]

    Raises
    ------
    InputError
        If the file is missing, unreadable, of another kind, or no route; listing the lines at fault. If its cameras
        do not look where it leads, naming the form of poses that would fit.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file; give {KINDS}")
    low, high = UNITS_M
    if not low <= metres_per_unit <= high:
        raise InputError(f"metres_per_unit must be {low:g} to {high:g}; it is {metres_per_unit:g}")
    if poses is not None and poses not in POSE_FORMS:
        raise InputError(f"poses must be one of {', '.join(POSE_FORMS)}; they are {shorten_value(poses)}")
    scaled = np.diag([metres_per_unit, metres_per_unit, metres_per_unit, 1.0])
    try:
        if path.suffix == ".csv":
            if poses is not None:
                raise InputError(
                    f"a route CSV holds points, or poses with x forward, y left, z up; {poses} is asked for"
                )
            text = decode_text(read_content(path, "route", LARGEST_FILE))
            found = PoseFile(poses=np.empty((0, 4, 4)))
            route, T_world_file = _csv_route(text, metres_per_unit), np.eye(4)
        else:
            found = read_pose_file(path)
            route, T_world_file = _camera_route(found, camera_height, metres_per_unit, poses)
    except InputError as error:
        shown = [problem.removeprefix(f"{path}: ") for problem in error.problems[:PROBLEMS_SHOWN]]
        more = len(error.problems) - len(shown)
        rest = [f"{path}: {more} more problems like these"] if more else []
        raise InputError([f"{path}: {problem}" for problem in shown] + rest) from None
    if dataparser is None:
        return route, T_world_file @ scaled
    return route, T_world_file @ scaled @ _read_dataparser(Path(dataparser), found)


def _camera_route(
    found: PoseFile, camera_height: float, metres_per_unit: float, form: str | None
) -> tuple[Route, Floats]:
    """The route below the cameras, and the transform from their frame, in metres, to its world."""
    chosen = found.base if form is None else form
    if chosen not in found.forms:
        raise InputError(f"poses of this kind of file may be {', '.join(found.forms)}; {chosen} is asked for")
    poses = found.poses.copy()
    poses[:, :3, 3] *= metres_per_unit
    rigs = read_cameras(poses, chosen, found.base)
    rigs[:, :3, :3] = rigs[:, :3, :3] @ LOOKING_FORWARD.T
    rigs[:, :3, 3] -= camera_height * rigs[:, :3, 2]
    T_world_file = np.linalg.inv(rigs[0])
    route = route_from_poses(T_world_file @ rigs)
    if problems := find_way_problems(poses, chosen, found.base, found.forms, "--poses"):
        raise InputError(problems)
    return route, T_world_file


def _read_dataparser(path: Path, found: PoseFile) -> Floats:
    """The similarity from the frame of the cloud that nerfstudio trained to that of the route's file, [4, 4]."""
    content = read_content(path, "dataparser_transforms.json", LARGEST_DATAPARSER)
    table = parse_json(content, path, "dataparser_transforms.json")
    table = table if isinstance(table, dict) else {}
    transform, scale = read_matrix(table.get("transform")), table.get("scale")
    problems = []
    if transform is None or transform.shape not in {(3, 4), (4, 4)} or not _is_rotation(transform[:3, :3]):
        problems.append(f"{path}: transform must be 3x4 numbers, a rotation and a translation; it is not")
    if not isinstance(scale, int | float) or isinstance(scale, bool) or not 1e-9 < scale < 1e9:
        problems.append(f"{path}: scale must be a positive number; it is {shorten_value(scale)}")
    if problems or transform is None or scale is None:
        raise InputError(problems)
    # it leads on from the frame before nerfstudio's preparation of the pictures, whose scale stands in both files
    unit = scale / found.applied_scale
    trained = np.diag([unit, unit, unit, 1.0]) @ np.concatenate([transform[:3], [LAST_ROW]])
    return found.applied_transform @ np.linalg.inv(trained)


def _is_rotation(matrix: Floats) -> bool:
    return bool(np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-3 and np.linalg.det(matrix) > 0)


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
    numbers = read_numbers(lines, [header.index(name) for name in names], len(header))
    positions = metres_per_unit * numbers[:, :3]
    if not attitude:
        route = route_from_positions(positions)
        problems = find_turns_back(positions)
    else:
        poses = make_poses(positions, numbers[:, 3:])
        route = route_from_poses(poses)
        problems = find_way_problems(poses, "flu", "flu", ("opencv", "opengl", "frd"))
    if problems:
        raise InputError(problems)
    return route
