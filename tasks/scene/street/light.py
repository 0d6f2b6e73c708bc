"""Sun, shade and skylight on the street: how much of each reaches every surfel.

Shadows are cast by simple proxies, boxes and balls of leaves, along the sun's direction in route
coordinates; over the length of a shadow the road is nearly straight.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.scene.street.bend import Course
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.surfels import Surfels

Floats = NDArray[np.float64]

_LIFT = 0.03
"""Start of a shadow ray above its surface [m]."""


@dataclass(frozen=True, kw_only=True)
class Casters:
    """Objects that cast shadows, in route coordinates.

    Parameters
    ----------
    boxes : float64 [K, 2, 3] lowest and highest corner of each opaque box [m]
    balls : float64 [T, B, 4] centre and radius of the balls of leaves, one row per tree [m]
    leaf_extinction : extinction within a ball [m-1]
    footprints : float64 [C, 2, 2] lowest and highest station and lateral position of objects with so little
        clearance that they hide the sky around their foot [m]
    """

    boxes: Floats
    footprints: Floats
    balls: Floats
    leaf_extinction: float


def sun_direction(layout: StreetLayout) -> Floats:
    """Return the unit vector to the sun [3], world frame [1]."""
    azimuth, elevation = np.radians(layout.sun_azimuth_deg), np.radians(layout.sun_elevation_deg)
    return np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )


def share_light(surfels: Surfels, layout: StreetLayout, line: Course, casters: Casters) -> Floats:
    """Return the shares of sun, sky and sunlit surroundings that reach every surfel, as `Gaussians.light` has them.

    Parameters
    ----------
    surfels : the street
    layout : its light
    line : course of the road, against which the sun turns
    casters : objects that cast shadows

    Returns
    -------
    float64 [N, 3] in 0..1 [1]
    """
    order = np.argsort(surfels.centre[:, 0], kind="stable")
    normal = surfels.axes[order, 2]
    point = surfels.centre[order] + _LIFT * normal
    heading = line.heading_at(point[:, 0])
    sun = sun_direction(layout)
    to_sun = np.stack(
        [
            sun[0] * np.cos(heading) + sun[1] * np.sin(heading),
            sun[1] * np.cos(heading) - sun[0] * np.sin(heading),
            np.full(len(heading), sun[2]),
        ],
        axis=1,
    )
    facing = np.maximum(np.einsum("ij,ij->i", normal, to_sun), 0.0)
    direct = np.zeros(len(point))
    lit = np.flatnonzero(facing > 0)
    if len(lit):
        direct[lit] = facing[lit] * _sun_share(point[lit], to_sun[lit], casters)
    openness = surfels.openness[order] * _ambient_share(point, casters.footprints)
    sky = sky_share(point, normal, layout) * openness
    around = (1 - sky) * (0.25 + 0.75 * openness)
    light = np.empty((len(point), 3))
    light[order] = np.clip(np.stack([direct, sky, around], axis=1), 0.0, 1.0)
    return light


def sky_share(point: Floats, normal: Floats, layout: StreetLayout) -> Floats:
    """Return the view factor of the sky between two endless rows of houses, exact in the plane across the street.

    A row hides the sky from the street alone, not from what lies behind it.

    Parameters
    ----------
    point : [N, 3] positions [m]
    normal : [N, 3] unit normals [1]
    layout : the street

    Returns
    -------
    float64 [N] in 0..1 [1]
    """
    height = np.maximum(layout.canyon_height - point[:, 2], 0.0)
    away = np.stack([point[:, 1] - layout.front_position(-1), layout.front_position(1) - point[:, 1]])
    row = np.where(away >= 0, np.arctan2(height, np.maximum(away, 0.05)), 0.0)
    # angles run from the right horizon over the zenith to the left one; a surface sees half a turn about its normal
    right, left = row[0], np.pi - row[1]
    tilt = np.arctan2(normal[:, 2], -normal[:, 1])
    cross = np.hypot(normal[:, 1], normal[:, 2])
    low = np.maximum(right, tilt - np.pi / 2)
    high = np.minimum(left, tilt + np.pi / 2)
    low_behind = np.maximum(right, tilt + 2 * np.pi - np.pi / 2)
    high_behind = np.minimum(left, tilt + 2 * np.pi + np.pi / 2)
    seen = np.where(high > low, np.sin(high - tilt) - np.sin(low - tilt), 0.0)
    seen += np.where(high_behind > low_behind, np.sin(high_behind - tilt) - np.sin(low_behind - tilt), 0.0)
    across = np.clip(seen / 2, 0.0, 1.0)
    along = np.clip((np.sin(left) + 1 - np.sin(right)) / 4, 0.0, 0.5)
    return cross * across + (1 - cross) * along


def _ambient_share(point: Floats, footprints: Floats) -> Floats:
    """Return the share of ambient light that reaches ground points beside parked cars, sorted by station; [N] [1]."""
    clear = np.ones(len(point))
    for low, high in footprints:
        near = _station_slice(point[:, 0], low[0] - 1.5, high[0] + 1.5)
        p = point[near]
        outside = np.maximum(np.maximum(low - p[:, :2], p[:, :2] - high), 0.0)
        shade = 1 - 0.88 * np.exp(-np.hypot(outside[:, 0], outside[:, 1]) / 0.28)
        clear[near] = np.where(p[:, 2] < 0.25, np.minimum(clear[near], shade), clear[near])
    return clear


def _sun_share(point: Floats, to_sun: Floats, casters: Casters) -> Floats:
    """Return the share of the sun that reaches points sorted by station; float64 [N] [1]."""
    station = point[:, 0]
    lean = np.abs(to_sun[:, :2]).max(axis=0) / to_sun[0, 2]
    open_sun = np.ones(len(point))
    for low, high in casters.boxes:
        near = _station_slice(station, low[0] - lean[0] * high[2], high[0] + lean[0] * high[2])
        p, l = point[near], to_sun[near]
        with np.errstate(divide="ignore"):
            a, b = (low - p) / l, (high - p) / l
        enter = np.minimum(a, b).max(axis=1)
        leave = np.maximum(a, b).min(axis=1)
        open_sun[near] = np.where((leave > np.maximum(enter, 0.0)), 0.0, open_sun[near])
    for balls in casters.balls:
        reach = balls[:, 3].max()
        low, high = balls[:, :3].min(axis=0) - reach, balls[:, :3].max(axis=0) + reach
        near = _station_slice(station, low[0] - lean[0] * high[2], high[0] + lean[0] * high[2])
        p, l = point[near], to_sun[near]
        with np.errstate(divide="ignore"):
            a, b = (low - p) / l, (high - p) / l
        met = np.minimum(np.maximum(a, b).min(axis=1), 1e9) > np.maximum(np.minimum(a, b).max(axis=1), 0.0)
        chosen = np.arange(near.start, near.stop)[met & (open_sun[near] > 0)]
        p, l = point[chosen], to_sun[chosen]
        chord = np.zeros(len(chosen))
        for ball in balls:
            offset = ball[:3] - p
            middle = np.einsum("ij,ij->i", offset, l)
            half2 = ball[3] ** 2 - np.einsum("ij,ij->i", offset, offset) + middle**2
            half = np.sqrt(np.maximum(half2, 0.0))
            chord += np.maximum(middle + half, 0.0) - np.maximum(middle - half, 0.0)
        open_sun[chosen] *= np.exp(-casters.leaf_extinction * chord)
    return open_sun


def _station_slice(station: Floats, low: float, high: float) -> slice:
    start, stop = np.searchsorted(station, [low, high])
    return slice(int(start), int(stop))
