"""Poses in the forms that other formats write them."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


def compute_quaternions_xyzw(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations of poses as unit quaternions x, y, z, w with w not negative.

    Parameters
    ----------
    poses : [N, 4, 4]

    Returns
    -------
    float64 [N, 4] [1]
    """
    return np.asarray(Rotation.from_matrix(poses[:, :3, :3]).as_quat(canonical=True), np.float64)


def compute_quaternions_wxyz(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations of poses as unit quaternions w, x, y, z with w not negative.

    Parameters
    ----------
    poses : [N, 4, 4]

    Returns
    -------
    float64 [N, 4] [1]
    """
    return np.roll(compute_quaternions_xyzw(poses), 1, axis=1)
