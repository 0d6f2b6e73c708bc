"""The camera: intrinsics, mount, and where heave and pitch put it (paper, Eq. camera_pose)."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tasks.render.sensor import Sensor
from tasks.scene.route import Route


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A pinhole camera on the vehicle body.

    Parameters
    ----------
    name : catalogue name
    width, height : picture size [px]
    K : float64 [3, 3] intrinsics; pixel centres lie at +0.5 [px]
    T_rig_camera : float64 [4, 4] camera axes (x right, y down, z forward) to rig axes
    exposure_s : how long the shutter is open; sets the length of rain streaks [s]
    sensor : exposure and noise
    """

    name: str
    width: int
    height: int
    K: NDArray[np.float64]
    T_rig_camera: NDArray[np.float64]
    exposure_s: float
    sensor: Sensor = field(default_factory=Sensor)


def body_poses(
    route: Route,
    station: NDArray[np.float64],
    heave: NDArray[np.float64],
    pitch: NDArray[np.float64],
    *,
    cg_behind_front_axle: float,
    cg_height: float,
) -> NDArray[np.float64]:
    """P(t) = P_0(s) (+) (z_s, theta): the body pitched about its centre of gravity and lifted.

    Parameters
    ----------
    route : P_0
    station : [N] front-axle route coordinate [m]
    heave : [N] z_s, up positive [m]
    pitch : [N] theta, nose-down positive: a rotation about +y in ISO 8855 [rad]
    cg_behind_front_axle : l_f [m]
    cg_height : h_cg [m]

    Returns
    -------
    float64 [N, 4, 4] rig-to-world poses
    """
    cos, sin = np.cos(pitch), np.sin(pitch)
    motion = np.tile(np.eye(4), (len(station), 1, 1))
    motion[:, 0, 0], motion[:, 0, 2], motion[:, 2, 0], motion[:, 2, 2] = cos, sin, -sin, cos
    centre = np.array([-cg_behind_front_axle, 0.0, cg_height])
    motion[:, :3, 3] = centre - motion[:, :3, :3] @ centre
    motion[:, 2, 3] += heave
    return route.pose(station) @ motion


def viewmat(T_world_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """World-to-camera matrix [4, 4] of a camera pose [4, 4]."""
    view = np.eye(4)
    view[:3, :3] = T_world_camera[:3, :3].T
    view[:3, 3] = -view[:3, :3] @ T_world_camera[:3, 3]
    return view
