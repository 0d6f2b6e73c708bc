"""The pose checks by name, all on one preparation of a clip: a further check is one more row of `POSE_CHECKS`."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.essential import recover_motion_essential
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.photometric import recover_motion_photometric
from tasks.eval.poses.pnp import recover_motion_pnp
from tasks.eval.poses.rigid import Floats
from tasks.eval.poses.rolling_shutter import recover_and_correct_rolling_shutter
from tasks.eval.poses.unusable import glossy_pixels, unusable_pixels


@dataclass(frozen=True, kw_only=True)
class JudgeCamera:
    """A camera as the judges know it.

    Parameters
    ----------
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    T_rig_camera : float64 [4, 4] camera mount [m]
    distortion : float64 [5] as `tasks.eval.poses.undistort.undistort_frames` takes it [1]; None for a pinhole
    line_delay_s : from one row's exposure to the next one's; 0 for one shutter for all rows [s]
    """

    K: Floats
    T_rig_camera: Floats
    distortion: Floats | None
    line_delay_s: float


@dataclass(frozen=True, kw_only=True)
class CheckedClip:
    """A clip as the pose checks take it.

    Parameters
    ----------
    camera : intrinsics and mount
    frames : uint8 [F, H, W, 3] pinhole pictures as they were read out, sRGB [1]
    rgb, depth, class_id : the same with one shutter for all rows: uint8 [F, H, W, 3] [1], float32 [F, H, W] camera z
        [m] and uint8 [F, H, W] semantic classes [1]
    unusable : bool [F, H, W] pixels that no check may read [1]
    route_rotations : float64 [F, 3, 3] route-to-world rotations of the undisturbed rig [1]
    """

    camera: JudgeCamera
    frames: NDArray[np.uint8]
    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    class_id: NDArray[np.uint8]
    unusable: NDArray[np.bool_]
    route_rotations: Floats


def prepare_clip(
    buffers: Mapping[str, NDArray[Any]],
    camera: JudgeCamera,
    *,
    frame_interval_s: float,
    film_depth_mm: float,
    route_rotations: Floats,
) -> CheckedClip:
    """Take the rolling shutter out of a clip's pinhole pictures and mark the pixels that no check may read.

    Parameters
    ----------
    buffers : ``rgb``, ``depth`` and ``class`` without distortion, from `tasks.eval.poses.undistort.undistort_frames`
    camera : the camera that took them
    frame_interval_s : from frame to frame [s]
    film_depth_mm : water on the road [mm]
    route_rotations : as in `CheckedClip`
    """
    still = recover_and_correct_rolling_shutter(
        buffers,
        camera.K,
        camera.T_rig_camera,
        distortion=camera.distortion,
        line_delay_s=camera.line_delay_s,
        frame_interval_s=frame_interval_s,
        film_depth_mm=film_depth_mm,
        route_rotations=route_rotations,
    )
    return CheckedClip(
        camera=camera,
        frames=buffers["rgb"],
        rgb=still["rgb"],
        depth=still["depth"],
        class_id=still["class"],
        unusable=unusable_pixels(still["class"], film_depth_mm),
        route_rotations=route_rotations,
    )


def check_by_pixels(clip: CheckedClip) -> RecoveredMotion:
    """Return the motion by `recover_motion_photometric`, which does not read glossy pixels either."""
    K, T_rig_camera = clip.camera.K, clip.camera.T_rig_camera
    unusable = clip.unusable | glossy_pixels(clip.class_id)
    return recover_motion_photometric(clip.rgb, clip.depth, K, T_rig_camera, unusable, clip.route_rotations)


def check_by_points(clip: CheckedClip) -> RecoveredMotion:
    """Return the motion by `recover_motion_pnp`."""
    K, T_rig_camera = clip.camera.K, clip.camera.T_rig_camera
    return recover_motion_pnp(clip.rgb, clip.depth, K, T_rig_camera, clip.unusable, clip.route_rotations)


def check_without_depth(clip: CheckedClip) -> RecoveredMotion:
    """Return the motion by `recover_motion_essential` from the pictures as they were read out."""
    K, T_rig_camera = clip.camera.K, clip.camera.T_rig_camera
    return recover_motion_essential(clip.frames, K, T_rig_camera, clip.route_rotations)


POSE_CHECKS: dict[str, Callable[[CheckedClip], RecoveredMotion]] = {
    "photometric": check_by_pixels,
    "pnp": check_by_points,
    "essential": check_without_depth,
}
"""Every pose check by its name, in the order of tables and pages."""

GATE_CHECK = "pnp"
"""The check that each clip must pass when it is made; the limits of the gate file hold for it."""
