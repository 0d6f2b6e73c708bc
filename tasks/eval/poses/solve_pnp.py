"""Place a camera by points and their pixels."""

from dataclasses import dataclass

import numba
import numpy as np

from tasks.eval.poses.motion import FrameStep, failed_step
from tasks.eval.poses.rigid import (
    Floats,
    adjoint_matrix,
    invert_pose,
    pose_from_twist,
)

TUKEY = 4.685
"""Tukey's constant: 95 % efficiency under Gaussian errors [1] (Beaton and Tukey 1974,
DOI 10.1080/00401706.1974.10489171)."""


@dataclass(frozen=True, kw_only=True)
class PnpLimits:
    """The errors that points may have, and how many points must agree.

    Parameters
    ----------
    min_inliers : fewest points that must agree on the pose [1]
    noise_floor : smallest assumed error of a pixel [px]
    noise_ceiling : largest error of a pixel of a valid track [px]
    overlap : number of patches behind the pixels that share each pixel, and so its error [1]
    depth_error : relative standard error of the points' distance from the earlier camera; an error of the pixel along
        the image of that ray counts by so much less [1]
    """

    min_inliers: int
    noise_floor: float
    noise_ceiling: float
    overlap: float = 1.0
    depth_error: float = 0.0


def solve_pnp(points: Floats, pixels: Floats, T_start: Floats, K: Floats, limits: PnpLimits) -> FrameStep:
    """Minimise the reprojection error by Gauss-Newton with Tukey's weights, without random draws.

    The scale is the median error, so that it shrinks from the first guess's error to the noise.

    Parameters
    ----------
    points : float64 [N, 3] in the earlier camera frame [m]
    pixels : float64 [N, 2] where the later camera sees them [px]
    T_start : float64 [4, 4] first guess of ``T_later_earlier`` [m]
    K : float64 [3, 3] intrinsics [px]
    limits : errors and numbers of points

    Returns
    -------
    The step ``T_earlier_later`` with its covariance, or the reason of the failure.
    """
    T, scale = T_start, limits.noise_ceiling
    size, weight = np.empty(len(points)), np.empty(len(points))
    for _ in range(40):
        # pixel errors are white but for the shift of a pixel by the error of the depth, in pixel errors
        depth_share = limits.depth_error / scale
        ahead = int(_measure_residuals(points, pixels, T, K, depth_share, size))
        if ahead < limits.min_inliers:
            return failed_step(f"{ahead} points lie ahead of the camera", ahead)
        # the median length of a 2-D Gaussian error is 1.1774 of its standard deviation
        scale = max(float(np.median(size[size < np.inf])) / 1.1774, limits.noise_floor)
        weight = np.maximum(1 - (np.minimum(size, 1e9) / (TUKEY * scale)) ** 2, 0.0) ** 2
        H, gradient = _sum_normal_equations(points, pixels, T, K, depth_share, weight)
        try:
            twist = np.linalg.solve(H, gradient)
        except np.linalg.LinAlgError:
            return failed_step("the points do not fix the pose", 0)
        T = pose_from_twist(twist) @ T
        if np.abs(twist).max() < 1e-7:  # a thousandth of the error of the sharpest tracks
            break
    inliers = int((weight > 0).sum())
    if inliers < limits.min_inliers:
        return failed_step(f"{inliers} of {len(points)} tracked points agree on a pose", inliers)
    if scale > limits.noise_ceiling:
        return failed_step(f"the points miss the best pose by {scale:.1f} px", inliers)
    used = weight > 0
    variance = limits.overlap * max(
        (weight[used] * size[used] ** 2).sum() / (2 * weight.sum() - 6), limits.noise_floor**2
    )
    pose = invert_pose(T)
    carry = adjoint_matrix(pose)  # the error of an inverse pose is the carried error, sign aside
    return FrameStep(
        T_earlier_later=pose, covariance=carry @ (variance * np.linalg.inv(H)) @ carry.T, inliers=inliers
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _linearise(point, pixel, T, K, depth_share, J, residual):  # type: ignore[no-untyped-def]
    """Fill residual and Jacobian of a point; return its depth error's shift a, or NaN behind the camera.

    The inverse covariance of a pixel is 1 - b a', b = a / (1 + a'a), in squared pixel errors.
    """
    along_x = T[0, 0] * point[0] + T[0, 1] * point[1] + T[0, 2] * point[2]
    along_y = T[1, 0] * point[0] + T[1, 1] * point[1] + T[1, 2] * point[2]
    along_z = T[2, 0] * point[0] + T[2, 1] * point[1] + T[2, 2] * point[2]
    x, y, z = along_x + T[0, 3], along_y + T[1, 3], along_z + T[2, 3]
    if not z > 1e-3:
        return np.nan, np.nan
    fx, fy, q = K[0, 0], K[1, 1], 1.0 / z
    residual[0] = pixel[0] - ((fx * x + K[0, 1] * y) * q + K[0, 2])
    residual[1] = pixel[1] - (fy * y * q + K[1, 2])
    u, v = x * q, y * q
    J[0, 0], J[0, 1], J[0, 2] = fx * q, 0.0, -fx * u * q
    J[0, 3], J[0, 4], J[0, 5] = -fx * u * v, fx * (1 + u * u), -fx * v
    J[1, 0], J[1, 1], J[1, 2] = 0.0, fy * q, -fy * v * q
    J[1, 3], J[1, 4], J[1, 5] = -fy * (1 + v * v), fy * u * v, fy * u
    return (
        depth_share * (J[0, 0] * along_x + J[0, 2] * along_z),
        depth_share * (J[1, 1] * along_y + J[1, 2] * along_z),
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _measure_residuals(points, pixels, T, K, depth_share, size):  # type: ignore[no-untyped-def]
    """Fill the size of each residual in pixel errors, infinite behind the camera; return how many lie ahead."""
    J, residual, ahead = np.empty((2, 6)), np.empty(2), 0
    for k in range(len(points)):
        au, av = _linearise(points[k], pixels[k], T, K, depth_share, J, residual)
        if au != au:
            size[k] = np.inf
            continue
        ahead += 1
        shared = (au * residual[0] + av * residual[1]) ** 2 / (1 + au * au + av * av)
        size[k] = np.sqrt(max(residual[0] ** 2 + residual[1] ** 2 - shared, 0.0))
    return ahead


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _sum_normal_equations(points, pixels, T, K, depth_share, weight):  # type: ignore[no-untyped-def]
    """Return the weighted normal equations H [6, 6] and gradient [6] of all residuals, summed in their order."""
    J, residual, along = np.empty((2, 6)), np.empty(2), np.empty(6)
    H, gradient = np.zeros((6, 6)), np.zeros(6)
    for k in range(len(points)):
        w = weight[k]
        if not w > 0:
            continue
        au, av = _linearise(points[k], pixels[k], T, K, depth_share, J, residual)
        less = 1 / (1 + au * au + av * av)
        shared = less * (au * residual[0] + av * residual[1])
        for i in range(6):
            along[i] = au * J[0, i] + av * J[1, i]
            gradient[i] += w * (J[0, i] * residual[0] + J[1, i] * residual[1] - along[i] * shared)
        for i in range(6):
            for j in range(i + 1):
                H[i, j] += w * (J[0, i] * J[0, j] + J[1, i] * J[1, j] - less * along[i] * along[j])
    for i in range(6):
        for j in range(i):
            H[j, i] = H[i, j]
    return H, gradient
