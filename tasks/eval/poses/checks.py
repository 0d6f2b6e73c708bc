"""The pose checks by name, all on one preparation of a clip: a further check is one more row of `POSE_CHECKS`."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.eval.poses.essential import recover_motion_essential
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.photometric import recover_motion_photometric
from tasks.eval.poses.pnp import recover_motion_pnp
from tasks.eval.poses.rigid import Floats, invert_pose

STEPS = 3
"""Iterations that find each pixel's source; after them a row's error is below a hundredth of its motion [1]."""


@dataclass(frozen=True, kw_only=True)
class JudgeCamera:
    """A camera as the judges know it.

    Parameters
    ----------
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    T_rig_camera : float64 [4, 4] camera mount [m]
    distortion : float64 [5] as `tasks.eval.poses.resampling.undistort_frames` takes it [1]; None for a pinhole
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
    buffers : ``rgb``, ``depth`` and ``class`` without distortion, from `tasks.eval.poses.resampling.undistort_frames`
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


def recover_and_correct_rolling_shutter(
    buffers: Mapping[str, NDArray[Any]],
    K: Floats,
    T_rig_camera: Floats,
    *,
    distortion: Floats | None,
    line_delay_s: float,
    frame_interval_s: float,
    film_depth_mm: float,
    route_rotations: Floats | None,
) -> dict[str, NDArray[Any]]:
    """Correct the rolling shutter by the motion that `recover_motion_pnp` finds in the frames as they were read out.

    The motion of one row's delay is small, so the error of that motion is negligible.

    Parameters
    ----------
    buffers : undistorted ``rgb``, ``depth`` and ``class``, as `correct_rolling_shutter` takes them
    K, T_rig_camera, frame_interval_s : as `correct_rolling_shutter` takes them
    distortion, line_delay_s : as `row_times` takes them; the buffers come back as they are where the delay is 0
    film_depth_mm : water on the road, as `unusable_pixels` takes it [mm]
    route_rotations : as `recover_motion_pnp` takes them
    """
    if line_delay_s == 0:
        return dict(buffers)
    hidden = unusable_pixels(buffers["class"], film_depth_mm)
    motion = recover_motion_pnp(buffers["rgb"], buffers["depth"], K, T_rig_camera, hidden, route_rotations)
    height, width = buffers["depth"].shape[1:]
    times = row_times(K, (height, width), distortion, line_delay_s)
    return correct_rolling_shutter(buffers, K, times, motion, T_rig_camera, frame_interval_s)


def row_times(K: Floats, shape: tuple[int, int], distortion: Floats | None, line_delay_s: float) -> Floats:
    """Return the exposure time of the row that each pixel of an undistorted picture came from, [H, W] [s].

    Times count from the middle row.

    Parameters
    ----------
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    shape : height and width [px]
    distortion : as `tasks.eval.poses.resampling.undistort_frames` takes it
    line_delay_s : from one row's exposure to the next one's [s]
    """
    height, width = shape
    bends = np.zeros(5) if distortion is None else distortion
    _, row = cv2.initUndistortRectifyMap(K, bends, None, K, (width, height), cv2.CV_32FC1)
    return (row.astype(np.float64) - (height - 1) / 2) * line_delay_s


def correct_rolling_shutter(
    buffers: Mapping[str, NDArray[Any]],
    K: Floats,
    times: Floats,
    motion: RecoveredMotion,
    T_rig_camera: Floats,
    frame_interval_s: float,
) -> dict[str, NDArray[Any]]:
    """Return ``rgb``, ``depth`` and ``class`` of every frame at its middle row's pose; a frame without motion stays.

    Parameters
    ----------
    buffers : ``rgb`` uint8 [F, H, W, 3], ``depth`` float32 [F, H, W] z at each row's own time [m], ``class``
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    times : float64 [H, W] from `row_times` [s]
    motion : of the frames as they are, from their pixels
    T_rig_camera : float64 [4, 4] camera mount [m]
    frame_interval_s : from frame to frame [s]
    """
    poses = motion.T_rig0_rig @ T_rig_camera
    last = len(poses) - 1
    frames: dict[str, list[NDArray[Any]]] = {name: [] for name in buffers}
    for k in range(len(poses)):
        before, after = max(k - 1, 0), min(k + 1, last)
        step = invert_pose(poses[before]) @ poses[after]
        rate = (step[:3, :4] - np.eye(4)[:3]) / ((after - before) * frame_interval_s)
        picture = {name: values[k] for name, values in buffers.items()}
        if np.isfinite(rate).all():
            picture = _correct_frame(picture, K, times, rate)
        for name, values in picture.items():
            frames[name].append(values)
    return {name: np.stack(values) for name, values in frames.items()}


def _correct_frame(
    picture: Mapping[str, NDArray[Any]], K: Floats, times: Floats, rate: Floats
) -> dict[str, NDArray[Any]]:
    height, width = times.shape
    u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    depth = picture["depth"]
    inverse = np.divide(1, depth, out=np.zeros((height, width), np.float32), where=np.isfinite(depth))
    from_u, from_v = u.copy(), v.copy()
    for _ in range(STEPS):
        at = from_u.astype(np.float32), from_v.astype(np.float32)
        w = cv2.remap(inverse, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        t = cv2.remap(times, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        ray = np.stack(((from_u - K[0, 2]) / K[0, 0], (from_v - K[1, 2]) / K[1, 1], np.ones_like(u)), axis=-1)
        seen = ray + t[..., None] * (ray @ rate[:, :3].T + w[..., None] * rate[:, 3])
        from_u += u - (K[0, 0] * seen[..., 0] / seen[..., 2] + K[0, 2])
        from_v += v - (K[1, 1] * seen[..., 1] / seen[..., 2] + K[1, 2])
    at = from_u.astype(np.float32), from_v.astype(np.float32)
    scale = np.divide(seen[..., 2], w, out=np.full(w.shape, np.nan), where=w > 0)
    return {
        "rgb": cv2.remap(picture["rgb"], *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
        "depth": scale.astype(np.float32),
        "class": cv2.remap(picture["class"], *at, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE),
    }


def unusable_pixels(class_id: NDArray[np.uint8], film_depth_mm: float) -> NDArray[np.bool_]:
    """Return the pixels that no check may read.

    They are the sky, which has no depth; crowns of trees, which are partly transparent and have no single depth; and a
    wet road, which mirrors the street, so that its image moves as the mirrored object does.

    Parameters
    ----------
    class_id : uint8 [F, H, W] semantic classes [1]
    film_depth_mm : water on the road [mm]

    Returns
    -------
    bool [F, H, W]
    """
    hidden = np.zeros(256, dtype=np.bool_)  # a table of all bytes: a tenth of the time of `np.isin`
    hidden[[SemanticClass.SKY, SemanticClass.VEGETATION]] = True
    if film_depth_mm > 0:
        hidden[list(ROAD_CLASSES)] = True
    return hidden[class_id]


def hide_moving(depth: NDArray[np.floating], instances: NDArray[np.uint16]) -> NDArray[np.floating]:
    """Return the depth without that of road users, which move as no camera does; no check reads a pixel without depth.

    Parameters
    ----------
    depth : [F, H, W] camera z [m]
    instances : uint16 [F, H, W] number of the road user that a pixel shows, as a dataset has it; 0 for none
    """
    return np.where(instances > 0, np.nan, depth).astype(depth.dtype)


def glossy_pixels(class_id: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return the pixels of vehicles, whose paint and panes mirror the street in soft gradients, and which may move.

    A check by every grey level takes such gradients for motion. Sharp corners belong to the body itself.

    Parameters
    ----------
    class_id : uint8 [F, H, W] semantic classes [1]

    Returns
    -------
    bool [F, H, W]
    """
    return class_id == SemanticClass.VEHICLE
