"""Where a sun of any direction reaches a scene: a shadow map of the discs themselves, seen from the sun.

Every disc is drawn into a picture that looks along the sun's rays, where the disc nearest to the sun stays. A disc is
lit as far as nothing in that picture lies before it.
"""

from math import ceil, floor, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.scene.gaussians import Gaussians

CELL_M = 0.06
"""Edge of a cell of the map: the sun's disc blurs the shadow of an edge 7 m away by as much."""
MOST_CELLS = 24e6
"""Cells of a map [1]; a larger scene has larger cells."""
REACH = 1.25
"""Distance from its middle, in standard deviations, within which a disc stops the sun [1]."""
SOLID = 0.5
"""Opacity from which on a disc stops the sun [1]."""
LIFT_M, BIAS_M = 0.02, 0.12
"""Distance above its surface from which a disc looks to the sun, and by how much nearer to the sun what shades it
is: a disc is no shade to its neighbours in the same surface."""
LEAST_FACING = 0.05
"""Cosine between normal and sun from which on the depth of a disc is followed along its plane [1]."""


def cast_sun(gaussians: Gaussians, to_sun: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the share of the sun's light that each disc gets: cosine of its angle of incidence times what is unshaded.

    Parameters
    ----------
    gaussians : flat ones, with normals
    to_sun : [3] unit vector to the sun, above the horizon, world frame [1]

    Returns
    -------
    float64 [N] in 0..1 [1]
    """
    towards = np.asarray(to_sun, dtype=np.float64)
    helper = np.array((1.0, 0.0, 0.0)) if abs(towards[2]) > 0.9 else np.array((0.0, 0.0, 1.0))
    across = np.cross(helper, towards)
    across /= np.linalg.norm(across)
    frame = np.stack((across, np.cross(towards, across), towards))
    place = gaussians.means.astype(np.float64) @ frame.T
    low = place[:, :2].min(axis=0) - 1
    size = place[:, :2].max(axis=0) + 1 - low
    cell = max(CELL_M, float(np.sqrt(size.prod() / MOST_CELLS)))
    nearest = np.full(np.ceil(size / cell).astype(np.int64) + 1, -np.inf, dtype=np.float32)
    _draw_discs(
        place,
        gaussians.quats_wxyz,
        gaussians.scales,
        gaussians.normals,
        gaussians.opacities,
        frame,
        low,
        cell,
        nearest,
    )
    lit = np.zeros(len(gaussians))
    turned = gaussians.normals.astype(np.float64) @ frame.T
    _look_to_sun(place + LIFT_M * turned, turned, low, cell, nearest, lit)
    return np.clip(turned[:, 2], 0, 1) * lit


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _draw_discs(place, quats, scales, normals, opacities, frame, low, cell, nearest):  # type: ignore[no-untyped-def]
    rows, columns = nearest.shape
    # a disc smaller than a cell still stops what comes through it
    least = (0.4 * cell) ** 2
    for i in range(len(place)):
        if opacities[i] < SOLID:
            continue
        w, x, y, z = quats[i]
        uu, uv, vv = least, 0.0, least
        for k in range(3):
            if k == 0:
                ax, ay, az = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)
            elif k == 1:
                ax, ay, az = 2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)
            else:
                ax, ay, az = 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
            u = scales[i, k] * (frame[0, 0] * ax + frame[0, 1] * ay + frame[0, 2] * az)
            v = scales[i, k] * (frame[1, 0] * ax + frame[1, 1] * ay + frame[1, 2] * az)
            uu, uv, vv = uu + u * u, uv + u * v, vv + v * v
        nu = frame[0, 0] * normals[i, 0] + frame[0, 1] * normals[i, 1] + frame[0, 2] * normals[i, 2]
        nv = frame[1, 0] * normals[i, 0] + frame[1, 1] * normals[i, 1] + frame[1, 2] * normals[i, 2]
        nw = frame[2, 0] * normals[i, 0] + frame[2, 1] * normals[i, 1] + frame[2, 2] * normals[i, 2]
        slope_u, slope_v = 0.0, 0.0
        if abs(nw) > LEAST_FACING:
            slope_u, slope_v = -nu / nw, -nv / nw
        determinant = uu * vv - uv * uv
        limit = REACH * REACH * determinant
        half_u, half_v = REACH * sqrt(uu), REACH * sqrt(vv)
        first_u, last_u = (
            ceil((place[i, 0] - half_u - low[0]) / cell),
            floor((place[i, 0] + half_u - low[0]) / cell),
        )
        first_v, last_v = (
            ceil((place[i, 1] - half_v - low[1]) / cell),
            floor((place[i, 1] + half_v - low[1]) / cell),
        )
        for a in range(max(int(first_u), 0), min(int(last_u), rows - 1) + 1):
            du = low[0] + a * cell - place[i, 0]
            for b in range(max(int(first_v), 0), min(int(last_v), columns - 1) + 1):
                dv = low[1] + b * cell - place[i, 1]
                if vv * du * du - 2 * uv * du * dv + uu * dv * dv <= limit:
                    depth = np.float32(place[i, 2] + slope_u * du + slope_v * dv)
                    nearest[a, b] = max(nearest[a, b], depth)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _look_to_sun(place, normals, low, cell, nearest, lit):  # type: ignore[no-untyped-def]
    """Share of the cells about each disc, three by three, in which nothing lies between its plane and the sun."""
    rows, columns = nearest.shape
    for i in range(len(place)):
        facing = normals[i, 2]
        if facing <= 0:
            continue
        slope_u, slope_v = 0.0, 0.0
        if facing > LEAST_FACING:
            slope_u, slope_v = -normals[i, 0] / facing, -normals[i, 1] / facing
        a, b = int((place[i, 0] - low[0]) / cell + 0.5), int((place[i, 1] - low[1]) / cell + 0.5)
        free = 0
        for p in range(max(a - 1, 0), min(a + 1, rows - 1) + 1):
            rise = slope_u * (low[0] + p * cell - place[i, 0])
            for q in range(max(b - 1, 0), min(b + 1, columns - 1) + 1):
                plane = place[i, 2] + rise + slope_v * (low[1] + q * cell - place[i, 1])
                free += nearest[p, q] <= plane + BIAS_M
        lit[i] = free / 9
