"""One picture as seen from the camera of another, by a guess of depth and motion.

Between a picture and such a view the tracker meets small shifts and patches of equal shape. An error of the guess
becomes a shift that the tracker measures: it costs precision and causes no bias.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.rigid import Floats


def warp_map(inverse_depth: NDArray[np.float32], T_source_view: Floats, K: Floats) -> NDArray[np.float32]:
    """Return the place in the source of each pixel of the view.

    Parameters
    ----------
    inverse_depth : float32 [H, W] of the view; 0 for infinity, or where it is unknown [1/m]
    T_source_view : float64 [4, 4] pose of the view's camera in the source's [m]
    K : float64 [3, 3] intrinsics of both [px]

    Returns
    -------
    float32 [H, W, 2] x, y in whole 1/32 px: `cv2.remap` samples no finer, and with a finer map every smaller shift
    would be measured as 0 [px]
    """
    M = (K @ T_source_view[:3, :3] @ np.linalg.inv(K)).astype(np.float32)
    shift = (K @ T_source_view[:3, 3]).astype(np.float32)
    H, W = inverse_depth.shape
    u, v = np.arange(W, dtype=np.float32), np.arange(H, dtype=np.float32)[:, None]
    X, Y, Z = ((M[i, 0] * u + (M[i, 1] * v + M[i, 2])) + shift[i] * inverse_depth for i in range(3))
    scale = np.float32(32) / np.maximum(Z, np.float32(1e-3))
    return np.rint(np.stack([X * scale, Y * scale], axis=-1)) / np.float32(32)


def view_from(source: NDArray[np.uint8], where: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the source [H, W] sampled at a warp map [H, W, 2] [px], edges held [1]."""
    return cv2.remap(source, where, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def bilinear_taps(
    at: NDArray[np.float32], shape: tuple[int, ...]
) -> tuple[tuple[NDArray[np.int64], NDArray[np.int64]], Floats, NDArray[np.bool_]]:
    """Return pixels and weights of bilinear sampling.

    Parameters
    ----------
    at : float32 [N, 2] x, y [px]
    shape : height and width of the picture [px]

    Returns
    -------
    row and column of the four pixels around, each int64 [4, N]; their weights float64 [4, N] [1];
    and bool [N] whether the place lies inside
    """
    inside = (at >= 0).all(axis=-1) & (at[:, 0] <= shape[1] - 1) & (at[:, 1] <= shape[0] - 1)
    x = np.where(inside, np.minimum(at[:, 0], shape[1] - 1.001), 0.0).astype(np.float64)
    y = np.where(inside, np.minimum(at[:, 1], shape[0] - 1.001), 0.0).astype(np.float64)
    i, j = y.astype(np.int64), x.astype(np.int64)
    a, b = x - j, y - i
    weights = np.stack([(1 - b) * (1 - a), (1 - b) * a, b * (1 - a), b * a])
    return (np.stack([i, i, i + 1, i + 1]), np.stack([j, j + 1, j, j + 1])), weights, inside
