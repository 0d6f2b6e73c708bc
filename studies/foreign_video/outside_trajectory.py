"""A camera trajectory recovered by another tool, as a pose check of its own."""

from dataclasses import replace

import numpy as np

from tasks.errors import InputError
from tasks.eval.poses.motion import FrameStep, Placement, RecoveredMotion, failed_step, integrate_motion
from tasks.eval.poses.rigid import Floats, invert_pose


def motion_from_trajectory(
    method: str,
    frame_times: Floats,
    pose_times: Floats,
    T_world_camera: Floats,
    T_rig_camera: Floats,
    *,
    metric: bool,
    route_rotations: Floats | None = None,
) -> RecoveredMotion:
    """Resolve a trajectory into pitch, progress, lateral path and heave, as the pose checks do.

    Every frame takes the nearest pose; a frame without a pose within half a frame has failed. A trajectory does not
    state its uncertainty, so `pitch_std` and `progress_std` are NaN.

    Parameters
    ----------
    method : name of the tool that made it
    frame_times : float64 [F] rising [s]
    pose_times : float64 [N] rising, on the same clock [s]
    T_world_camera : float64 [N, 4, 4] camera-to-world poses in any world frame, camera axes as OpenCV's [m]
    T_rig_camera : float64 [4, 4] camera mount [m]
    metric : whether the lengths are metres; else they share one unknown unit, and so no lever arm is known
    route_rotations : float64 [F, 3, 3] route-to-world rotations of the undisturbed rig [1]

    Raises
    ------
    InputError
        If the first frame has no pose, or no later one has.
    """
    nearest = np.abs(frame_times[:, None] - pose_times).argmin(axis=1)
    slack = 0.5 * float(np.median(np.diff(frame_times)))
    seen = np.abs(frame_times - pose_times[nearest]) <= slack
    if not seen[0] or not seen[1:].any():
        raise InputError(
            f"A trajectory must have a pose at the first frame ({frame_times[0]:g} s) and at another, within"
            f" {slack:.3g} s; its poses lie from {pose_times[0]:g} to {pose_times[-1]:g} s."
        )
    mount = T_rig_camera.copy()
    if not metric:
        mount[:3, 3] = 0.0
    placements, anchor = [], 0
    for k in range(1, len(frame_times)):
        step = failed_step(f"the trajectory has no pose within {slack:.3g} s", 0)
        if seen[k]:
            moved = invert_pose(T_world_camera[nearest[anchor]]) @ T_world_camera[nearest[k]]
            step = FrameStep(T_earlier_later=moved, covariance=np.zeros((6, 6)), inliers=0)
        placements.append(Placement(anchor=anchor, step=step))
        anchor = k if seen[k] else anchor
    motion = integrate_motion(method, placements, mount, route_rotations, metric)
    unknown = np.full(len(frame_times), np.nan)
    return replace(motion, pitch_std=unknown, progress_std=unknown)
