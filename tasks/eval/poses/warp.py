"""One picture as seen from the camera of another, by a guess of depth and motion.

Between a picture and such a view the tracker meets small shifts and patches of equal shape. An error of the guess
becomes a shift that the tracker measures: it costs precision and causes no bias.
"""

import cv2
import numba
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
    where = np.empty((*inverse_depth.shape, 2), dtype=np.float32)
    _map_pixels(np.ascontiguousarray(inverse_depth), M, shift, where)
    return where


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _map_pixels(inverse_depth, M, shift, where):  # type: ignore[no-untyped-def]
    finest, nearest = np.float32(32), np.float32(1e-3)
    for v in range(inverse_depth.shape[0]):
        X0 = M[0, 1] * np.float32(v) + M[0, 2]
        Y0 = M[1, 1] * np.float32(v) + M[1, 2]
        Z0 = M[2, 1] * np.float32(v) + M[2, 2]
        for u in range(inverse_depth.shape[1]):
            q, across = inverse_depth[v, u], np.float32(u)
            X = (M[0, 0] * across + X0) + shift[0] * q
            Y = (M[1, 0] * across + Y0) + shift[1] * q
            Z = (M[2, 0] * across + Z0) + shift[2] * q
            scale = finest / max(Z, nearest)
            where[v, u, 0] = np.rint(X * scale) / finest
            where[v, u, 1] = np.rint(Y * scale) / finest


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
