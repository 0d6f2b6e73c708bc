"""Streaks of drops and flakes that the shutter sees, in any frame, independently of other frames.

All particles of a size class move with one velocity, so they are at rest in a lattice of cells that drifts with
fall and wind. The random generator Philox, with seed and stream as key and the cell as counter, gives the particles of
a cell. No state passes from frame to frame: a frame drawn alone has the same bits as in a sequence, and a
class that is denser at a higher rate keeps its particles of a lower one: every class of rain, the large flakes of snow.
"""

from dataclasses import dataclass
from math import exp, log, pi, sqrt
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.lens import Lens, undistort_points
from tasks.render.weather.falling.exposure import (
    NEAREST_Z_SHARE,
    add_flutter,
    expose,
    expose_by_rows,
    rotate_vector,
)
from tasks.render.weather.falling.precipitation import NearField, Population, drawn_reach
from tasks.render.weather.random_streams import philox, scale_to_unit, stream_key

STREAK = np.dtype(
    [
        ("begin", np.float64, 2),
        ("end", np.float64, 2),
        ("z", np.float64),
        ("diameter", np.float64),
        ("share", np.float64),
        ("direction", np.float64, 3),
    ]
)
"""One streak: picture positions at shutter opening and closing [px], camera z [m], diameter [m], share that is
drawn (the rest is mean extinction) [1] and the direction from the camera in the world [1]."""

WORD = np.uint64(0xFFFFFFFF)
"""Bits of one word of the random generator's counter."""


@dataclass(frozen=True, kw_only=True)
class Shutter:
    """One exposure of a moving camera.

    Parameters
    ----------
    T_world_camera : float64 [4, 4] camera pose in the middle of the exposure [m]
    K : float64 [3, 3] intrinsics [px]
    width, height : picture size [px]
    velocity : float64 [3] velocity of the camera in the world [m s-1]
    time_s : time of the middle of the exposure [s]
    exposure_s : time that the shutter is open [s]
    lens : distortion; None for a pinhole
    line_delay_s : time from one row's exposure to the next one's; pose and time are those of the middle row, and the
        camera moves at constant velocity about them [s]
    """

    T_world_camera: NDArray[np.float64]
    K: NDArray[np.float64]
    width: int
    height: int
    velocity: NDArray[np.float64]
    time_s: float
    exposure_s: float
    lens: Lens | None = None
    line_delay_s: float = 0.0


class _View(NamedTuple):
    """What the kernels read of the exposure, the same for all size classes; units as in `Shutter`.

    Parameters
    ----------
    R : float64 [3, 3] world to camera axes [1]
    planes : float64 [4, 3] inward normals of the view's sides, camera axes [1]
    K, coefficients, velocity, time, exposure, line_delay, height : of the shutter and its lens
    by_rows : whether a lens or a delay of rows bends the streaks
    nearest : distance from which particles are drawn [m]
    key : of the random generator
    """

    R: NDArray[np.float64]
    planes: NDArray[np.float64]
    K: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    velocity: NDArray[np.float64]
    time: float
    exposure: float
    line_delay: float
    height: int
    by_rows: bool
    nearest: float
    key: np.uint64


class _Falling(NamedTuple):
    """What the kernels read of one size class.

    Parameters
    ----------
    size_class : its number [1]
    cell : edge of its cells [m]
    mean : number of particles in a cell, on average [1]
    sizes : float64 [2] exp(-slope D) at the ends of the class [1]
    size_scale : diameter in the air by the logarithm of such a number [m]
    velocity, seat : float64 [3] velocity in the world [m s-1], place of the camera in the frame of the particles [m]
    flutter, flutter_rate : amplitude [m] and angular rate [s-1] of the sideways motion
    reach, fade : distance up to which the class is drawn, and over which it fades before [m]
    """

    size_class: np.uint64
    cell: float
    mean: float
    sizes: NDArray[np.float64]
    size_scale: float
    velocity: NDArray[np.float64]
    seat: NDArray[np.float64]
    flutter: float
    flutter_rate: float
    reach: float
    fade: float


def visible_streaks(
    population: Population, near: NearField, shutter: Shutter, wind: NDArray[np.float64], seed: int
) -> NDArray[np.void]:
    """Return the near particles in view during one exposure.

    Parameters
    ----------
    population : the precipitation
    near : limits of the near field
    shutter : the exposure
    wind : float64 [3] velocity of the air in the world [m s-1]
    seed : visual seed of the clip [1]

    Returns
    -------
    `STREAK` [P]
        In the order of size class and cell; some pass just outside the picture.
    """
    p = population.parameters
    K = np.ascontiguousarray(shutter.K, dtype=np.float64)
    R = np.ascontiguousarray(shutter.T_world_camera[:3, :3].T, dtype=np.float64)
    rays = _corner_rays(shutter, K)
    coefficients = np.zeros(5) if shutter.lens is None else shutter.lens.coefficients
    reach = drawn_reach(population, near, K[0, 0])
    view = _View(
        R=R, planes=_frustum_planes(rays), K=K, coefficients=coefficients, velocity=shutter.velocity,
        time=shutter.time_s, exposure=shutter.exposure_s, line_delay=shutter.line_delay_s, height=shutter.height,
        by_rows=shutter.line_delay_s != 0 or bool((coefficients != 0).any()), nearest=near.nearest_m,
        key=np.uint64(stream_key(seed, p.kind)),
    )  # fmt: skip
    found = []
    for index in np.flatnonzero(reach):
        velocity = wind - np.array((0.0, 0.0, population.speed[index]))
        cell = float(population.cell_m[index])
        # in the frame of the falling particles the camera moves
        seat = shutter.T_world_camera[:3, 3] - velocity * shutter.time_s
        hull = np.vstack((np.zeros(3), rays * reach[index])) @ R + seat
        low = np.floor((hull.min(axis=0) - p.flutter_m - near.nearest_m) / cell).astype(np.int64)
        high = np.floor((hull.max(axis=0) + p.flutter_m + near.nearest_m) / cell).astype(np.int64)
        falling = _Falling(
            size_class=np.uint64(index), cell=cell, mean=population.density[index] * cell**3,
            sizes=np.exp(-population.slope_mm * population.edges_mm[index : index + 2]),
            size_scale=-1e-3 * p.visible_diameter_ratio / population.slope_mm,
            velocity=velocity, seat=seat, flutter=p.flutter_m, flutter_rate=2 * pi * p.flutter_hz,
            reach=reach[index], fade=near.fade_share * reach[index],
        )  # fmt: skip
        found.append(_expose_cells(_count_in_cells(low, high, view, falling), view, falling))
    return np.concatenate(found) if found else np.empty(0, dtype=STREAK)


def _corner_rays(shutter: Shutter, K: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners [4, 3] of the view, or of a rectangle around the distorted view of a lens, at camera z 1."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    if shutter.lens is not None:
        around = np.vstack((corners, ((0.5, 0.0), (0.5, 1.0), (0.0, 0.5), (1.0, 0.5))))
        x, y = ((around * (shutter.width, shutter.height) - K[:2, 2]) / K[[0, 1], [0, 1]]).T
        edge = np.stack(undistort_points(x, y, shutter.lens), axis=-1)
        low, high = edge.min(axis=0), edge.max(axis=0)
        return np.column_stack((low + corners * (high - low), np.ones(4)))
    corners = corners * (shutter.width, shutter.height)
    return np.column_stack(((corners - K[:2, 2]) / K[[0, 1], [0, 1]], np.ones(4)))


def _frustum_planes(rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return inward unit normals of the four side planes of the view, in camera axes, from its corner rays."""
    around = rays[[0, 1, 3, 2]]
    normals = np.cross(around, np.roll(around, -1, axis=0))
    normals *= np.sign(normals @ rays.mean(axis=0))[:, None]
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _outside(point, planes, radius, reach):  # type: ignore[no-untyped-def]
    """Return whether a sphere lies completely outside the view or beyond the reach."""
    outside = point[0] ** 2 + point[1] ** 2 + point[2] ** 2 > (reach + radius) ** 2
    for plane in planes:
        outside |= plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] < -radius
    return outside


@numba.njit(cache=True, nogil=True, error_model="numpy")
def count_poisson(chance, mean):  # type: ignore[no-untyped-def]
    """Return a Poisson number by inversion; it never falls when the mean rises: populations are nested in the rate."""
    number, share = 0, exp(-mean)
    most = mean + 12 * sqrt(mean) + 12  # no chance of 32 bits reaches it: rounding alone would
    while chance > share and number < most:
        chance -= share
        number += 1
        share *= mean / number
    return number


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _count_in_cells(low, high, view, falling):  # type: ignore[no-untyped-def]
    """Return the cells in view that hold particles: int64 [C, 4], of which the last is the number of particles."""
    R, planes, seat, cell, key = view.R, view.planes, falling.seat, falling.cell, view.key
    around = 0.87 * cell + falling.flutter + 0.5 * view.exposure * sqrt((view.velocity**2).sum())
    around += 0.5 * abs(view.line_delay) * view.height * sqrt(((falling.velocity - view.velocity) ** 2).sum())
    cells = np.empty(((high - low + 1).prod(), 4), dtype=np.int64)
    found = 0
    offset, place = np.empty(3), np.empty(3)
    for kx in range(low[0], high[0] + 1):
        for ky in range(low[1], high[1] + 1):
            for kz in range(low[2], high[2] + 1):
                at = (kx, ky, kz)
                for i in range(3):
                    offset[i] = at[i] * cell - seat[i] + 0.5 * cell
                rotate_vector(R, offset, place)
                if _outside(place, planes, around, falling.reach):
                    continue
                first, _, _, _ = philox(
                    np.uint64(kx) & WORD, np.uint64(ky) & WORD, np.uint64(kz) & WORD, falling.size_class, key
                )
                number = count_poisson(scale_to_unit(first), falling.mean)
                if number > 0:
                    cells[found, 0], cells[found, 1], cells[found, 2], cells[found, 3] = kx, ky, kz, number
                    found += 1
    return cells[:found]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expose_cells(cells, view, falling):  # type: ignore[no-untyped-def]
    """Return the streaks of the particles in these cells that are neither too near nor too far."""
    R, K, coefficients, camera_velocity = view.R, view.K, view.coefficients, view.velocity
    cell, seat, velocity, sizes = falling.cell, falling.seat, falling.velocity, falling.sizes
    streaks = np.empty(cells[:, 3].sum(), dtype=STREAK)
    found = 0
    offset, moving, place, motion = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for c in range(len(cells)):
        cx, cy, cz = (
            np.uint64(cells[c, 0]) & WORD,
            np.uint64(cells[c, 1]) & WORD,
            np.uint64(cells[c, 2]) & WORD,
        )
        for j in range(cells[c, 3]):
            block = falling.size_class + np.uint64(256 * (2 * j + 1))
            w0, w1, w2, w3 = philox(cx, cy, cz, block, view.key)
            offset[0], offset[1], offset[2] = scale_to_unit(w0), scale_to_unit(w1), scale_to_unit(w2)
            for i in range(3):
                offset[i] = cells[c, i] * cell - seat[i] + cell * offset[i]
                moving[i] = velocity[i] - camera_velocity[i]
            diameter = falling.size_scale * log(sizes[0] - scale_to_unit(w3) * (sizes[0] - sizes[1]))
            if falling.flutter > 0:
                w0, w1, w2, w3 = philox(cx, cy, cz, block + np.uint64(256), view.key)
                own = (scale_to_unit(w0), scale_to_unit(w1), scale_to_unit(w2), scale_to_unit(w3))
                add_flutter(offset, moving, falling.flutter, falling.flutter_rate, view.time, own)
            distance = sqrt(offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2)
            if distance < view.nearest or distance > falling.reach:
                continue
            rotate_vector(R, offset, place)
            rotate_vector(R, moving, motion)
            if place[2] < NEAREST_Z_SHARE * view.nearest:
                continue
            streak = streaks[found]
            streak.share = min(1.0, (falling.reach - distance) / falling.fade)
            if view.by_rows:
                streak.share *= expose_by_rows(
                    streak, place, motion, view.exposure, K, coefficients, view.line_delay, view.height
                )
            else:
                expose(streak, place, motion, view.exposure, K)
            for i in range(3):
                streak.direction[i] = offset[i] / distance
            streak.z = place[2]
            streak.diameter = diameter
            found += 1
    return streaks[:found]
