"""Camera poses as KITTI, KITTI-360, TUM, COLMAP, nerfstudio and sets of 4x4 matrices write them."""

import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from catalogs.documents import parse_json, read_content
from catalogs.sentences import shorten
from tasks.conventions import POSE_FORMS
from tasks.errors import InputError

Floats = NDArray[np.float64]
PRINTED_DIGITS = 1e-3
"""How far a rotation printed with few digits may be from an exact one [1]."""
LARGEST_FILE, LARGEST_JSON = 2**28, 2**26
"""Bytes of a route's file [1]: KITTI's longest takes 1 MB; COLMAP writes the points of each picture beside its pose."""
WIDTHS = {8: "TUM", 12: "KITTI", 13: "KITTI-360", 16: "4x4", 17: "KITTI-360"}
"""Numbers on a line, by the set that writes so many; those of KITTI-360 begin with the number of the picture."""
COLMAP_WORDS = 10
"""Words of a picture's line in COLMAP's images.txt [1]: number, quaternion, position, camera, name."""
COLMAP_IMAGE = struct.Struct("<I7dI")
"""A picture in COLMAP's images.bin, before its name: number, quaternion, position, camera."""
COLMAP_POINT = 24
"""Bytes of a point of a picture in images.bin [1]."""
LAST_ROW = (0, 0, 0, 1)


@dataclass(frozen=True, kw_only=True)
class PoseFile:
    """Poses as a file holds them.

    Parameters
    ----------
    poses : float64 [M, 4, 4] rotation and position, as they stand [unit of the file]
    base : form that such a file has by its definition, of `tasks.conventions.POSE_FORMS`
    forms : those that it may have
    applied_transform : float64 [4, 4] what nerfstudio did to the frame of these poses before it wrote them
    applied_scale : what it then did to their unit [1]
    """

    poses: Floats
    base: str = "opencv"
    forms: tuple[str, ...] = tuple(form for form in POSE_FORMS if form != "scalar-first")
    applied_transform: Floats = field(default_factory=lambda: np.eye(4))
    applied_scale: float = 1.0


def read_pose_file(path: Path) -> PoseFile:
    """The poses of a file, by its ending and content.

    Raises
    ------
    InputError
        If it is unreadable or of another form; listing the lines at fault.
    """
    content = read_content(path, "route", LARGEST_FILE)
    if path.suffix == ".bin":
        return _read_colmap_binary(content)
    if path.suffix == ".json":
        return _read_nerfstudio(content)
    lines = [
        (i, line.replace(",", " ").split())
        for i, line in enumerate(decode_text(content).splitlines(), start=1)
        if line.strip() and not line.startswith("#")
    ]
    if lines and _names_picture(lines[0][1]):
        return _read_colmap_text([(i, words) for i, words in lines if _names_picture(words)])
    width = len(lines[0][1]) if lines else 0
    if width not in WIDTHS:
        raise InputError(
            "poses need 12 (KITTI) or 8 (TUM) numbers on every line, 16 for a 4x4 matrix, and at most the picture's"
            f" number before 12 or 16 (KITTI-360); the first has {width}: leave out other columns"
        )
    numbers = read_numbers(lines, range(width), width)
    if width == 8:
        # TUM writes time, position, and the quaternion's scalar last
        poses = make_poses(numbers[:, 1:4], numbers[:, [7, 4, 5, 6]])
        return PoseFile(poses=poses, forms=tuple(POSE_FORMS))
    return PoseFile(poses=_make_matrices(numbers[:, width % 4 :]))


def decode_text(content: bytes) -> str:
    """The text of a route's file."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("a route must be text, or images.bin; it is neither") from None


def _make_matrices(numbers: Floats) -> Floats:
    """Poses [M, 4, 4] of 12 or 16 numbers each, row by row."""
    poses = np.tile(np.eye(4), (len(numbers), 1, 1))
    rows = numbers.reshape(len(numbers), -1, 4)
    poses[:, : rows.shape[1]] = rows
    wrong = np.flatnonzero((np.abs(poses[:, 3] - LAST_ROW) > PRINTED_DIGITS).any(axis=1))
    if len(wrong):
        by_column = (np.abs(poses[:, :, 3] - LAST_ROW) <= PRINTED_DIGITS).all()
        remedy = "it is written column by column: transpose it" if by_column else "it does not"
        raise InputError(f"a 4x4 matrix must end in the row 0 0 0 1; of pose {wrong[0]}, {remedy}")
    return _make_orthonormal(poses)


def _names_picture(words: list[str]) -> bool:
    """Whether a line is that of a picture in images.txt, and none of points, of which it has numbers alone."""
    if len(words) < COLMAP_WORDS:
        return False
    try:
        float(words[COLMAP_WORDS - 1])
    except ValueError:
        return True
    return False


def _read_colmap_text(lines: list[tuple[int, list[str]]]) -> PoseFile:
    names = [" ".join(words[COLMAP_WORDS - 1 :]) for _, words in lines]
    numbers = read_numbers(
        [(i, words[: COLMAP_WORDS - 1]) for i, words in lines], range(1, 8), COLMAP_WORDS - 1
    )
    return _sort_colmap(names, numbers)


def _read_colmap_binary(content: bytes) -> PoseFile:
    names, rows = [], []
    try:
        (count,), at = struct.unpack_from("<Q", content), 8
        for _ in range(count):
            rows.append(COLMAP_IMAGE.unpack_from(content, at)[1:8])
            at += COLMAP_IMAGE.size
            end = content.index(0, at)
            names.append(content[at:end].decode())
            (points,) = struct.unpack_from("<Q", content, end + 1)
            at = end + 9 + COLMAP_POINT * points
    except (struct.error, ValueError):
        at = -1
    if at != len(content) or not np.isfinite(rows).all():
        raise InputError("a route that ends in .bin must be COLMAP's images.bin, whole; it is not")
    return _sort_colmap(names, np.reshape(rows, (-1, 7)))


def _sort_colmap(names: list[str], numbers: Floats) -> PoseFile:
    """Poses of pictures in the order of their names, from quaternions, the scalar first, and positions."""
    order = _order_names(names)
    poses = make_poses(numbers[order, 4:], numbers[order, :4])
    return PoseFile(poses=poses, base="world-to-camera")


def _read_nerfstudio(content: bytes) -> PoseFile:
    if len(content) > LARGEST_JSON:
        raise InputError(f"transforms.json must have at most {LARGEST_JSON} bytes; it has {len(content)}")
    table = parse_json(content, "transforms.json", "route")
    frames = table.get("frames") if isinstance(table, dict) else None
    if not isinstance(frames, list) or not frames:
        raise InputError("transforms.json must have a list of frames, at least one; it has none")
    poses, problems = [], []
    for i, frame in enumerate(frames):
        pose = read_matrix(frame.get("transform_matrix") if isinstance(frame, dict) else None)
        if pose is None or pose.shape != (4, 4) or (pose[3] != LAST_ROW).any():
            problems.append(
                f"frame {i} must have a transform_matrix of 4x4 finite numbers, the last row 0 0 0 1; it has not"
            )
        else:
            poses.append(pose)
    applied, scale = (
        read_matrix(table.get("applied_transform", np.eye(4)[:3])),
        table.get("applied_scale", 1.0),
    )
    if applied is None or applied.shape not in {(3, 4), (4, 4)}:
        problems.append("applied_transform, where there is one, must be 3x4 finite numbers; it is not")
    if not isinstance(scale, int | float) or isinstance(scale, bool) or not scale > 0:
        problems.append(
            f"applied_scale, where there is one, must be a positive number; it is {shorten(scale, 60)}"
        )
    if problems or applied is None:
        raise InputError(problems)
    # frames are stored in any order; their names count the pictures, with leading zeros or without
    order = _order_names([str(frame.get("file_path", "")) for frame in frames])
    return PoseFile(
        poses=_make_orthonormal(np.stack(poses)[order]),
        base="opengl",
        applied_transform=np.concatenate([applied[:3], [LAST_ROW]]),
        applied_scale=float(scale),
    )


def read_matrix(value: Any) -> Floats | None:
    """A list of lists of finite numbers as a matrix; None where it is none."""
    try:
        matrix = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return matrix if matrix.ndim == 2 and np.isfinite(matrix).all() else None


def _order_names(names: list[str]) -> list[int]:
    """Numbers of the names in an order in which picture 2 comes before picture 10."""

    def split(number: int) -> list[tuple[int, str]]:
        # a number of too many digits is read in parts
        parts = re.split(r"(\d{1,18})", names[number])
        return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]

    return sorted(range(len(names)), key=split)


def read_numbers(lines: Sequence[tuple[int, list[str]]], columns: Sequence[int], width: int) -> Floats:
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


def make_poses(positions: Floats, quats_wxyz: Floats) -> Floats:
    """Poses [M, 4, 4] of positions [M, 3] and unit quaternions [M, 4]."""
    length = np.linalg.norm(quats_wxyz, axis=1)
    if len(length) and np.abs(length - 1).max() > PRINTED_DIGITS:
        bad = int(np.abs(length - 1).argmax())
        raise InputError(f"pose {bad} must have a unit quaternion; its length is {length[bad]:g}")
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(quats_wxyz, scalar_first=True).as_matrix()
    poses[:, :3, 3] = positions
    return poses


def _make_orthonormal(poses: Floats) -> Floats:
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
