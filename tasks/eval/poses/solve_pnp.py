"""Place a camera by points and their pixels."""

from dataclasses import dataclass

import numpy as np

from tasks.eval.poses.motion import FrameStep, failed_step
from tasks.eval.poses.rigid import (
    Floats,
    adjoint_matrix,
    invert_pose,
    pose_from_twist,
    project_points,
    projection_jacobian,
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
    for _ in range(40):
        moved = points @ T[:3, :3].T + T[:3, 3]
        ahead = moved[:, 2] > 1e-3
        if ahead.sum() < limits.min_inliers:
            return failed_step(f"{int(ahead.sum())} points lie ahead of the camera", int(ahead.sum()))
        moved[~ahead, 2] = 1.0
        residual = pixels - project_points(moved, K)
        J = projection_jacobian(moved, K)
        # pixel errors are white but for a, the shift of a pixel by the error of the depth: their inverse covariance is
        # 1 - b a', b = a / (1 + a'a), in squared pixel errors
        a = np.einsum("nij,nj->ni", J[:, :, :3], moved - T[:3, 3]) * (limits.depth_error / scale)
        b = a / (1 + (a * a).sum(axis=1, keepdims=True))
        size = np.sqrt((residual**2).sum(axis=1) - (a * residual).sum(axis=1) * (b * residual).sum(axis=1))
        # the median length of a 2-D Gaussian error is 1.1774 of its standard deviation
        scale = max(float(np.median(size[ahead])) / 1.1774, limits.noise_floor)
        weight = np.where(ahead, np.maximum(1 - (size / (TUKEY * scale)) ** 2, 0.0) ** 2, 0.0)
        JW = (J - b[:, :, None] * (a[:, None] @ J)) * weight[:, None, None]
        H = JW.reshape(-1, 6).T @ J.reshape(-1, 6)
        try:
            twist = np.linalg.solve(H, JW.reshape(-1, 6).T @ residual.ravel())
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
    variance = limits.overlap * max((weight * size**2).sum() / (2 * weight.sum() - 6), limits.noise_floor**2)
    pose = invert_pose(T)
    carry = adjoint_matrix(pose)  # the error of an inverse pose is the carried error, sign aside
    return FrameStep(
        T_earlier_later=pose, covariance=carry @ (variance * np.linalg.inv(H)) @ carry.T, inliers=inliers
    )
