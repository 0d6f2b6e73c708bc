"""A folder with a posed stereo sequence: calib.txt, poses.txt, image_l/*.png and image_r/*.png."""

import re
import struct
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from catalogs.documents import read_content
from catalogs.sentences import cap_problems, name_some, shorten
from tasks.errors import InputError
from tasks.reconstruction.sequence import StereoSequence
from tasks.scene.pose_forms import ANY_HEADING, find_way_problems

SMALLEST_SEQUENCE = 3
"""Two neighbours check a picture's depth; with fewer pictures nothing can be checked."""
LARGEST_PICTURE, MOST_PIXELS = 2**28, 10**8
"""Bytes and pixels of a picture [1]."""
LARGEST_NUMBER = 1e8
"""Greatest number of a pose [m] or of a projection matrix [px]."""
PNG = b"\x89PNG\r\n\x1a\n"
ROTATION_TOLERANCE = 1e-3
"""How far a pose's matrix may be from a rotation [1]."""


def read_stereo_folder(folder: Path) -> StereoSequence:
    """Read a rectified stereo sequence in the layout of the KITTI odometry data.

    ``calib.txt`` holds two rows of twelve numbers, the 3x4 projection matrices of the left and right
    camera [px], whose origin may be another camera, as of KITTI's colour pair; ``poses.txt`` one row of twelve per
    picture, the 3x4 pose of the left camera in the frame of the sequence [m]; ``image_l`` and ``image_r`` hold the
    pictures, which pair up in order of name, the last number of a name being equal on both sides.

    Parameters
    ----------
    folder : where the files lie

    Returns
    -------
    StereoSequence

    Raises
    ------
    InputError
        Listing every problem of the folder: files missing, rows that are not twelve numbers, counts that
        differ, poses that are not rotations, pictures that cannot be read or differ in size.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(
            f"{folder}: must be a folder with calib.txt, poses.txt, image_l and image_r; there is none"
        )
    problems: list[str] = []
    calibration = _read_matrices(folder / "calib.txt", problems)
    poses = _read_matrices(folder / "poses.txt", problems)
    left, right = (_read_pictures(folder / side, problems) for side in ("image_l", "image_r"))
    if calibration is not None:
        problems += _find_calibration_problems(folder / "calib.txt", calibration)
    if poses is not None:
        problems += _find_pose_problems(folder / "poses.txt", poses)
    if left and right and len(left) != len(right):
        problems.append(
            f"{folder}: image_l and image_r must pair up; they hold {len(left)} and {len(right)} pictures"
        )
    elif apart := [f"{a} and {b}" for a, b in zip(left, right, strict=True) if _number(a) != _number(b)]:
        problems.append(
            f"{folder}: pictures of image_l and image_r must pair up by the last number of their names;"
            f" {name_some(apart)} do not: put in what is missing, or rename them"
        )
    if left and poses is not None and len(left) != len(poses):
        problems.append(
            f"{folder}: poses.txt must have a row per picture of image_l; it has {len(poses)} for {len(left)}"
        )
    if left and len(left) < SMALLEST_SEQUENCE:
        problems.append(
            f"{folder}: image_l must hold at least {SMALLEST_SEQUENCE} pictures; it holds {len(left)}"
        )
    shapes = {p.shape for p in (*left.values(), *right.values())}
    if len(shapes) > 1:
        sizes = ", ".join(sorted(f"{w} x {h}" for h, w, _ in shapes))
        problems.append(f"{folder}: all pictures must have one size; there are {sizes}")
    if problems or calibration is None or poses is None:
        raise InputError(cap_problems(problems))

    T = np.tile(np.eye(4), (len(poses), 1, 1))
    T[:, :3] = poses
    u, _, vt = np.linalg.svd(T[:, :3, :3])
    T[:, :3, :3] = u @ vt
    return StereoSequence(
        name=folder.name,
        left=np.stack(list(left.values())),
        right=np.stack(list(right.values())),
        intrinsics=calibration[0, :, :3].copy(),
        baseline=float((calibration[0, 0, 3] - calibration[1, 0, 3]) / calibration[1, 0, 0]),
        T_origin_camera=T,
    )


def _read_matrices(path: Path, problems: list[str]) -> NDArray[np.float64] | None:
    """Return the 3x4 matrices of a text file, one per row; None, and a problem, where it cannot be read."""
    try:
        content = read_content(path, "table of matrices", LARGEST_PICTURE).decode()
        lines = [line for line in content.splitlines() if line.strip()]
    except (InputError, UnicodeDecodeError):
        problems.append(f"{path}: must be a text file with twelve numbers per row; it cannot be read")
        return None
    rows = []
    for number, line in enumerate(lines, 1):
        words = line.split()
        words = words[1:] if words[0].endswith(":") else words
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) != 12 or not (np.abs(values) <= LARGEST_NUMBER).all():
            problems.append(
                f"{path}: every row must be twelve finite numbers; row {number} is {shorten(line, 60)!r}"
            )
        else:
            rows.append(np.reshape(values, (3, 4)))
    if not lines:
        problems.append(f"{path}: must hold a row of twelve numbers; it is empty")
    return np.array(rows) if rows and len(rows) == len(lines) else None


def _find_calibration_problems(path: Path, P: NDArray[np.float64]) -> list[str]:
    if len(P) != 2:
        return [
            f"{path}: must hold two rows, the projection matrices of the cameras of image_l and image_r; it has"
            f" {len(P)} row{'s' if len(P) > 2 else ''}"
        ]
    problems = []
    for row in (0, 1):
        if not (P[row, 0, 0] > 0 and P[row, 1, 1] > 0):
            problems.append(
                f"{path}: focal lengths must be positive; row {row + 1} has {P[row, 0, 0]:g} and {P[row, 1, 1]:g}"
            )
    if not np.allclose(P[0, :, :3], P[1, :, :3]):
        problems.append(f"{path}: rectified cameras share one camera matrix; rows 1 and 2 differ")
    if not P[1, 0, 3] < P[0, 0, 3]:
        problems.append(
            f"{path}: the second camera must lie to the right, so that its fourth number is negative;"
            f" it is {P[1, 0, 3]:g}"
        )
    return problems


def _find_pose_problems(path: Path, poses: NDArray[np.float64]) -> list[str]:
    R = poses[:, :, :3]
    off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    wrong = np.flatnonzero((off > ROTATION_TOLERANCE) | (np.linalg.det(R) < 0))
    if not len(wrong):
        T = np.tile(np.eye(4), (len(poses), 1, 1))
        T[:, :3] = poses
        forms = ("opengl", "world-to-camera", ANY_HEADING)
        return [f"{path}: {problem}" for problem in find_way_problems(T, "opencv", "opencv", forms)]
    return [
        f"{path}: every pose must be a rotation and a translation; {len(wrong)} are not,"
        f" the first is row {wrong[0] + 1}"
    ]


def _read_pictures(folder: Path, problems: list[str]) -> dict[str, NDArray[np.uint8]]:
    """RGB pictures of a folder by name, in order."""
    names = sorted(folder.glob("*.png"))
    if not names:
        problems.append(f"{folder}: must hold .png pictures; there are none")
    pictures = {}
    for path in names:
        picture = _read_picture(path, problems)
        if picture is not None:
            pictures[path.name] = picture
    return pictures


def _number(name: str) -> list[str]:
    return re.findall(r"\d+", name)[-1:]


def _read_picture(path: Path, problems: list[str]) -> NDArray[np.uint8] | None:
    """Return an RGB picture [H, W, 3]; None, and a problem, where it is missing or too large or small."""
    try:
        content = read_content(path, "picture", LARGEST_PICTURE)
    except InputError as error:
        problems += error.problems
        return None
    # a PNG says its size before a byte of it is decoded
    width, height = struct.unpack(">II", content[16:24]) if len(content) > 24 else (0, 0)
    if not (content.startswith(PNG) and content[12:16] == b"IHDR" and 0 < width * height <= MOST_PIXELS):
        problems.append(
            f"{path}: must be a PNG of 1 to {MOST_PIXELS} pixels; it cannot be decoded: it is no PNG, or of"
            f" {width} x {height} pixels"
        )
        return None
    try:
        picture = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        picture = None
    if picture is None:
        problems.append(f"{path}: must be a picture; it cannot be decoded")
        return None
    return np.ascontiguousarray(picture[..., ::-1], np.uint8)
