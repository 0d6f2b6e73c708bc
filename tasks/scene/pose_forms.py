"""Forms in which camera poses are written, and whether a way and its cameras' headings agree in one of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.conventions import ANY_HEADING, POSE_FORMS

Floats = NDArray[np.float64]
LOOKING_FORWARD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""OpenCV camera axes in rig axes."""
OPENGL_TO_OPENCV = np.diag([1.0, -1.0, -1.0])
STRIDE = 1.0
"""Distance of the poses between which a way's direction is taken [m]."""
SHORTEST_WAY = 50
"""Strides that the extent of a short way, or of one in another unit, is parted into [1]."""
ALONG = np.cos(np.radians(30.0))
"""Least cosine of the median heading to the way: a camera looks ahead, though its mount may be turned a little [1]."""
TURNED_BACK = -0.5
"""Cosine of two strides, or headings, that follow each other, below which no car has turned [1]."""
LONGEST_DETOUR = 1.3
"""Way through all poses over that of its strides, above which cameras beside each other take turns [1]."""
LARGEST_GAP, GAP_SHARE = 10.0, 0.2
"""A step that is longer than so many median ones, and than this share of the way, leads to another drive [1]."""
UPRIGHT = 0.8
"""Least cosine to the vertical of a world whose y points down, or z up, for which a camera counts as upright [1]."""


@dataclass(frozen=True, kw_only=True)
class _Way:
    """The strides of a way: numbers of the poses between them, their directions, and what is wrong with them."""

    numbers: NDArray[np.int64]
    direction: Floats
    problems: list[str]


def read_cameras(poses: Floats, form: str, base: str) -> Floats:
    """Return camera-to-world poses in OpenCV's axes, [M, 4, 4].

    Parameters
    ----------
    poses : float64 [M, 4, 4] as a file holds them [m]
    form : of `POSE_FORMS`
    base : form that the kind of file has by its definition, from which `ANY_HEADING` turns the cameras
    """
    if form == ANY_HEADING:
        return _face_the_way(read_cameras(poses, base, base))
    if form == "world-to-camera":
        return np.linalg.inv(poses).astype(np.float64)
    cameras = poses.copy()
    R = poses[:, :3, :3]
    match form:
        case "opengl":
            cameras[:, :3, :3] = R @ OPENGL_TO_OPENCV
        case "flu":
            cameras[:, :3, :3] = R @ LOOKING_FORWARD
        case "frd":
            cameras[:, :3, :3] = R @ OPENGL_TO_OPENCV @ LOOKING_FORWARD
        case "scalar-first":
            quats = Rotation.from_matrix(R).as_quat()
            cameras[:, :3, :3] = Rotation.from_quat(quats, scalar_first=True).as_matrix()
    return cameras


def find_way_problems(
    poses: Floats, form: str, base: str, forms: tuple[str, ...], option: str = ""
) -> list[str]:
    """Return what is wrong with a way and its cameras' headings, and which form of poses would fit; one sentence each.

    Parameters
    ----------
    poses : float64 [M, 4, 4] as a file holds them [m]
    form, base : as of `read_cameras`
    forms : those that the file may have
    option : by which a user gives the form, where there is one
    """
    cameras = read_cameras(poses, form, base)
    way = _walk(cameras)
    if not len(way.numbers):
        return []
    cosine = _measure_heading(cameras, way)
    if cosine >= ALONG:
        return way.problems
    fitting = [other for other in forms if other != form and _fits(read_cameras(poses, other, base))]
    if not fitting and way.problems:
        return way.problems
    fitting.sort(key=lambda other: not _stands_upright(read_cameras(poses, other, base)))
    side = _name_side(cameras, way)
    causes = [
        POSE_FORMS[other].format(side=side) + (f": give {option} {other}" if option else "")
        for other in fitting
    ]
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    unknown = "no form of poses fits: is each pose a rotation and a place of one camera?"
    return [
        f"cameras must look along the way that they move; these look {'against' if cosine < -0.5 else 'aside from'} it,"
        f" {angle:.0f} deg in the median of {len(way.numbers) - 1} steps: {', or '.join(causes) or unknown}"
    ]


def find_turns_back(positions: Floats) -> list[str]:
    """Return where a way of points turns back or leaps, one sentence each.

    Parameters
    ----------
    positions : float64 [M, 3] [m]
    """
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, 3] = positions
    return _walk(poses).problems


def _walk(cameras: Floats) -> _Way:
    positions = cameras[:, :3, 3]
    extent = float(np.linalg.norm(np.ptp(positions, axis=0))) if len(positions) else 0.0
    stride = min(STRIDE, extent / SHORTEST_WAY)
    numbers = [0]
    for i, position in enumerate(positions):
        if np.linalg.norm(position - positions[numbers[-1]]) >= stride > 0:
            numbers.append(i)
    if len(numbers) < 2:
        return _Way(numbers=np.empty(0, np.int64), direction=np.empty((0, 3)), problems=[])
    steps = np.diff(positions[numbers], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    direction = steps / lengths[:, None]
    problems = []
    turned = np.einsum("ni,ni->n", direction[:-1], direction[1:]) < TURNED_BACK
    if turned.any():
        first = int(turned.argmax()) + 1
        problems.append(
            f"a route must lead ahead all the way; pose {numbers[first + 1]} lies {lengths[first]:.3g} m behind pose"
            f" {numbers[first]}: keep the poses of one camera and one drive, in the order of time"
        )
    forward = cameras[:, :3, 2]
    apart = np.einsum("ni,ni->n", forward[:-1], forward[1:])
    if (apart < TURNED_BACK).any():
        first = int(apart.argmin())
        problems.append(
            f"a route must be that of one camera; poses {first} and {first + 1} look"
            f" {np.degrees(np.arccos(max(apart[first], -1))):.0f} deg apart: keep the poses of one camera"
        )
    detour = float(
        np.linalg.norm(np.diff(positions[: numbers[-1] + 1], axis=0), axis=1).sum() / lengths.sum()
    )
    if detour > LONGEST_DETOUR:
        problems.append(
            f"a route must lead ahead from pose to pose; the way through all of them is {detour:.3g} times as long as"
            f" that in steps of {stride:.2g} m: keep the poses of one camera, in the order of time, and one of those at"
            " a standstill"
        )
    longest = int(lengths.argmax())
    if lengths[longest] > max(LARGEST_GAP * np.median(lengths), GAP_SHARE * lengths.sum()) and not problems:
        problems.append(
            f"a route must have no gaps; poses {numbers[longest]} and {numbers[longest + 1]} lie"
            f" {lengths[longest]:.3g} m apart, most others {np.median(lengths):.2g} m: keep the poses of one drive"
        )
    return _Way(numbers=np.array(numbers), direction=direction, problems=problems)


def _measure_heading(cameras: Floats, way: _Way) -> float:
    """Median cosine of the headings at both ends of a stride to its direction [1]."""
    forward = cameras[way.numbers, :3, 2]
    return float(np.median(np.einsum("ni,ni->n", forward[:-1] + forward[1:], way.direction) / 2))


def _fits(cameras: Floats) -> bool:
    way = _walk(cameras)
    return bool(len(way.numbers)) and not way.problems and _measure_heading(cameras, way) >= ALONG


def _stands_upright(cameras: Floats) -> bool:
    _, down_y, down_z = cameras[:, :3, 1].mean(axis=0)
    return bool(down_y > UPRIGHT or down_z < -UPRIGHT)


def _name_side(cameras: Floats, way: _Way) -> str:
    """Where the cameras look, seen from the way."""
    turned = np.einsum("nji,nj->ni", cameras[way.numbers[:-1], :3, :3], way.direction)
    ahead, right = np.median(turned[:, 2]), np.median(turned[:, 0])
    if ahead < -abs(right):
        return "back"
    return "to the left of the way" if right > 0 else "to the right of the way"


def _face_the_way(cameras: Floats) -> Floats:
    """The cameras turned about their upward axis into the way; where that is along it, they stay."""
    way = _walk(cameras)
    if not len(way.numbers):
        return cameras
    ends = np.concatenate([way.direction[:1], way.direction, way.direction[-1:]])
    tangent = ends[:-1] + ends[1:]
    number = np.searchsorted(way.numbers, np.arange(len(cameras)), side="right") - 1
    down = cameras[:, :3, 1]
    ahead = tangent[number]
    right = np.cross(down, ahead)
    lengths = np.linalg.norm(right, axis=1, keepdims=True)
    if not (lengths > 0.5 * np.linalg.norm(ahead, axis=1, keepdims=True)).all():
        return cameras
    right /= lengths
    turned = cameras.copy()
    turned[:, :3, :3] = np.stack([right, down, np.cross(right, down)], axis=2)
    return turned
