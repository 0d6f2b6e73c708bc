"""From twists to poses: the exponential map of SE(3), compiled.

In a file of its own, as numba takes longer to import than what else readers of poses need.
"""

import numba
import numpy as np

from tasks.eval.poses.rigid import Floats


@numba.njit(cache=True, nogil=True)
def pose_from_twist(twist: Floats) -> Floats:
    """Return the pose of a twist: the exponential map of SE(3).

    Parameters
    ----------
    twist : float64 [6] translation part [m], then rotation vector [rad]

    Returns
    -------
    float64 [4, 4] pose

    Source: Barfoot, State Estimation for Robotics, 2017, DOI 10.1017/9781316671528, section 7.1.
    """
    rho, phi = twist[:3], twist[3:]
    square = phi[0] ** 2 + phi[1] ** 2 + phi[2] ** 2
    angle = np.sqrt(square)
    # below 1e-4 rad the next term of each series is under double precision
    if angle < 1e-4:
        a, b, c = 1.0 - square / 6, 0.5 - square / 24, 1 / 6 - square / 120
    else:
        a, b, c = (
            np.sin(angle) / angle,
            (1 - np.cos(angle)) / square,
            (angle - np.sin(angle)) / (square * angle),
        )
    pose = np.eye(4)
    along = phi[0] * rho[0] + phi[1] * rho[1] + phi[2] * rho[2]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turned = phi[j] * rho[k] - phi[k] * rho[j]
        # phi x (phi x rho) = phi (phi . rho) - rho phi^2
        pose[i, 3] = rho[i] + b * turned + c * (phi[i] * along - rho[i] * square)
        pose[i, i] -= b * (phi[j] ** 2 + phi[k] ** 2)
        pose[i, j] += b * phi[i] * phi[j] - a * phi[k]
        pose[i, k] += b * phi[i] * phi[k] + a * phi[j]
    return pose
