"""The sky and far field behind the Gaussians, from an equirectangular panorama."""

import cv2
import numpy as np
from numpy.typing import NDArray


def environment_view(
    environment: NDArray[np.float32],
    viewmat: NDArray[np.float64],
    K: NDArray[np.float64],
    width: int,
    height: int,
) -> NDArray[np.float32]:
    """Return the part of the panorama that a view sees, bilinear, wrapped in azimuth.

    Parameters
    ----------
    environment : float32 [He, We, 3] row 0 zenith, column centre world +x, leftward columns toward +y [1]
    viewmat : [4, 4] world to camera
    K : [3, 3] intrinsics [px]
    width, height : picture size [px]

    Returns
    -------
    float32 [height, width, 3] [1]
    """
    rows, columns = environment.shape[:2]
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones_like(u)], axis=-1)
    x, y, z = np.moveaxis(rays @ viewmat[:3, :3], -1, 0)
    column = (0.5 - np.arctan2(y, x) / (2 * np.pi)) * columns - 0.5
    row = (0.5 - np.arctan2(z, np.hypot(x, y)) / np.pi) * rows - 0.5
    return cv2.remap(
        np.concatenate([environment[:, -1:], environment, environment[:, :1]], axis=1),
        (np.mod(column, columns) + 1).astype(np.float32),
        np.clip(row, 0, rows - 1).astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )


def plain_sky(rows: int = 64) -> NDArray[np.float32]:
    """Return a cloudless gradient from blue zenith to pale horizon over grey ground, for scenes without a sky.

    Parameters
    ----------
    rows : height of the panorama [px]

    Returns
    -------
    float32 [rows, 2 rows, 3] linear [1]
    """
    elevation = np.linspace(np.pi / 2, -np.pi / 2, rows)[:, None]
    horizon, zenith, ground = np.array([[0.70, 0.76, 0.82], [0.16, 0.30, 0.60], [0.18, 0.18, 0.17]])
    above = horizon + (zenith - horizon) * np.sin(np.clip(elevation, 0, None)) ** 0.5
    column = np.where(elevation >= 0, above, ground).astype(np.float32)
    return np.repeat(column[:, None, :], 2 * rows, axis=1)
