"""Drops that strike the wet road: crowns of splashed water, and rings on the film.

Drops strike cells of the ground at times that the random generator Philox gives for each cell and stretch of time, as
many as the rain brings. A frame drawn alone shows what a sequence shows: a ring that one frame begins, the next
one continues.
"""

from dataclasses import dataclass
from math import cos, log, pi, sin
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.camera import world_to_camera
from tasks.render.weather.falling.particles import STREAK, WORD, Shutter, count_poisson
from tasks.render.weather.falling.precipitation import Population
from tasks.render.weather.random_streams import philox, scale_to_unit, stream_key


@dataclass(frozen=True, kw_only=True)
class ImpactParameters:
    """What a drop leaves where it strikes a wet road.

    Parameters
    ----------
    smallest_mm : diameter of the smallest drop that one sees strike [mm]
    crown_width, crown_height : of the crown and the droplets that it throws, by the drop's diameter [1]
    crown_s : time that a crown stands [s]
    crown_cover : share of what is behind it that a crown hides [1]
    ring_mm : diameter of the smallest drop that leaves a ring [mm]
    ring_speed_m_s : speed at which a ring grows [m s-1]
    ring_width_m : width of its crest [m]
    ring_s : time after which a ring is gone [s]
    ring_cover : share of the mirrored picture that a new ring's crest replaces by the sky [1]
    light : radiance of splashed water by that of a white surface on the road, which sees more of the sky [1]
    smallest_px : height of the smallest crown from which on it fades, over half of its distance [px]
    """

    smallest_mm: float
    crown_width: float
    crown_height: float
    crown_s: float
    crown_cover: float
    ring_mm: float
    ring_speed_m_s: float
    ring_width_m: float
    ring_s: float
    ring_cover: float
    light: float
    smallest_px: float


class _Strike(NamedTuple):
    """What the kernels read of drops and camera; units as in `ImpactParameters` and `Shutter`, lengths in metres."""

    reach: float
    mean: float
    slope: float
    sizes: tuple[float, float]
    crown: tuple[float, float, float, float]
    ring: tuple[float, float, float, float, float]
    time: float
    to_camera: NDArray[np.float64]
    pose: NDArray[np.float64]
    K: NDArray[np.float64]
    key: np.uint64


CELL_M = 0.25
"""Edge of a cell of the ground [m]."""
COLUMN_STEP = 8
"""Columns of a picture of which one is searched for cells of the road: fewer than a cell shows [1]."""
LANDINGS = 2
"""Steps in which a drop finds the road under it [1]."""
CHORDS = 10
"""Straight pieces of a ring [1]."""
BEFORE_M = 0.04
"""Distance by which a crown stands before the road at its foot [m]."""


def visible_impacts(
    population: Population,
    parameters: ImpactParameters,
    shutter: Shutter,
    depth: NDArray[np.float32],
    road: NDArray[np.bool_],
    smooth: NDArray[np.float32],
    seed: int,
) -> NDArray[np.void]:
    """Return crowns and rings on the road of one frame.

    Parameters
    ----------
    population : the rain
    parameters : what its drops leave
    shutter : the exposure of a pinhole
    depth : float32 [H, W] camera z; NaN where there is none [m]
    road : bool [H, W] pixels of the road
    smooth : float32 [H, W] share of each pixel under smooth water, on which rings run [1]
    seed : visual seed of the clip [1]

    Returns
    -------
    `STREAK` [P], as `tasks.render.weather.falling.streaks.draw_streaks` takes them
    """
    p = parameters
    K, pose = (np.ascontiguousarray(one, dtype=np.float64) for one in (shutter.K, shutter.T_world_camera))
    rows, columns = np.nonzero(road[:, ::COLUMN_STEP])
    columns *= COLUMN_STEP
    reach = 1e-3 * p.smallest_mm * p.crown_height * K[1, 1] / p.smallest_px
    z = depth[rows, columns].astype(np.float64)
    seen = z < reach
    if not seen.any():
        return np.empty(0, dtype=STREAK)
    rays = np.stack([(columns + 0.5 - K[0, 2]) / K[0, 0], (rows + 0.5 - K[1, 2]) / K[1, 1], 0 * z + 1])
    ground = (pose[:3, :3] @ (rays * z)[:, seen]).T + pose[:3, 3]
    place = np.floor(ground[:, :2] / CELL_M).astype(np.int64)
    first, across = place.min(axis=0), np.ptp(place[:, 1]) + 1
    # by one number for each cell: NumPy's own search of rows takes four times as long
    cells = first + np.column_stack(np.divmod(np.unique((place - first) @ (across, 1)), across))
    large = population.edges_mm[:-1] >= p.smallest_mm - 1e-9
    flux = float((population.density * population.speed)[large].sum())
    strike = _Strike(
        reach=reach, mean=flux * CELL_M**2 * p.ring_s, slope=population.slope_mm,
        sizes=(p.smallest_mm, float(population.edges_mm[-1])),
        crown=(1e-3 * p.crown_width, 1e-3 * p.crown_height, p.crown_s, p.crown_cover),
        ring=(p.ring_mm, p.ring_speed_m_s, p.ring_width_m, p.ring_s, p.ring_cover),
        time=shutter.time_s, to_camera=world_to_camera(pose), pose=pose, K=K,
        key=np.uint64(stream_key(seed, "impacts")),
    )  # fmt: skip
    return _strike_cells(cells, float(np.median(ground[:, 2])), depth, road, smooth, strike)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _project(point, strike, out):  # type: ignore[no-untyped-def]
    """Write pixel and camera z of a point in the world."""
    for i in range(3):
        out[i] = strike.to_camera[i, 3]
        for j in range(3):
            out[i] += strike.to_camera[i, j] * point[j]
    for i in range(2):
        out[i] = strike.K[i, i] * out[i] / out[2] + strike.K[i, 2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _land(point, depth, road, strike, pixel):  # type: ignore[no-untyped-def]
    """Lay a point on the road that the picture shows there; return whether there is road."""
    height, width = depth.shape
    for _ in range(LANDINGS):
        _project(point, strike, pixel)
        column, row = int(pixel[0]), int(pixel[1])
        if pixel[2] < 0.5 or pixel[0] < 0 or pixel[1] < 0 or column >= width or row >= height:
            return False
        if not road[row, column]:
            return False
        z = np.float64(depth[row, column])
        down = (row + 0.5 - strike.K[1, 2]) / strike.K[1, 1]
        across = (column + 0.5 - strike.K[0, 2]) / strike.K[0, 0]
        ray = strike.pose[2, 0] * across + strike.pose[2, 1] * down + strike.pose[2, 2]
        point[2] = strike.pose[2, 3] + z * ray
    _project(point, strike, pixel)
    return bool(0 <= pixel[0] < width and 0 <= pixel[1] < height)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _stroke_between(streak, begin, end, diameter, cover, z):  # type: ignore[no-untyped-def]
    """Fill a streak that hides a share of what is behind a strip between two pixels."""
    for i in range(2):
        streak.begin[i], streak.end[i] = begin[i], end[i]
    for i in range(3):
        streak.direction[i] = 0.0
    streak.z, streak.diameter, streak.share = z, diameter, cover


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _strike_cells(cells, level, depth, road, smooth, strike):  # type: ignore[no-untyped-def]
    """Return the streaks of the drops that have struck these cells and still show."""
    crown_width, crown_height, crown_s, crown_cover = strike.crown
    ring_mm, ring_speed, ring_width, ring_s, ring_cover = strike.ring
    smallest, largest = np.exp(-strike.slope * strike.sizes[0]), np.exp(-strike.slope * strike.sizes[1])
    streaks = np.empty(1024, dtype=STREAK)
    found = 0
    point, foot, top = np.empty(3), np.empty(3), np.empty(3)
    now = int(np.floor(strike.time / ring_s))
    for c in range(len(cells)):
        cx, cy = np.uint64(cells[c, 0]) & WORD, np.uint64(cells[c, 1]) & WORD
        for epoch in (now - 1, now):
            at = np.uint64(epoch) & WORD
            first, _, _, _ = philox(cx, cy, at, np.uint64(0), strike.key)
            for j in range(count_poisson(scale_to_unit(first), strike.mean)):
                w0, w1, w2, w3 = philox(cx, cy, at, np.uint64(j + 1), strike.key)
                age = strike.time - ring_s * (epoch + scale_to_unit(w2))
                if age < 0 or age > ring_s:
                    continue
                chance = scale_to_unit(w3)
                size = -log(smallest - chance * (smallest - largest)) / strike.slope
                rings = size >= ring_mm
                if age > crown_s and not rings:
                    continue
                point[0] = CELL_M * (cells[c, 0] + scale_to_unit(w0))
                point[1] = CELL_M * (cells[c, 1] + scale_to_unit(w1))
                point[2] = level
                if not _land(point, depth, road, strike, foot):
                    continue
                if found + CHORDS + 1 > len(streaks):
                    longer = np.empty(2 * len(streaks), dtype=STREAK)
                    longer[:found] = streaks[:found]
                    streaks = longer
                ground, near = point[2], min(1.0, 2 * (1 - foot[2] / strike.reach))
                if near <= 0:
                    continue
                if age <= crown_s:
                    part = sin(pi * min(age / crown_s + 0.15, 1.0))
                    wide, tall = crown_width * size, crown_height * size * part
                    point[2] = ground + tall
                    _project(point, strike, top)
                    # a disc swept over the crown's height has less area than the crown
                    cover = near * crown_cover * 4 / pi * max(tall / wide, pi / 4)
                    _stroke_between(streaks[found], foot, top, wide, cover, foot[2] - BEFORE_M)
                    found += 1
                if rings:
                    x, y, radius = point[0], point[1], ring_speed * age
                    point[2] = ground
                    left = 1 - age / ring_s
                    chord = 2 * radius * sin(pi / CHORDS)
                    film = smooth[int(foot[1]), int(foot[0])]
                    cover = near * film * ring_cover * left * left * 4 / pi * max(chord / ring_width, pi / 4)
                    for k in range(CHORDS + 1):
                        turn = 2 * pi * k / CHORDS
                        point[0], point[1] = x + radius * cos(turn), y + radius * sin(turn)
                        _project(point, strike, top)
                        if k > 0:
                            _stroke_between(streaks[found], foot, top, ring_width, cover, top[2] - BEFORE_M)
                            found += 1
                        foot[:] = top
    return streaks[:found]
