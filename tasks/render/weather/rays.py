"""Directions in the world through the pixels of a frame."""

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.falling.particles import Shutter


def pixel_rays(shutter: Shutter) -> NDArray[np.float32]:
    """Return world directions through the pixels' centres, of camera z 1.

    Parameters
    ----------
    shutter : pose and intrinsics

    Returns
    -------
    float32 [H, W, 3] directions [1]
    """
    K = shutter.K
    u = ((np.arange(shutter.width) + 0.5 - K[0, 2]) / K[0, 0]).astype(np.float32)
    v = ((np.arange(shutter.height) + 0.5 - K[1, 2]) / K[1, 1]).astype(np.float32)
    rays = np.empty((shutter.height, shutter.width, 3), dtype=np.float32)
    _fill_rays(u, v, shutter.T_world_camera[:3, :3].astype(np.float32), rays)
    return rays


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _fill_rays(u, v, R, rays):  # type: ignore[no-untyped-def]
    for i in range(len(v)):
        for j in range(len(u)):
            for c in range(3):
                rays[i, j, c] = u[j] * R[c, 0] + v[i] * R[c, 1] + R[c, 2]
