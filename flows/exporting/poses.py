"""Poses in the forms that other formats write them."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


def compute_quaternions(poses: NDArray[np.float64], *, scalar_first: bool) -> NDArray[np.float64]:
    """Return the rotations of poses as unit quaternions with w not negative.

    Parameters
    ----------
    poses : [N, 4, 4]
    scalar_first : w, x, y, z; else x, y, z, w

    Returns
    -------
    float64 [N, 4] [1]
    """
    turns = Rotation.from_matrix(poses[:, :3, :3])
    return np.asarray(turns.as_quat(canonical=True, scalar_first=scalar_first), np.float64)
