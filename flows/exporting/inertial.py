"""Specific force and turn rate of an inertial unit in the rig, from stored telemetry."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flows.exporting.dataset import ExportedClip
from tasks.vehicle.parameters import Vehicle

STANDARD_GRAVITY = 9.80665
"""CGPM 1901 [m s-2]."""
Series = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class InertialMotion:
    """Motion of the rig at the frames, each [F] unless said otherwise.

    Parameters
    ----------
    roll, pitch, yaw : turn the rig into the world by Rz Ry Rx; pitch is positive nose-down [rad]
    vertical_speed : of the rig's origin, up [m s-1]
    force_forward, force_up : specific force along the road and up, at rest 0 and standard gravity [m s-2]
    force : [F, 3] the same in the axes of the pitched rig [m s-2]
    turn_rate : [F, 3] in the axes of the pitched rig [rad s-1]
    yaw_rate : about the world's up axis [rad s-1]
    """

    roll: Series
    pitch: Series
    yaw: Series
    vertical_speed: Series
    force_forward: Series
    force_up: Series
    force: Series
    turn_rate: Series
    yaw_rate: Series


def compute_inertial_motion(clip: ExportedClip, vehicle: Vehicle) -> InertialMotion:
    """Return the motion of the rig; heave's acceleration and the yaw rate are differences of ticks and of frames.

    Parameters
    ----------
    clip : that was driven
    vehicle : that drove it
    """
    frames = clip.frames
    yaw, pitch, roll = Rotation.from_matrix(clip.T_world_rig[:, :3, :3]).as_euler("ZYX").T
    cos, sin = np.cos(pitch), np.sin(pitch)
    # the rig lies in front of and below the centre of gravity, about which the body pitches
    lever = vehicle.cg_height * np.sin(frames["pitch"]) - vehicle.cg_to_front_axle * np.cos(frames["pitch"])
    lift = np.gradient(clip.ticks["heave_rate"], clip.ticks["t_ns"] * 1e-9)[frames["tick"]]
    forward, up = np.asarray(frames["longitudinal_acceleration"], np.float64), STANDARD_GRAVITY + lift
    yaw_rate = np.gradient(np.unwrap(yaw), frames["t_ns"] * 1e-9)
    return InertialMotion(
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        vertical_speed=frames["heave_rate"] + frames["pitch_rate"] * lever,
        force_forward=forward,
        force_up=up,
        force=np.stack((forward * cos - up * sin, np.zeros(len(yaw)), forward * sin + up * cos), axis=1),
        turn_rate=np.stack((-yaw_rate * sin, frames["pitch_rate"], yaw_rate * cos), axis=1),
        yaw_rate=yaw_rate,
    )
