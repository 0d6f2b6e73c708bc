"""Two-view geometry of tracked points with known intrinsics: rotation, direction, depth and length of a step."""

import cv2
import numpy as np

from tasks.eval.poses.motion import FrameStep
from tasks.eval.poses.rigid import (
    Floats,
    adjoint_matrix,
    invert_pose,
    projection_jacobian,
    skew_matrix,
)
from tasks.eval.poses.solve_pnp import TUKEY
from tasks.eval.poses.twists import pose_from_twist


def fit_rotation(rays: Floats, later_rays: Floats, focal: float) -> tuple[Floats, float]:
    """Return the rotation that explains most of the points' shift.

    Parameters
    ----------
    rays, later_rays : float64 [N, 3] the points in both cameras, z = 1 [1]
    focal : focal length [px]

    Returns
    -------
    rotation matrix ``R_later_earlier`` [3, 3], and the median shift that it leaves [px]
    """
    R = np.eye(3)
    for _ in range(10):
        turned = rays @ R.T
        turned /= turned[:, 2:]
        rest = (later_rays - turned)[:, :2] * focal
        size = np.linalg.norm(rest, axis=-1)
        weight = 1 / (1 + (size / max(float(np.median(size)), 0.01)) ** 2)
        J = projection_jacobian(turned, np.diag([focal, focal, 1.0]))[:, :, 3:]
        JW = J * weight[:, None, None]
        step = np.linalg.solve(np.einsum("nij,nik->jk", JW, J), np.einsum("nij,ni->j", JW, rest))
        R = pose_from_twist(np.concatenate([np.zeros(3), step]))[:3, :3] @ R
        if np.abs(step).max() < 1e-9:
            break
    return R, float(np.median(size))


def five_point_pose(
    pixels: Floats, later_pixels: Floats, K: Floats, distance: float
) -> tuple[Floats, Floats, int]:
    """Estimate rotation and direction by the five-point method with RANSAC (Nister 2004).

    Parameters
    ----------
    pixels, later_pixels : float64 [N, 2] the points in both pictures [px]
    K : float64 [3, 3] intrinsics [px]
    distance : largest distance from the epipolar line at which a point agrees [px]

    Returns
    -------
    ``R_later_earlier`` [3, 3], the direction of ``t_later_earlier`` [3], and the number of points that agree; 0
    where the points determine no pose
    """
    E, mask = cv2.findEssentialMat(pixels, later_pixels, K, cv2.RANSAC, 0.999, distance)
    if E is None or E.shape != (3, 3):
        return np.eye(3), np.zeros(3), 0
    agreeing = int(mask.sum())
    _, R, t, _ = cv2.recoverPose(E, pixels, later_pixels, K, mask=mask)
    return R, t.ravel(), agreeing


def refine_essential(
    R: Floats, t: Floats, rays: Floats, later_rays: Floats, focal: float, noise_floor: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Refine a pose by Gauss-Newton on Sampson's distance to the epipolar lines, with Tukey's weights.

    Parameters
    ----------
    R : float64 [3, 3] first guess of ``R_later_earlier`` [1]
    t : float64 [3] first guess of the direction of ``t_later_earlier`` [1]
    rays, later_rays : float64 [N, 3] the points in both cameras, z = 1 [1]
    focal : focal length [px]
    noise_floor : smallest assumed tracking error [px]

    Returns
    -------
    rotation, unit translation, their covariance [5, 5] in rotation [rad] and the two tangents of t [1],
    and the points' weights [N] [1]

    Source: Hartley and Zisserman, Multiple View Geometry, 2004, DOI 10.1017/CBO9780511811685, eq. 11.9.
    """
    for _ in range(30):
        y = rays @ R.T
        normal = np.cross(later_rays, t)
        lines, later_lines = normal @ R, np.cross(t, y)
        spread = np.sqrt((lines[:, :2] ** 2).sum(axis=1) + (later_lines[:, :2] ** 2).sum(axis=1))
        gain = focal / np.maximum(spread, 1e-12)
        residual = (normal * y).sum(axis=1) * gain
        size = np.abs(residual)
        scale = max(1.4826 * float(np.median(size)), noise_floor)
        weight = np.maximum(1 - (size / (TUKEY * scale)) ** 2, 0.0) ** 2
        tangents = _tangent_vectors(t)
        J = np.column_stack([np.cross(y, normal), np.cross(y, later_rays) @ tangents.T]) * gain[:, None]
        JW = J * weight[:, None]
        H = JW.T @ J
        step = -np.linalg.solve(H, JW.T @ residual)
        R = pose_from_twist(np.concatenate([np.zeros(3), step[:3]]))[:3, :3] @ R
        t = t + step[3:] @ tangents
        t /= np.linalg.norm(t)
        if np.abs(step).max() < 1e-9:
            break
    variance = max((weight * size**2).sum() / max(weight.sum() - 5, 1.0), noise_floor**2)
    return R, t, variance * np.linalg.inv(H), weight


def triangulate_points(
    rays: Floats, later_rays: Floats, R: Floats, t: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the depth of points by least squares, for a step of length one.

    Parameters
    ----------
    rays, later_rays : float64 [N, 3] the points in both cameras, z = 1 [1]
    R, t : ``R_later_earlier`` [3, 3] and the unit ``t_later_earlier`` [3] [1]

    Returns
    -------
    depth in the earlier and in the later camera [N], in steps; and the square of the parallax [N] [1], to
    which the relative precision of both is proportional
    """
    y = rays @ R.T
    across = np.cross(later_rays, y)
    parallax = (across**2).sum(axis=1)
    depth = -(np.cross(later_rays, t) * across).sum(axis=1) / np.maximum(parallax, 1e-18)
    return depth, depth * y[:, 2] + t[2], parallax


def step_length(
    known: Floats, known_precision: Floats, unit: Floats, unit_precision: Floats
) -> tuple[float, float]:
    """Return the length of a step: the ratio of the points' known depth to their depth for a step of length one.

    Parameters
    ----------
    known : float64 [N] depth in the chain's unit [1]
    unit : float64 [N] depth in steps [1]
    known_precision, unit_precision : float64 [N] relative precision, up to one factor; 0 if unknown [1]

    Returns
    -------
    the length in the chain's unit and its standard uncertainty [1]; NaN where no point has both depths
    """
    both = (known_precision > 0) & (unit_precision > 0)
    if not both.any():
        return float("nan"), float("nan")
    ratio = np.log(known[both] / unit[both])
    error = np.sqrt(1 / known_precision[both] + 1 / unit_precision[both])
    order = np.argsort(ratio, kind="stable")
    share = np.cumsum((1 / error)[order])
    middle = ratio[order][np.searchsorted(share, share[-1] / 2)]
    for _ in range(10):
        z = (ratio - middle) / error
        scale = max(1.4826 * float(np.median(np.abs(z))), 1e-12)
        weight = np.maximum(1 - (z / (TUKEY * scale)) ** 2, 0.0) ** 2 / error**2
        middle = (weight * ratio).sum() / weight.sum()
    return float(np.exp(middle)), float(np.exp(middle) * scale / np.sqrt(weight.sum()))


def scaled_step(
    R: Floats, t: Floats, covariance: Floats, length: float, length_std: float, inliers: int
) -> FrameStep:
    """Return the step of a given length, with its uncertainty.

    Parameters
    ----------
    R, t, covariance : as `refine_essential` returns them
    length, length_std : as `step_length` returns them
    inliers : points that carried the estimate [1]
    """
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, length * t
    # the left twist of T that a change of (rotation, tangents of t, length) makes
    by_parameter = np.zeros((6, 6))
    by_parameter[:3, :3], by_parameter[3:, :3] = length * skew_matrix(t), np.eye(3)
    by_parameter[:3, 3:5], by_parameter[:3, 5] = length * _tangent_vectors(t).T, t
    full = np.zeros((6, 6))
    full[:5, :5], full[5, 5] = covariance, length_std**2
    pose = invert_pose(T)
    carry = adjoint_matrix(pose) @ by_parameter
    return FrameStep(T_earlier_later=pose, covariance=carry @ full @ carry.T, inliers=inliers)


def _tangent_vectors(t: Floats) -> Floats:
    """Two unit vectors [2, 3] across a direction."""
    return np.linalg.svd(t[None])[2][1:]
