"""The camera: intrinsics, mount, and its pose under heave and pitch (paper, Eq. camera_pose)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tasks.render.lens import Lens
from tasks.render.sensor import Sensor
from tasks.scene.route import Route

RigAt = Callable[[int, NDArray[np.float64]], NDArray[np.float64]]
"""Rig poses [N, 4, 4] [m] about a frame, at times [N] from its own [s]."""

PIXEL_CENTRE = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]])
"""The renderer puts pixel centres at +0.5, OpenCV and the judges at whole numbers [px]."""


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A camera on the vehicle body: a pinhole with one shutter for all rows, unless more is asked for.

    Parameters
    ----------
    name : catalogue name
    width, height : picture size [px]
    K : float64 [3, 3] intrinsics; pixel centres lie at +0.5 [px]
    T_rig_camera : float64 [4, 4] camera axes (x right, y down, z forward) to rig axes
    exposure_s : how long a row is exposed; sets the length of rain streaks and of motion blur [s]
    sensor : exposure and noise
    lens : distortion; None for a pinhole
    line_delay_s : from one row's exposure to the next one's, top to bottom; 0 for one shutter for all rows. A
        frame's time is that of the middle of the picture, in the middle of its exposure [s]
    motion_blur : what moves in the picture is averaged over the exposure; streaks always are
    spread : bounds of what each clip draws for itself: ``focal_length`` [px], ``height_above_road`` [m], ``pitch_down``
        and ``roll_right`` [deg]
    """

    name: str
    width: int
    height: int
    K: NDArray[np.float64]
    T_rig_camera: NDArray[np.float64]
    exposure_s: float
    sensor: Sensor = field(default_factory=Sensor)
    lens: Lens | None = None
    line_delay_s: float = 0.0
    motion_blur: bool = False
    spread: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def varies(self) -> bool:
        """Whether the clips of a dataset draw their own focal length or mount."""
        return bool(self.spread)

    @property
    def plain(self) -> bool:
        """Whether the camera is a pinhole with one pose for all rows, so that the drawn picture needs no resampling."""
        return self.lens is None and not self.moves

    @property
    def moves(self) -> bool:
        """Whether a frame is exposed at more than one pose."""
        return self.line_delay_s != 0 or self.motion_blur

    @property
    def distortion(self) -> NDArray[np.float64] | None:
        """k1, k2, p1, p2, k3 as OpenCV takes them, float64 [5] [1]; None for a pinhole."""
        return None if self.lens is None else self.lens.coefficients

    @property
    def row_times(self) -> NDArray[np.float64]:
        """Beginning, middle and end of each row's exposure from the frame's time, float64 [3, height] [s]."""
        middle = (np.arange(self.height) + 0.5 - self.height / 2) * self.line_delay_s
        half = 0.5 * self.exposure_s if self.motion_blur else 0.0
        return np.stack((middle - half, middle, middle + half))


def measure_mount(camera: Camera) -> dict[str, float]:
    """Return focal length, height above the road, pitch nose-down and roll to the right of a camera, by column.

    Parameters
    ----------
    camera : on the vehicle
    """
    right, down, ahead = camera.T_rig_camera[:3, :3].T
    return {
        "focal_length_px": float(camera.K[0, 0]),
        "camera_height": float(camera.T_rig_camera[2, 3]),
        "camera_pitch": float(np.arcsin(0.0 - ahead[2])),
        "camera_roll": float(np.arctan2(0.0 - right[2], -down[2])),
    }


def body_poses(
    route: Route,
    station: NDArray[np.float64],
    heave: NDArray[np.float64],
    pitch: NDArray[np.float64],
    *,
    cg_behind_front_axle: float,
    cg_height: float,
) -> NDArray[np.float64]:
    """Return P(t) = P_0(s) (+) (z_s, theta): the body pitched about its centre of gravity and lifted.

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


def continuous_rig(
    route: Route,
    time: NDArray[np.float64],
    station: NDArray[np.float64],
    heave: NDArray[np.float64],
    pitch: NDArray[np.float64],
    frame_time: NDArray[np.float64],
    *,
    cg_behind_front_axle: float,
    cg_height: float,
) -> RigAt:
    """Return a function that gives rig poses at any time of a clip, for rows and exposures between its ticks.

    Before the first tick and after the last the motion is extrapolated by a point reflection in the clip's end pose,
    T(-t) = T(0) T(t)^-1 T(0), which is exact for a steady motion.

    Parameters
    ----------
    route, cg_behind_front_axle, cg_height : as `body_poses` takes them
    time : [N] of the ticks, rising [s]
    station, heave, pitch : [N] at the ticks, as `body_poses` takes them; linear in between [m, m, rad]
    frame_time : [F] of the frames [s]

    Returns
    -------
    Callable
        Frame number and times relative to the frame's own time, to poses.
    """

    def pose_within_clip(t: NDArray[np.float64]) -> NDArray[np.float64]:
        at = (np.interp(t, time, column) for column in (station, heave, pitch))
        return body_poses(route, *at, cg_behind_front_axle=cg_behind_front_axle, cg_height=cg_height)

    def rig_at(frame: int, since: NDArray[np.float64]) -> NDArray[np.float64]:
        t = frame_time[frame] + since
        end = np.clip(t, time[0], time[-1])
        beyond = t != end
        if not beyond.any():
            return pose_within_clip(t)
        turn = pose_within_clip(end)
        return np.where(
            beyond[:, None, None], turn @ np.linalg.inv(pose_within_clip(2 * end - t)) @ turn, turn
        )

    return rig_at


def world_to_camera(T_world_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the world-to-camera matrix [4, 4] of a camera pose [4, 4]."""
    view = np.eye(4)
    view[:3, :3] = T_world_camera[:3, :3].T
    view[:3, 3] = -view[:3, :3] @ T_world_camera[:3, 3]
    return view
