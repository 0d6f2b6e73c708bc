"""Bodies of road users, with what a moving one needs beside its surface: casters of its shade, and its stop lamps."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.conventions import SemanticClass
from tasks.scene.bodies import VEHICLES, Body, build_body
from tasks.scene.bodies.solids import tangents
from tasks.scene.bodies.vehicles import FINISHES, Part
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0

Floats = NDArray[np.float64]

FINEST_M, COARSEST_M = 0.045, 0.2
"""Spacing of the discs of a body that a camera comes near to, and of one that it never does [m]."""
PAINTS = {"car": (0.30, 0.31, 0.32), "van": (0.52, 0.50, 0.46), "truck": (0.10, 0.17, 0.33)}
"""Reflectance of a vehicle's paint: silver, cream and blue [1]."""


@dataclass(frozen=True, kw_only=True)
class RoadUserBody:
    """The body of a road user.

    Parameters
    ----------
    kind : of road user
    size : float64 [3] of its upright box: length, width and height [m]
    body : its surface in body axes
    casters : float64 [K, 2, 3] lowest and highest corner of boxes that cast its shadow [m]
    footprint : float64 [2] half length and half width of the ground from which it hides the sky [m]
    stop_lamps : bool [N] discs that shine while it brakes
    porous : whether rain soaks its surface, as cloth
    """

    kind: str
    size: Floats
    body: Body
    casters: Floats
    footprint: Floats
    stop_lamps: NDArray[np.bool_]
    porous: bool


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


def build_road_user(kind: str, size: Floats, cell: float = FINEST_M) -> RoadUserBody:
    """Build the body of a kind of road user.

    Parameters
    ----------
    kind : car, van, truck, adult, child or bicycle
    size : float64 [3] length, width and height of its box [m]
    cell : spacing of a vehicle's discs; a person's are finer [m]
    """
    if kind in VEHICLES:
        length, width, height = size.tolist()
        body = build_body(kind, length, width, height, colour=PAINTS[kind], cell=cell)
        red = np.array(FINISHES[Part.TAIL_LAMP].albedo)
        lamps = (np.abs(body.albedo - red).max(axis=1) < 1e-6) & (body.gaussians.means[:, 0] < 0)
    else:
        body = _fit_box(build_body(kind, height=float(size[2]), cell=max(0.55 * cell, 0.03)), size)
        lamps = np.zeros(len(body.albedo), np.bool_)
    return _add_shade(kind, size, body, lamps)


def wrap_own_body(kind: str, size: Floats, cloud: Gaussians) -> RoadUserBody:
    """Return a user's own Gaussians as the body of a road user; their colours are taken for reflectances.

    Parameters
    ----------
    kind : car, van, truck, adult, child or bicycle
    size : float64 [3] length, width and height of its box [m]
    cloud : in body axes
    """
    colour = np.maximum(cloud.sh[:, 0].astype(np.float64) * C0 + 0.5, 0)
    albedo = to_linear_light(colour) if cloud.display_encoded else colour
    vehicle = kind in VEHICLES
    plain = replace(
        cloud,
        sh=cloud.sh[:, :1],
        class_id=np.full(len(cloud), SemanticClass.VEHICLE if vehicle else SemanticClass.OTHER, np.uint8),
        surroundings=None,
    )
    body = Body(
        gaussians=plain,
        albedo=np.clip(albedo, 0, 0.95),
        gloss=np.zeros(len(cloud)),
        openness=np.ones(len(cloud)),
        size=(float(size[0]), float(size[1]), float(size[2])),
    )
    return _add_shade(kind, size, body, np.zeros(len(cloud), np.bool_))


def to_linear_light(display: Floats) -> Floats:
    """Return linear light of sRGB-encoded values (IEC 61966-2-1)."""
    return np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)


def _add_shade(kind: str, size: Floats, body: Body, lamps: NDArray[np.bool_]) -> RoadUserBody:
    share, boxes = _SHADES[kind]
    return RoadUserBody(
        kind=kind,
        size=size,
        body=body,
        casters=np.array(boxes) * np.concatenate([size[:2] / 2, size[2:]]),
        footprint=np.array(share) * size[:2] / 2,
        stop_lamps=lamps,
        porous=kind not in VEHICLES,
    )


def measure_extent(body: Body) -> tuple[Floats, Floats]:
    """Return the lowest and the highest corner [3] of the box around a body's discs, at one standard deviation [m]."""
    normal, place = body.gaussians.normals.astype(np.float64), body.gaussians.means.astype(np.float64)
    reach = body.gaussians.scales[:, :1] * np.sqrt(np.maximum(1 - normal**2, 0))
    return (place - reach).min(axis=0), (place + reach).max(axis=0)


def _fit_box(body: Body, size: Floats) -> Body:
    """Scale a body along its axes so that it fills a box, which stands on the ground."""
    low, high = measure_extent(body)
    ratio = size / (high - low)
    cloud = body.gaussians
    place = (cloud.means - (low + high) / 2) * ratio + np.array([0.0, 0.0, size[2] / 2])
    normal = cloud.normals / ratio
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    axes = np.stack([*tangents(normal), normal], axis=2)
    fitted = replace(
        cloud,
        means=place.astype(np.float32),
        normals=normal.astype(np.float32),
        quats_wxyz=Rotation.from_matrix(axes).as_quat(scalar_first=True).astype(np.float32),
    )
    return replace(body, gaussians=fitted, size=(float(size[0]), float(size[1]), float(size[2])))
