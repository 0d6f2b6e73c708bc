"""Routes from outside: CSV of road points, or camera poses as KITTI, TUM or nerfstudio write them."""

import csv
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.errors import InputError
from tasks.scene.route import Route, route_from_poses, route_from_positions

FORMS = (
    "a .csv with x, y, z columns, KITTI poses (12 numbers a line), TUM (8 numbers a line), or transforms.json"
)
LOOKING_FORWARD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""OpenCV camera axes in rig axes."""
OPENGL_TO_OPENCV = np.diag([1.0, -1.0, -1.0])


def read_route(path: Path, camera_height: float) -> tuple[Route, NDArray[np.float64]]:
    """A route, and the transform that takes the file's frame to the route's world (z up).

    Road points are already in a world with z up. Camera poses are brought down to the road, and the first rig
    pose becomes the world's origin.

    Parameters
    ----------
    path : the file
    camera_height : height of the camera above the road, for camera poses [m]

    Returns
    -------
    route, T_world_source float64 [4, 4]

    Raises
    ------
    InputError
        If the file is missing, unreadable, of another form, or no route.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; give {FORMS}")
    try:
        if path.suffix == ".csv":
            return route_from_positions(_points(path)), np.eye(4)
        cameras = _nerfstudio(path) if path.suffix == ".json" else _pose_lines(path)
    except (ValueError, KeyError, UnicodeDecodeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: must be {FORMS}; {error}") from None
    rigs = cameras.copy()
    rigs[:, :3, :3] = cameras[:, :3, :3] @ LOOKING_FORWARD.T
    rigs[:, :3, 3] -= camera_height * rigs[:, :3, 2]
    T_world_source = np.linalg.inv(rigs[0])
    return route_from_poses(T_world_source @ rigs), T_world_source


def _points(path: Path) -> NDArray[np.float64]:
    with path.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    missing = {"x", "y", "z"} - set(rows[0] if rows else ())
    if missing:
        raise InputError(
            f"{path}: a route CSV needs the columns x, y, z; {', '.join(sorted(missing))} missing"
        )
    return np.array([[float(row[axis]) for axis in "xyz"] for row in rows])


def _pose_lines(path: Path) -> NDArray[np.float64]:
    lines = [
        line.split() for line in path.read_text().splitlines() if line.strip() and not line.startswith("#")
    ]
    widths = sorted({len(line) for line in lines})
    if widths not in ([12], [8]):
        raise InputError(
            f"{path}: poses need 12 (KITTI) or 8 (TUM) numbers on every line; lines here have {widths}"
        )
    numbers = np.array([[float(word) for word in line] for line in lines])
    poses = np.tile(np.eye(4), (len(numbers), 1, 1))
    if widths == [12]:
        poses[:, :3] = numbers.reshape(-1, 3, 4)
    else:
        poses[:, :3, 3] = numbers[:, 1:4]
        poses[:, :3, :3] = Rotation.from_quat(numbers[:, 4:8]).as_matrix()
    return _orthonormal(poses)


def _nerfstudio(path: Path) -> NDArray[np.float64]:
    frames = sorted(json.loads(path.read_text())["frames"], key=lambda frame: frame.get("file_path", ""))
    poses = np.array([frame["transform_matrix"] for frame in frames], float)
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        raise InputError(f"{path}: every transform_matrix must be 4x4; they have shape {poses.shape[1:]}")
    poses[:, :3, :3] = poses[:, :3, :3] @ OPENGL_TO_OPENCV
    return _orthonormal(poses)


def _orthonormal(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses whose rotations, printed with few digits, are made exact."""
    poses[:, :3, :3] = Rotation.from_matrix(poses[:, :3, :3]).as_matrix()
    return poses
