"""Directions in the world through the pixels of a frame."""

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import INLINED, LAW, new_picture, run_on_either
from tasks.render.weather.falling.particles import Shutter


def pixel_rays(shutter: Shutter, beside: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
    """Return world directions through the pixels' centres, of camera z 1.

    Parameters
    ----------
    shutter : pose and intrinsics
    beside : picture [H, W, ...] on whose device they are wanted; None for the processor

    Returns
    -------
    float32 [H, W, 3] directions [1]
    """
    K = shutter.K
    u = ((np.arange(shutter.width) + 0.5 - K[0, 2]) / K[0, 0]).astype(np.float32)
    v = ((np.arange(shutter.height) + 0.5 - K[1, 2]) / K[1, 1]).astype(np.float32)
    if beside is None:
        beside = np.empty((shutter.height, shutter.width), dtype=np.float32)
    rays = new_picture(beside, 3)
    _fill_rays(rays, u, v, shutter.T_world_camera[:3, :3].astype(np.float32))
    return rays


@numba.njit(**INLINED)
def _fill_ray(row, column, rays, u, v, R):  # type: ignore[no-untyped-def]
    for c in range(3):
        rays[row, column, c] = u[column] * R[c, 0] + v[row] * R[c, 1] + R[c, 2]


@run_on_either(_fill_ray)
@numba.njit(**LAW)
def _fill_rays(rays, u, v, R):  # type: ignore[no-untyped-def]
    for row in range(len(v)):
        for column in range(len(u)):
            _fill_ray(row, column, rays, u, v, R)
