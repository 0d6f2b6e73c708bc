"""Bodies of road users in their own axes: flat Gaussians with reflectance, before any light.

Body axes: x forward, y left, z up; the origin is the middle of the footprint on the ground.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.cars.body import build_bodywork, build_car_ends
from tasks.scene.street.cars.parked import _build_underside, _build_wheels
from tasks.scene.street.cars.shapes import SHAPES
from tasks.scene.street.layout import EYE_HEIGHT
from tasks.scene.street.surfels import Surfels, build_box, build_tube, join_surfels, tile_surface

Floats = NDArray[np.float64]

_CAR_CELL = np.array([0.12, 0.07])
"""Length and height of a cell of a car's skin, seen from some metres away [m]."""
_SEEN_FROM = 12.0
"""Distance behind a body from which its mirror images are right [m]."""
_CLOTH, _TROUSERS, _SKIN, _SHOE = (
    np.array(colour)
    for colour in ((0.035, 0.075, 0.16), (0.03, 0.03, 0.035), (0.42, 0.26, 0.18), (0.02, 0.02, 0.02))
)
"""Reflectances of a person, chosen: a blue jacket, dark trousers, skin and shoes [1]."""
_FRAME, _RUBBER = np.array([0.30, 0.05, 0.04]), np.array([0.02, 0.02, 0.02])
_TARPAULIN, _CAB, _DARK = np.array([0.35, 0.36, 0.34]), np.array([0.10, 0.16, 0.30]), np.array([0.012] * 3)


_PERSON = (0.5, 0.5), [[[-0.35, -0.8, 0.0], [0.35, 0.8, 0.86]], [[-0.2, -0.3, 0.86], [0.2, 0.3, 1.0]]]
_SHADES = {
    "car": (
        (0.92, 0.84),
        [[[-0.96, -0.92, 0.17], [0.96, 0.92, 0.5]], [[-0.7, -0.7, 0.48], [0.32, 0.7, 0.92]]],
    ),
    "van": (
        (0.92, 0.84),
        [[[-0.96, -0.92, 0.12], [0.96, 0.92, 0.5]], [[-0.96, -0.92, 0.5], [0.4, 0.92, 0.96]]],
    ),
    "truck": (
        (0.9, 0.84),
        [[[-0.99, -0.96, 0.28], [0.6, 0.96, 1.0]], [[0.64, -0.96, 0.12], [1.0, 0.96, 0.74]]],
    ),
    "adult": _PERSON,
    "child": _PERSON,
    "bicycle": (
        (0.9, 0.15),
        [[[-0.9, -0.08, 0.0], [0.9, 0.08, 0.36]], [[-0.3, -0.7, 0.45], [0.25, 0.7, 0.92]]],
    ),
}
"""Footprint and casters of each kind, by half the length, half the width and the height of its box [1]."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """A rigid body.

    Parameters
    ----------
    kind : of road user
    size : float64 [3] of its upright box: length, width and height [m]
    surfels : in body axes
    casters : float64 [K, 2, 3] lowest and highest corner of boxes that cast its shadow [m]
    footprint : float64 [2] half length and half width of the ground from which it hides the sky [m]
    stop_lamps : bool [N] surfels that shine while it brakes
    porous : whether rain soaks its surface, as cloth
    """

    kind: str
    size: Floats
    surfels: Surfels
    casters: Floats
    footprint: Floats
    stop_lamps: NDArray[np.bool_]
    porous: bool


def build_body(kind: str, size: Floats) -> Body:
    """Build the body of a kind of road user.

    Parameters
    ----------
    kind : car, van, truck, adult, child or bicycle
    size : float64 [3] length, width and height of its box [m]
    """
    if kind in ("car", "van"):
        surfels = _build_car(
            "hatchback" if kind == "car" else "van", palette.CAR_PAINT[1 if kind == "car" else 7]
        )
    elif kind == "truck":
        surfels = _build_truck(size)
    elif kind == "bicycle":
        surfels = _build_cyclist(size)
    else:
        surfels = _build_person(size)
    surfels = _fit_box(surfels, size)
    lamps = (np.abs(surfels.albedo - palette.TAIL_LIGHT).max(axis=1) < 1e-9) & (surfels.axes[:, 2, 0] < -0.3)
    share, boxes = _SHADES[kind]
    return Body(
        kind=kind,
        size=size,
        surfels=surfels,
        casters=np.array(boxes) * np.concatenate([size[:2] / 2, size[2:]]),
        footprint=np.array(share) * size[:2] / 2,
        stop_lamps=lamps,
        porous=kind in ("adult", "child", "bicycle"),
    )


def _point(x: float, y: float, z: float) -> Floats:
    return np.array([x, y, z])


def measure_extent(surfels: Surfels) -> tuple[Floats, Floats]:
    """Return the lowest and the highest corner [3] of the box around surfels, at one standard deviation [m]."""
    reach = np.einsum("nk,nkj->nj", surfels.scale, np.abs(surfels.axes[:, :2]))
    return (surfels.centre - reach).min(axis=0), (surfels.centre + reach).max(axis=0)


def _fit_box(surfels: Surfels, size: Floats) -> Surfels:
    """Scale surfels along the axes so that they fill the box, which stands on the ground."""
    low, high = measure_extent(surfels)
    ratio = size / (high - low)
    centre = (surfels.centre - (low + high) / 2) * ratio + np.array([0.0, 0.0, size[2] / 2])
    edges = surfels.axes[:, :2] * surfels.scale[..., None] * ratio
    u, v = edges[:, 0], edges[:, 1]
    length = np.linalg.norm(u, axis=1, keepdims=True)
    first = u / length
    normal = np.cross(u, v)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    second = np.cross(normal, first)
    scale = np.concatenate([length, np.abs(np.einsum("ni,ni->n", v, second))[:, None]], axis=1)
    return replace(surfels, centre=centre, axes=np.stack([first, second, normal], axis=1), scale=scale)


def _build_car(model: str, paint: Floats) -> Surfels:
    shape = SHAPES[model]
    eye = np.array([-_SEEN_FROM, 0.0, EYE_HEIGHT])
    return join_surfels(
        [
            build_bodywork(shape, _CAR_CELL, paint, eye),
            *build_car_ends(shape, _CAR_CELL, paint, eye),
            *_build_wheels(shape, _CAR_CELL),
            *_build_underside(shape),
        ]
    )


def _build_truck(size: Floats) -> Surfels:
    """Build a lorry: a cab with panes, a box of tarpaulin, wheels below it, and lamps behind."""
    length, width, height = size
    kind, cell, half = SemanticClass.VEHICLE, 0.2, width / 2
    cab, floor, sill = length - 2.2, 1.1, 0.45
    rear = np.array([[-0.01, y, z] for z in (0.75, 0.9) for y in (-half + 0.25, half - 0.25)])
    parts = [
        build_box([0.0, -half, floor], [cab - 0.25, half, height], cell, kind, _TARPAULIN),
        build_box([cab, -half, sill], [length, half, min(3.0, height)], cell, kind, _CAB),
        build_box([0.2, -half * 0.8, 0.6], [cab, half * 0.8, floor], cell, kind, _RUBBER),
        tile_surface(rear, [0, -0.3, 0], [0, 0, 0.15], kind, palette.TAIL_LIGHT),
        build_box([length + 0.005, -half * 0.9, 1.5], [length + 0.01, half * 0.9, 2.5], 0.15, kind, _DARK),
    ]
    for x in (0.18 * length, 0.84 * length):
        for side in (-1.0, 1.0):
            grid = (np.arange(9) + 0.5) / 9 * 2 - 1
            a, b = (v[np.hypot(*np.meshgrid(grid, grid)) < 1] for v in np.meshgrid(grid, grid))
            centre = np.stack([x + a * 0.5, np.full(a.shape, side * (half + 0.002)), (b + 1) * 0.5], axis=-1)
            parts.append(
                tile_surface(centre, [-side * 0.11, 0, 0], [0, 0, 0.11], kind, palette.TYRE, openness=0.6)
            )
    return join_surfels(parts)


def _build_person(size: Floats) -> Surfels:
    """Build a person who walks: legs astride, arms beside the trunk, head."""
    return _pose_person(size[2], stride=0.5 * size[0] / size[2], bent=False)


def _pose_person(height: float, stride: float, bent: bool) -> Surfels:
    """Build a person; ``stride`` is half the distance of the feet by the height, ``bent`` sits on a saddle [m, 1]."""
    kind, h = SemanticClass.OTHER, height
    hip = np.array([-0.06 * h if bent else 0.0, 0.0, 0.5 * h])
    lean = np.array([0.16 * h if bent else 0.01 * h, 0.0, 0.0])
    shoulder, neck = hip + lean + _point(0, 0, 0.30 * h), hip + lean + _point(0, 0, 0.355 * h)
    head = neck + _point(0.01 * h, 0, 0.075 * h)
    ball = np.linspace(-1, 1, 7)
    ring = np.sqrt(np.maximum(1 - ball**2, 0.02))
    parts = [
        build_tube(hip + np.linspace(-0.03, 1, 7)[:, None] * (shoulder - hip), np.array(
            [0.075, 0.085, 0.085, 0.09, 0.1, 0.105, 0.06]) * h, 10, kind, _CLOTH),
        build_tube(head + ball[:, None] * _point(0, 0, 0.072 * h), 0.052 * h * ring, 8, kind, _SKIN),
        build_tube(np.array([neck - _point(0, 0, 0.02 * h), neck + _point(0, 0, 0.02 * h)]), 0.033 * h, 6, kind, _SKIN),
    ]  # fmt: skip
    for side in (-1.0, 1.0):
        across = np.array([0.0, side * 0.055 * h, 0.0])
        foot = np.array([side * (0.05 * h if bent else stride * h * 0.8), side * 0.05 * h, 0.02 * h])
        if bent:
            foot += _point(0.04 * h, 0.0, 0.09 * h + side * 0.04 * h)
        knee = (hip + foot) / 2 + _point(0.10 * h if bent else 0.015 * h, 0, 0)
        leg = np.array(
            [hip + across, (hip + across + knee) / 2, knee, (knee + foot) / 2, foot + _point(0, 0, 0.02 * h)]
        )
        parts.append(build_tube(leg, np.array([0.055, 0.05, 0.04, 0.035, 0.03]) * h, 8, kind, _TROUSERS))
        toe = np.array(
            [
                foot - _point(0.03 * h, 0, 0),
                foot + _point(0.03 * h, 0, 0.005 * h),
                foot + _point(0.09 * h, 0, 0),
            ]
        )
        parts.append(build_tube(toe, np.array([0.022, 0.026, 0.012]) * h, 6, kind, _SHOE))
        top = shoulder + _point(0, side * 0.115 * h, -0.01 * h)
        hand = (
            np.array([hip[0] + 0.36 * h, side * 0.12 * h, 0.55 * h])
            if bent
            else hip + _point(-side * 0.10 * h, side * 0.125 * h, -0.03 * h)
        )
        elbow = (top + hand) / 2 + _point(-0.02 * h, side * 0.01 * h, -0.02 * h)
        arm = np.array([top, (top + elbow) / 2, elbow, (elbow + hand) / 2])
        parts.append(build_tube(arm, np.array([0.035, 0.032, 0.028, 0.025]) * h, 6, kind, _CLOTH))
        parts.append(
            build_tube(np.array([(elbow + hand) / 2, hand]), np.array([0.024, 0.02]) * h, 6, kind, _SKIN)
        )
    return join_surfels(parts)


def _build_cyclist(size: Floats) -> Surfels:
    """Build a bicycle with its rider."""
    kind, radius = SemanticClass.OTHER, 0.34
    turn = np.arange(28) * 2 * np.pi / 28
    out = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    along = 0.34 * 2 * np.pi / 28 * np.stack([-np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    parts = []
    for x in (-0.52, 0.53):
        tread = np.array([x, 0.0, radius]) + radius * out
        parts.append(tile_surface(tread, along, [0.0, -0.045, 0.0], kind, _RUBBER))
        for side in (-1.0, 1.0):
            flank = np.array([x, side * 0.02, radius]) + (radius - 0.02) * out
            parts.append(tile_surface(flank, side * along, 0.05 * out, kind, _RUBBER))
        for angle in np.arange(0, np.pi, np.pi / 5):
            spoke = 0.32 * np.array([np.cos(angle), 0, np.sin(angle)])
            axis = np.array([x, 0, radius])
            parts.append(
                build_tube(np.array([axis - spoke, axis, axis + spoke]), 0.006, 4, kind, palette.RIM)
            )
    rear, front, pedal = np.array([-0.52, 0, radius]), np.array([0.53, 0, radius]), np.array([-0.08, 0, 0.28])
    saddle, head = np.array([-0.22, 0, 0.86]), np.array([0.36, 0, 0.88])
    for a, b in (
        (rear, pedal),
        (pedal, saddle),
        (saddle, head),
        (pedal, head),
        (rear, saddle),
        (head, front),
    ):
        way = np.linspace(0, 1, 6)[:, None]
        parts.append(build_tube(a + way * (b - a), 0.018, 6, kind, _FRAME))
    bar = head + np.array([[-0.02, y, 0.12] for y in (-0.25, -0.1, 0.1, 0.25)])
    parts.append(build_tube(bar, 0.016, 6, kind, _RUBBER))
    parts.append(build_tube(np.array([head, head + _point(0, 0, 0.12)]), 0.016, 6, kind, _FRAME))
    seat = saddle + np.array([[-0.1, 0, 0.05], [0.0, 0, 0.05], [0.14, 0, 0.05]])
    parts.append(build_tube(seat, np.array([0.07, 0.05, 0.02]), 8, kind, _RUBBER))
    rider = _pose_person(1.75, stride=0.0, bent=True)
    parts.append(replace(rider, centre=rider.centre + np.array([-0.10, 0.0, size[2] - 1.62])))
    return join_surfels(parts)
