"""Place a camera by points and their pixels."""

from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.motion import FrameStep, failed_step
from tasks.eval.poses.rigid import (
    Floats,
    adjoint_matrix,
    invert_pose,
)
from tasks.eval.poses.twists import pose_from_twist

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
    regions : number of the picture's regions whose errors count as independent [1]
    """

    min_inliers: int
    noise_floor: float
    noise_ceiling: float
    overlap: float = 1.0
    depth_error: float = 0.0
    regions: int = 0


def solve_pnp(
    points: Floats,
    pixels: Floats,
    T_start: Floats,
    K: Floats,
    limits: PnpLimits,
    region: NDArray[np.int64] | None = None,
) -> FrameStep:
    """Minimise the reprojection error by Gauss-Newton with Tukey's weights, without random draws.

    The scale is the median error, so that it shrinks from the first guess's error to the noise.

    Parameters
    ----------
    points : float64 [N, 3] in the earlier camera frame [m]
    pixels : float64 [N, 2] where the later camera sees them [px]
    T_start : float64 [4, 4] first guess of ``T_later_earlier`` [m]
    K : float64 [3, 3] intrinsics [px]
    limits : errors and numbers of points
    region : int64 [N] region of the picture that each pixel lies in; None where errors are not wanted by region [1]

    Returns
    -------
    The step ``T_earlier_later`` with its covariance, or the reason of the failure.
    """
    T, size, weight = T_start.copy(), np.empty(len(points)), np.empty(len(points))
    rules = limits.min_inliers, limits.noise_floor, limits.noise_ceiling, limits.depth_error
    ahead, scale, H = _settle_pose(points, pixels, T, K, rules, size, weight)
    if ahead < limits.min_inliers:
        return failed_step(f"{ahead} points lie ahead of the camera", ahead)
    if not scale > 0:
        return failed_step("the points do not fix the pose", 0)
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
    step = FrameStep(
        T_earlier_later=pose, covariance=carry @ (variance * np.linalg.inv(H)) @ carry.T, inliers=inliers
    )
    if region is None:
        return step
    by_pixel, by_depth = _list_gradients(points, pixels, T, K, limits.depth_error / scale)
    twists = _sum_by_region(by_pixel, scale * by_depth, weight, scale, H, region, limits.regions)
    return replace(step, region_twists=twists @ carry.T)


def _sum_by_region(
    by_pixel: Floats,
    by_depth: Floats,
    weight: Floats,
    scale: float,
    H: Floats,
    region: NDArray[np.int64],
    regions: int,
) -> Floats:
    """Return the twists that pixel errors of each region add to a pose, then those of its depth error, [2 regions, 6].

    Points of one region lie on the same grass or hedge, into which one sees as deep at each of them: they share the
    depth error. The curvature of Tukey's cost is less than H where pixel errors are large. As the pose is fitted to
    them, those of few regions seem too small; the share that 6 parameters take is given back.

    Source: Cameron and Miller 2015, DOI 10.3368/jhr.50.2.317, eqs. 11 and 12.
    """
    pixel_sums, depth_sums = np.zeros((regions, 6)), np.zeros((regions, 6))
    np.add.at(pixel_sums, region, weight[:, None] * by_pixel)
    np.add.at(depth_sums, region, weight[:, None] * by_depth)
    # the second derivative of the cost at a weight of (1 - s^2)^2 has 1 - s^2 in it
    bent = by_pixel * np.sqrt(weight)[:, None]
    curvature = H - 4 / (TUKEY * scale) ** 2 * bent.T @ bent
    if not np.linalg.eigvalsh(curvature)[0] > 0:
        curvature = H
    used = len(np.unique(region[weight > 0]))
    pixel_twists = np.sqrt(used / max(used - 6, 1)) * np.linalg.solve(curvature, pixel_sums.T)
    return np.concatenate([pixel_twists.T, np.linalg.solve(H, depth_sums.T).T])


def _settle_pose(
    points: Floats,
    pixels: Floats,
    T: Floats,
    K: Floats,
    rules: tuple[float, ...],
    size: Floats,
    weight: Floats,
) -> tuple[int, float, Floats]:
    """Move T [4, 4] to the pose of least error, and fill size and weight of each residual at its last step.

    Returns
    -------
    how many points lie ahead of the camera; the scale of the errors, 0 where the points do not fix the pose [px];
    and the normal equations H [6, 6]
    """
    min_inliers, noise_floor, noise_ceiling, depth_error = rules
    scale, H, twist = noise_ceiling, np.zeros((6, 6)), np.empty(6)
    ahead = 0
    for _ in range(40):
        # pixel errors are white but for the shift of a pixel by the error of the depth, in pixel errors
        depth_share = depth_error / scale
        ahead = _measure_residuals(points, pixels, T, K, depth_share, size)
        if ahead < min_inliers:
            break
        # the median length of a 2-D Gaussian error is 1.1774 of its standard deviation
        scale = max(float(np.median(size[size < np.inf])) / 1.1774, noise_floor)
        share = np.minimum(size, 1e9) / (TUKEY * scale)
        weight[:] = np.maximum(1 - share * share, 0.0) ** 2
        H, gradient = _sum_normal_equations(points, pixels, T, K, depth_share, weight)
        if not _solve_symmetric(H, gradient, twist):
            return ahead, 0.0, H
        _move_pose(pose_from_twist(twist), T)
        if np.abs(twist).max() < 1e-7:  # a thousandth of the error of the sharpest tracks
            break
    return ahead, scale, H


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _move_pose(by, T):  # type: ignore[no-untyped-def]
    """Put the pose ``by`` [4, 4] before T."""
    for column in range(4):
        x, y, z = T[0, column], T[1, column], T[2, column]
        for i in range(3):
            T[i, column] = by[i, 0] * x + by[i, 1] * y + by[i, 2] * z + by[i, 3] * T[3, column]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _solve_symmetric(H, right, x):  # type: ignore[no-untyped-def]
    """Fill x of H x = right by H = L D L'; return False where H is not positive definite.

    Its own few lines, and not a library's, so that its rounding does not depend on the processor.
    """
    n = len(right)
    L, D = np.eye(n), np.empty(n)
    for i in range(n):
        for j in range(i):
            rest = H[i, j]
            for k in range(j):
                rest -= L[i, k] * D[k] * L[j, k]
            L[i, j] = rest / D[j]
        D[i], x[i] = H[i, i], right[i]
        for k in range(i):
            D[i] -= L[i, k] ** 2 * D[k]
            x[i] -= L[i, k] * x[k]
        if not D[i] > 0:
            return False
    for i in range(n - 1, -1, -1):
        x[i] /= D[i]
        for k in range(i + 1, n):
            x[i] -= L[k, i] * x[k]
    return True


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
def _list_gradients(points, pixels, T, K, depth_share):  # type: ignore[no-untyped-def]
    """Return half the gradient of each squared residual, and how one standard error of its depth changes it, in pixel
    errors; float64 [N, 6] each, 0 behind the camera."""
    J, residual = np.empty((2, 6)), np.empty(2)
    by_pixel, by_depth = np.zeros((len(points), 6)), np.zeros((len(points), 6))
    for k in range(len(points)):
        au, av = _linearise(points[k], pixels[k], T, K, depth_share, J, residual)
        if au != au:
            continue
        less = 1 / (1 + au * au + av * av)
        shared = less * (au * residual[0] + av * residual[1])
        for i in range(6):
            along = au * J[0, i] + av * J[1, i]
            by_pixel[k, i] = J[0, i] * residual[0] + J[1, i] * residual[1] - along * shared
            by_depth[k, i] = less * along
    return by_pixel, by_depth


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
