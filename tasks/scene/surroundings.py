"""Surroundings of each Gaussian in its surface: overlap of its neighbours, and their size."""

from dataclasses import replace

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tasks.scene.gaussians import Gaussians

NEIGHBOURS = 24
"""Number of nearest Gaussians that are evaluated [1]."""
ALIKE, IN_PLANE = 0.8, 0.3
"""Neighbours of one surface: least cosine between the normals, and largest sine of the angle between the plane of
the Gaussian and the line to its neighbour [1]."""
OPAQUE = 100.0
"""Largest overlap that is counted: a surface with more is opaque [1]."""
_AT_ONCE = 65536


def add_surroundings(gaussians: Gaussians) -> Gaussians:
    """Return the cloud with `Gaussians.surroundings`, as `tasks.render.rasterise.painters_bias` takes them.

    The overlap of a surface is its Gaussians' opacity times area, added up, per area. It is counted over the
    `NEIGHBOURS` nearest Gaussians of the same surface, within the distance of the last of them. A random scatter has
    one less than that number within that radius, a regular grid exactly that number: one half is subtracted.

    Parameters
    ----------
    gaussians : the cloud, with or without surroundings
    """
    count = min(NEIGHBOURS, len(gaussians) - 1)
    if count < 1:
        alone = np.tile(np.array([0, 1], np.float32), (len(gaussians), 1))
        return replace(gaussians, surroundings=alone)
    sizes = surface_scales(gaussians.scales)
    area = 2 * np.pi * sizes[:, 0] * sizes[:, 1] * gaussians.opacities
    square = (sizes**2).sum(axis=1)
    tree = cKDTree(gaussians.means)
    out = np.empty((len(gaussians), 2), dtype=np.float32)
    for first in range(0, len(gaussians), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        distance, near = tree.query(gaussians.means[part], k=count + 1)
        _measure_surroundings(
            first, near, distance[:, -1], gaussians.means, gaussians.normals, area, square, out[part]
        )
    return replace(gaussians, surroundings=out)


def surface_scales(scales: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the two standard deviations along the surface: all but the smallest, float64 [N, 2] [m].

    Parameters
    ----------
    scales : [N, 3] as in `Gaussians` [m]
    """
    return np.sort(scales.astype(np.float64), axis=1)[:, 1:]


@numba.njit(cache=True, error_model="numpy")
def _measure_surroundings(first, near, radius, means, normals, area, square, out):  # type: ignore[no-untyped-def]
    for i in range(len(near)):
        own = first + i
        covered, spread = area[own], area[own] * square[own]
        for j in near[i]:
            if j == own:
                continue
            off, cosine, length = 0.0, 0.0, 0.0
            for axis in range(3):
                step = np.float64(means[j, axis]) - np.float64(means[own, axis])
                off += step * normals[own, axis]
                length += step * step
                cosine += normals[j, axis] * normals[own, axis]
            if abs(cosine) >= ALIKE and abs(off) <= IN_PLANE * np.sqrt(length):
                covered += area[j]
                spread += area[j] * square[j]
        counted = (near.shape[1] - 1.5) / near.shape[1]
        disc = np.pi * radius[i] * radius[i]
        # Coincident points have an unbounded overlap.
        out[i, 0] = min(counted * covered / disc, OPAQUE) if disc > 0 else OPAQUE
        out[i, 1] = np.sqrt(spread / covered / square[own])
