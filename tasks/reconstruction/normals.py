"""Surface normals from depth."""

import numba
import numpy as np
from numpy.typing import NDArray

RADIUS = 3
"""Half side of the window in which a plane is fitted [px]."""
SAME_SURFACE = 1.0
"""Largest difference between disparities of one surface [px]."""
STIFFNESS = 2.0
"""Weight of a prior of constant depth, which stabilises thin patches [px^2]."""


def estimate_normals(
    depth: NDArray[np.float32], intrinsics: NDArray[np.float64], disparity_scale: float
) -> NDArray[np.float32]:
    """Return unit normals in camera coordinates, facing the camera; NaN where the depth is not finite.

    A plane is linear in disparity, d = a u + b v + c with u and v from the principal point, and its normal
    lies along (a fx, b fy, c). The slopes come from least squares over the pixels of a window that lie on
    the same surface.

    Parameters
    ----------
    depth : float32 [H, W] camera z; NaN or inf where there is no surface [m]
    intrinsics : float64 [3, 3] camera matrix [px]
    disparity_scale : focal length times baseline [px m]

    Returns
    -------
    float32 [H, W, 3]
    """
    disparity = np.where(np.isfinite(depth), disparity_scale / depth, np.nan)
    return _plane_normals(disparity, intrinsics)


@numba.njit(cache=True, nogil=True)
def _plane_normals(disparity, K):  # type: ignore[no-untyped-def]
    height, width = disparity.shape
    normals = np.full((height, width, 3), np.nan, dtype=np.float32)
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    for v in range(height):
        for u in range(width):
            d = disparity[v, u]
            if np.isnan(d):
                continue
            n, su, sv, sd, suu, suv, svv, sud, svd = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(max(-RADIUS, -v), min(RADIUS, height - 1 - v) + 1):
                for i in range(max(-RADIUS, -u), min(RADIUS, width - 1 - u) + 1):
                    e = disparity[v + j, u + i] - d
                    if abs(e) < SAME_SURFACE:
                        n += 1.0
                        su += i
                        sv += j
                        sd += e
                        suu += i * i
                        suv += i * j
                        svv += j * j
                        sud += i * e
                        svd += j * e
            suu, svv = suu - su * su / n + STIFFNESS, svv - sv * sv / n + STIFFNESS
            suv, sud, svd = suv - su * sv / n, sud - su * sd / n, svd - sv * sd / n
            det = suu * svv - suv * suv
            a, b = (svv * sud - suv * svd) / det, (suu * svd - suv * sud) / det
            x, y, z = a * fx, b * fy, d - a * (u - cx) - b * (v - cy)
            length = np.sqrt(x * x + y * y + z * z)
            normals[v, u, 0], normals[v, u, 1], normals[v, u, 2] = -x / length, -y / length, -z / length
    return normals


def turn_to_camera(
    normals: NDArray[np.floating], rays: NDArray[np.floating], least_cosine: float
) -> NDArray[np.float64]:
    """Turn normals as little as needed so that no surface is seen at less than a least cosine.

    Parameters
    ----------
    normals : [N, 3] unit normals facing the camera [1]
    rays : [N, 3] directions from the camera [1]
    least_cosine : of the angle between normal and direction to the camera [1]
    """
    toward = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    cosine = (normals * toward).sum(axis=1, keepdims=True)
    across = normals - cosine * toward
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
    turned = least_cosine * toward + np.sqrt(1 - least_cosine**2) * across
    return np.where(cosine < least_cosine, turned, normals)
