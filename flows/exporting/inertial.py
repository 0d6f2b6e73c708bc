"""Velocity, specific force and turn rate of one point of the car body at the frames, from stored telemetry."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from flows.exporting.dataset import ExportedClip
from tasks.conventions import GRAVITY
from tasks.vehicle.parameters import Vehicle

FORWARD, LEFT, UP = np.eye(3)
Vectors = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class InertialMotion:
    """Motion of a point of the body at the frames, in the axes of the world.

    Parameters
    ----------
    attitude : body to world, F rotations; Rz Ry Rx of yaw, pitch (positive nose-down) and roll
    velocity : [F, 3] [m s-1]
    force : [F, 3] specific force, as an accelerometer feels it: at rest standard gravity up [m s-2]
    turn_rate : [F, 3] [rad s-1]
    """

    attitude: Rotation
    velocity: Vectors
    force: Vectors
    turn_rate: Vectors

    @property
    def level(self) -> Rotation:
        """The attitude's yaw alone: axes forward, left and up that stay parallel to the ground, F rotations."""
        return Rotation.from_euler("Z", self.attitude.as_euler("ZYX")[:, :1])


def compute_inertial_motion(
    clip: ExportedClip, vehicle: Vehicle, position: ArrayLike = (0, 0, 0)
) -> InertialMotion:
    """Return the motion of a point of the body.

    The rig's pose is P_0(s) (+) (z_s, theta) (paper, Eq. camera_pose): the route's frame runs along the road with the
    car's speed, and in it the body heaves, and pitches about the centre of gravity. The point's velocity and
    acceleration are those of this chain. Second derivatives of heave and pitch are differences of ticks; how the route
    turns, per metre, is the difference of the frames' poses. The route runs along its x axis.

    Parameters
    ----------
    clip : that was driven
    vehicle : that drove it
    position : of the point in the rig [m]
    """
    frames, ticks, t = clip.frames, clip.ticks, clip.frames["t_ns"] * 1e-9
    attitude = Rotation.from_matrix(clip.T_world_rig[:, :3, :3])
    pitching = Rotation.from_euler("Y", frames["pitch"][:, None])
    route = attitude * pitching.inv()
    heave_acceleration, pitch_acceleration = (
        np.gradient(ticks[rate], ticks["t_ns"] * 1e-9)[frames["tick"]]
        for rate in ("heave_rate", "pitch_rate")
    )

    centre = np.array([-vehicle.cg_to_front_axle, 0.0, vehicle.cg_height])
    arm = pitching.apply(np.asarray(position, np.float64) - centre)
    reach = centre + np.outer(frames["heave"], UP) + arm
    pitch_rate = np.outer(frames["pitch_rate"], LEFT)
    moved = np.outer(frames["heave_rate"], UP) + np.cross(pitch_rate, arm)
    lifted = (
        np.outer(heave_acceleration, UP)
        + np.cross(np.outer(pitch_acceleration, LEFT), arm)
        + np.cross(pitch_rate, np.cross(pitch_rate, arm))
    )

    along, turn = (
        np.outer(frames["speed"], FORWARD),
        _measure_turn_rate(route, frames["station"], frames["speed"]),
    )
    acceleration = (
        np.outer(frames["longitudinal_acceleration"], FORWARD)
        + np.cross(turn, along)
        + np.cross(np.gradient(turn, t, axis=0), reach)
        + np.cross(turn, np.cross(turn, reach))
        + 2 * np.cross(turn, moved)
        + lifted
    )
    return InertialMotion(
        attitude=attitude,
        velocity=route.apply(along + np.cross(turn, reach) + moved),
        force=route.apply(acceleration) + GRAVITY * UP,
        turn_rate=route.apply(turn + pitch_rate),
    )


def _measure_turn_rate(route: Rotation, station: NDArray[np.float64], speed: NDArray[np.float64]) -> Vectors:
    """Turn rate of the route's frame in its own axes [F, 3] [rad s-1]; 0 of a car that stands."""
    gone = np.diff(station)[:, None]
    turned = (route[:-1].inv() * route[1:]).as_rotvec()
    per_metre = np.divide(turned, gone, out=np.zeros_like(turned), where=gone > 0)
    at_frames = (per_metre[np.r_[0, : len(gone)]] + per_metre[np.r_[: len(gone), -1]]) / 2
    turn_rate: Vectors = at_frames * speed[:, None]
    return turn_rate
