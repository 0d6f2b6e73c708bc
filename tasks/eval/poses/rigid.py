"""Rigid motions: poses and their effect on pixels."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def skew_matrix(vector: Floats) -> Floats:
    """Return the cross-product matrix [3, 3] of a 3-vector, in the vector's unit."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def invert_pose(pose: Floats) -> Floats:
    """Return the inverse of a rigid pose [..., 4, 4]; NaN stays NaN."""
    rotation = np.swapaxes(pose[..., :3, :3], -1, -2)
    inverse = pose.copy()
    inverse[..., :3, :3] = rotation
    inverse[..., :3, 3] = -np.squeeze(rotation @ pose[..., :3, 3:], axis=-1)
    return inverse


def advance_pose(way: float, T_rig_camera: Floats) -> Floats:
    """Return ``T_earlier_later`` [4, 4] of a camera on a mount [m] whose rig goes `way` straight ahead [m]."""
    ahead = np.eye(4)
    ahead[0, 3] = way
    return invert_pose(T_rig_camera) @ ahead @ T_rig_camera


def adjoint_matrix(pose: Floats) -> Floats:
    """Return the [6, 6] matrix that takes twists in frame b to frame a, for ``pose = T_a_b``."""
    rotation = pose[:3, :3]
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = rotation
    matrix[:3, 3:] = skew_matrix(pose[:3, 3]) @ rotation
    return matrix


def viewing_rays(pixels: NDArray[np.number[Any]], K: Floats) -> Floats:
    """Return directions [N, 3] with z = 1 in the camera frame [1], through pixels [N, 2] [px]."""
    return np.column_stack([pixels.astype(np.float64), np.ones(len(pixels))]) @ np.linalg.inv(K).T


def project_points(points: Floats, K: Floats) -> Floats:
    """Return pixels [N, 2] [px] of camera-frame points [N, 3] [m]."""
    homogeneous = points @ K.T
    return homogeneous[:, :2] / homogeneous[:, 2:]


def projection_jacobian(points: Floats, K: Floats) -> Floats:
    """Return the derivative of pixels with respect to a small left twist of the camera frame's points.

    Parameters
    ----------
    points : float64 [N, 3] in the camera frame [m], z > 0
    K : float64 [3, 3] intrinsics [px]

    Returns
    -------
    float64 [N, 2, 6] [px/m] for the translation part, [px/rad] for the rotation part
    """
    x, y, z = points.T
    fx, fy, q = K[0, 0], K[1, 1], 1.0 / z
    J = np.zeros((len(points), 2, 6))
    J[:, 0, 0], J[:, 0, 2] = fx * q, -fx * x * q * q
    J[:, 0, 3], J[:, 0, 4], J[:, 0, 5] = -fx * x * y * q * q, fx * (1 + x * x * q * q), -fx * y * q
    J[:, 1, 1], J[:, 1, 2] = fy * q, -fy * y * q * q
    J[:, 1, 3], J[:, 1, 4], J[:, 1, 5] = -fy * (1 + y * y * q * q), fy * x * y * q * q, fy * x * q
    return J
