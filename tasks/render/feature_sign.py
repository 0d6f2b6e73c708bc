"""The warning sign beside a road feature: what announces it where snow hides its marking."""

from dataclasses import fields, replace
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from tasks.conventions import SemanticClass
from tasks.render.road_edit import RoadRelief
from tasks.render.road_paint import WarningSign, measure_white
from tasks.render.weather.scene_light import append_gaussians, to_display_unclipped
from tasks.scene.bodies.body import Body, Finish, join_discs, make_body
from tasks.scene.bodies.solids import cover_surface
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0
from tasks.scene.surroundings import add_surroundings

Floats = NDArray[np.float64]

_CELL = 0.03
_POST = 0.03
"""Radius of the post [m]."""
_AROUND = 50
"""Gaussians of the road whose light is the sign's [1]."""
_BORDER = 0.11
"""Width of the red border by the side of the triangle [1]."""


class Part(IntEnum):
    """Materials of a sign."""

    BORDER = 0
    FIELD = 1
    SYMBOL = 2
    METAL = 3


def add_sign(
    gaussians: Gaussians,
    relief: RoadRelief,
    sign: WarningSign,
    carriageway_right: float,
    asphalt_albedo: float,
    daylight: ArrayLike | None = None,
) -> Gaussians:
    """Return the street with a feature's sign, which comes last; it faces who drives along the route.

    Parameters
    ----------
    gaussians : the street
    relief : the feature
    sign : its looks and place
    carriageway_right : lateral position of the carriageway's right edge [m]
    asphalt_albedo : reflectance of the road, from which the incident light follows [1]
    daylight : [3, 3] as `Scene.daylight`; None where it is not known [1]
    """
    sinks = float(relief.elevation(np.array([(relief.near + relief.far) / 2]))[0]) < 0
    body = _build_sign(sign, sinks)
    station = float(np.clip(relief.near - sign.before, 0, relief.route.length))
    pose = relief.route.pose(station)
    place = np.array([0.0, carriageway_right - sign.offset, 0.0])
    own = body.gaussians
    means = (own.means.astype(np.float64) + place) @ pose[:3, :3].T + pose[:3, 3]
    turn = Rotation.from_matrix(pose[:3, :3]) * Rotation.from_quat(own.quats_wxyz, scalar_first=True)
    road = np.flatnonzero(gaussians.class_id == SemanticClass.ROAD)
    nearest = road[np.argsort(np.linalg.norm(gaussians.means[road] - means.mean(axis=0), axis=1))[:_AROUND]]
    white = measure_white(gaussians, nearest, asphalt_albedo, daylight).mean(axis=0)
    colour = body.albedo * body.openness[:, None] * white
    if gaussians.display_encoded:
        colour = to_display_unclipped(colour)
    sh = np.zeros((len(own), *gaussians.sh.shape[1:]), np.float32)
    sh[:, 0] = (colour - 0.5) / C0
    placed = replace(
        own,
        means=means.astype(np.float32),
        quats_wxyz=turn.as_quat(scalar_first=True).astype(np.float32),
        normals=(own.normals @ pose[:3, :3].T).astype(np.float32),
        sh=sh,
    )
    if gaussians.surroundings is not None:
        placed = add_surroundings(placed)
    if gaussians.light is not None:
        placed = replace(placed, light=np.tile(gaussians.light[nearest].mean(axis=0), (len(own), 1)))
    missing: dict[str, Any] = {
        member.name: np.zeros((len(own), *value.shape[1:]), value.dtype)
        for member in fields(Gaussians)
        if isinstance(value := getattr(gaussians, member.name), np.ndarray)
        and getattr(placed, member.name) is None
    }
    return append_gaussians(gaussians, replace(placed, **missing))


def _build_sign(sign: WarningSign, sinks: bool) -> Body:
    tall = sign.side * np.sqrt(3) / 2
    middle = sign.foot + tall / 3

    def inside(y: Floats, z: Floats) -> Floats:
        """Return the distance from the triangle's nearest side, positive inside [m]."""
        away = z - middle
        return tall / 3 - np.maximum(-away, np.abs(y) * np.sqrt(3) / 2 + away / 2)

    def plate(points: Floats) -> Floats:
        x, y, z = points.T
        return np.maximum(np.abs(x) - 0.02, -inside(y, z))

    def material(points: Floats, normal: Floats) -> NDArray[np.int64]:
        _, y, z = points.T
        within = inside(y, z) / sign.side
        base = sign.foot + 0.24 * sign.side
        bulge = 0.13 * sign.side * np.exp(-((y / (0.11 * sign.side)) ** 2))
        line = base + 0.13 * sign.side - bulge if sinks else base + 0.03 * sign.side + bulge
        drawn = (z < line) & (z > base - 0.03 * sign.side) & (np.abs(y) < 0.29 * sign.side)
        part = np.where(within < _BORDER, Part.BORDER, np.where(drawn, Part.SYMBOL, Part.FIELD))
        return np.where(normal[:, 0] < -0.5, part, Part.METAL).astype(np.int64)

    def post(points: Floats) -> Floats:
        x, y, z = points.T
        return np.maximum(np.hypot(x - 0.05, y) - _POST, z - sign.foot - 0.6 * tall)

    def grey(points: Floats, normal: Floats) -> NDArray[np.int64]:
        return np.full(len(points), int(Part.METAL))

    half, top = sign.side / 2 + 0.02, sign.foot + tall + 0.02
    discs = join_discs(
        [
            cover_surface(plate, (-0.05, -half, sign.foot - 0.02), (0.05, half, top), _CELL, material),
            cover_surface(post, (-0.02, -0.06, 0.02), (0.12, 0.06, top), _CELL, grey, 0),
        ]
    )
    looks = {
        Part.BORDER: sign.border, Part.FIELD: sign.field, Part.SYMBOL: sign.symbol, Part.METAL: sign.metal,
    }  # fmt: skip
    size = (0.1, sign.side, top)
    finishes = {int(part): Finish(albedo=albedo) for part, albedo in looks.items()}
    return make_body(discs, finishes, SemanticClass.POLE, size, np.full(len(discs), 0.8))
