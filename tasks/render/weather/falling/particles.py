"""Streaks of drops and flakes that the shutter sees, in any frame, independently of other frames.

All particles of a size class move with one velocity, so they are at rest in a lattice of cells that drifts with
fall and wind. The random generator Philox, with seed and stream as key and the cell as counter, gives the particles of
a cell. No state passes from frame to frame: a frame drawn alone has the same bits as in a sequence, and a
class that is denser at a higher rate keeps its particles of a lower one: every class of rain, the large flakes of snow.
"""

from dataclasses import dataclass
from math import cos, exp, log, pi, sin, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.lens import Lens, distort_rays, undistort_points
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

MOST_PER_CELL = 32
NEAREST_Z_SHARE = 0.3
"""Particles are cut at this share of the nearest distance along the optical axis."""
ROW_STEPS, MOST_LONGER = 8, 4.0
"""Steps by which a particle's row is found, and the most that a row-by-row shutter lengthens a streak [1]."""


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
    planes = _frustum_planes(rays)
    reach = drawn_reach(population, near, K[0, 0])
    key = np.uint64(stream_key(seed, p.kind))
    found = []
    for index in np.flatnonzero(reach):
        velocity = wind - np.array((0.0, 0.0, population.speed[index]))
        cell = float(population.cell_m[index])
        # in the frame of the falling particles the camera moves
        seat = shutter.T_world_camera[:3, 3] - velocity * shutter.time_s
        hull = np.vstack((np.zeros(3), rays * reach[index])) @ R + seat
        low = np.floor((hull.min(axis=0) - p.flutter_m - near.nearest_m) / cell).astype(np.int64)
        high = np.floor((hull.max(axis=0) + p.flutter_m + near.nearest_m) / cell).astype(np.int64)
        sizes = np.exp(-population.slope_mm * population.edges_mm[index : index + 2])
        found.append(
            _streaks_of_class(
                low, high, cell, population.density[index] * cell**3, key, np.uint64(index),
                sizes, -1e-3 * p.visible_diameter_ratio / population.slope_mm,
                velocity, p.flutter_m, 2 * pi * p.flutter_hz, shutter.time_s,
                seat, R, planes, K, shutter.velocity, shutter.exposure_s,
                near.nearest_m, reach[index], near.fade_share * reach[index],
                coefficients, shutter.line_delay_s, shutter.height,
            )
        )  # fmt: skip
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
def _poisson(chance, mean):  # type: ignore[no-untyped-def]
    """Return a Poisson number by inversion; it never falls when the mean rises: populations are nested in the rate."""
    number, share = 0, exp(-mean)
    while chance > share and number < MOST_PER_CELL:
        chance -= share
        number += 1
        share *= mean / number
    return number


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _turn(R, vector, out):  # type: ignore[no-untyped-def]
    for i in range(3):
        out[i] = R[i, 0] * vector[0] + R[i, 1] * vector[1] + R[i, 2] * vector[2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _sway(offset, moving, amplitude, rate, time, turn_x, turn_y, quickness, size):  # type: ignore[no-untyped-def]
    """Add a flake's own slow elliptic motion to its position and velocity."""
    amplitude *= 0.3 + 0.7 * size
    rate *= 0.6 + 0.8 * quickness
    for i in range(2):
        own = rate * (1 - 0.23 * i)
        phase = 2 * pi * (turn_x if i == 0 else turn_y) + own * time
        offset[i] += amplitude * sin(phase)
        moving[i] += amplitude * own * cos(phase)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expose(streak, place, motion, exposure, K):  # type: ignore[no-untyped-def]
    """Write the pixels of a particle when the shutter opens and when it closes."""
    z = place[2]
    first = max(z - 0.5 * exposure * motion[2], NEAREST_Z_SHARE * z)
    last = max(z + 0.5 * exposure * motion[2], NEAREST_Z_SHARE * z)
    for i in range(2):
        step = 0.5 * exposure * motion[i]
        streak.begin[i] = K[i, i] * (place[i] - step) / first + K[i, 2]
        streak.end[i] = K[i, i] * (place[i] + step) / last + K[i, 2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _seen_at(place, motion, time, K, coefficients):  # type: ignore[no-untyped-def]
    """Return the distorted pixel of a particle at a time from the middle of the frame [px]."""
    z = max(place[2] + time * motion[2], NEAREST_Z_SHARE * place[2])
    x, y = (place[0] + time * motion[0]) / z, (place[1] + time * motion[1]) / z
    x, y = distort_rays(x, y, coefficients)
    return K[0, 0] * x + K[0, 2], K[1, 1] * y + K[1, 2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expose_by_rows(streak, place, motion, exposure, K, coefficients, line_delay, height):  # type: ignore[no-untyped-def]
    """`_expose` behind a lens, by a shutter that opens for one row after the other.

    A particle is seen at the time t of its row, t = line_delay (row(t) - middle). A particle that moves in the
    direction of the readout is exposed longer, by 1 / (1 - line_delay row'), and leaves that much more light.
    """
    half = 0.5 * abs(line_delay) * height
    time = 0.0
    for _ in range(ROW_STEPS if line_delay != 0 else 0):
        _, row = _seen_at(place, motion, time, K, coefficients)
        time = min(max(line_delay * (row - 0.5 * height), -half), half)
    _, above = _seen_at(place, motion, time - 0.5 * exposure, K, coefficients)
    _, below = _seen_at(place, motion, time + 0.5 * exposure, K, coefficients)
    longer = 1 / max(1 - line_delay * (below - above) / exposure, 1 / MOST_LONGER)
    streak.begin[0], streak.begin[1] = _seen_at(
        place, motion, time - 0.5 * longer * exposure, K, coefficients
    )
    streak.end[0], streak.end[1] = _seen_at(place, motion, time + 0.5 * longer * exposure, K, coefficients)
    return longer


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _streaks_of_class(  # type: ignore[no-untyped-def]
    low, high, cell, mean, key, index, sizes, size_scale, velocity, flutter, flutter_rate, time,
    seat, R, planes, K, camera_velocity, exposure, nearest, reach, fade, coefficients, line_delay, height,
):  # fmt: skip
    """Return the streaks of one size class in the cells ``low`` to ``high``, each with its own counter."""
    streaks = np.empty(256, dtype=STREAK)
    found = 0
    offset, moving, place, motion = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    word32 = np.uint64(0xFFFFFFFF)
    around = 0.87 * cell + flutter + 0.5 * exposure * sqrt((camera_velocity**2).sum())
    around += 0.5 * abs(line_delay) * height * sqrt(((velocity - camera_velocity) ** 2).sum())
    by_rows = line_delay != 0 or (coefficients != 0).any()
    for kx in range(low[0], high[0] + 1):
        for ky in range(low[1], high[1] + 1):
            for kz in range(low[2], high[2] + 1):
                corner = (kx * cell - seat[0], ky * cell - seat[1], kz * cell - seat[2])
                for i in range(3):
                    offset[i] = corner[i] + 0.5 * cell
                _turn(R, offset, place)
                if _outside(place, planes, around, reach):
                    continue
                cx, cy, cz = np.uint64(kx) & word32, np.uint64(ky) & word32, np.uint64(kz) & word32
                first, _, _, _ = philox(cx, cy, cz, index, key)
                for j in range(_poisson(scale_to_unit(first), mean)):
                    block = index + np.uint64(256 * (2 * j + 1))
                    w0, w1, w2, w3 = philox(cx, cy, cz, block, key)
                    offset[0], offset[1], offset[2] = scale_to_unit(w0), scale_to_unit(w1), scale_to_unit(w2)
                    for i in range(3):
                        offset[i] = corner[i] + cell * offset[i]
                        moving[i] = velocity[i] - camera_velocity[i]
                    diameter = size_scale * log(sizes[0] - scale_to_unit(w3) * (sizes[0] - sizes[1]))
                    if flutter > 0:
                        w0, w1, w2, w3 = philox(cx, cy, cz, block + np.uint64(256), key)
                        _sway(
                            offset,
                            moving,
                            flutter,
                            flutter_rate,
                            time,
                            scale_to_unit(w0),
                            scale_to_unit(w1),
                            scale_to_unit(w2),
                            scale_to_unit(w3),
                        )
                    distance = sqrt(offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2)
                    if distance < nearest or distance > reach:
                        continue
                    _turn(R, offset, place)
                    _turn(R, moving, motion)
                    if place[2] < NEAREST_Z_SHARE * nearest:
                        continue
                    if found == len(streaks):
                        longer = np.empty(2 * found, dtype=STREAK)
                        for i in range(found):  # see `touched_tiles`
                            longer[i] = streaks[i]
                        streaks = longer
                    streak = streaks[found]
                    streak.share = min(1.0, (reach - distance) / fade)
                    if by_rows:
                        streak.share *= _expose_by_rows(
                            streak, place, motion, exposure, K, coefficients, line_delay, height
                        )
                    else:
                        _expose(streak, place, motion, exposure, K)
                    for i in range(3):
                        streak.direction[i] = offset[i] / distance
                    streak.z = place[2]
                    streak.diameter = diameter
                    found += 1
    return streaks[:found]
