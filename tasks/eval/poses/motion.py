"""The result of every pose check, and the chain of frame-to-frame steps that leads to it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.eval.poses.rigid import Floats, adjoint_matrix, invert_pose

MAX_GAP = 3
"""Frames in a row that may fail before the track counts as lost: the next one is placed against the
last good frame, and after three frames at speed too little of that road is still in view."""

LEAST_PROGRESS = 1e-3
"""Distance below which a car counts as standing [m], or in steps where the scale is unknown."""


@dataclass(frozen=True, kw_only=True)
class RecoveredMotion:
    """Ego motion that a pose check recovered from the pixels, relative to frame 0.

    Every field is NaN in a failed frame. Lengths are NaN throughout where the method does not know the
    scale; `normalised_path` is then the only path.

    Parameters
    ----------
    method : name of the pose check
    T_rig0_rig : float64 [F, 4, 4] rig poses in the rig frame of frame 0 [m]
    pitch : float64 [F] nose-down positive, less that of frame 0 [rad]
    heave : float64 [F] rise of the rig origin [m]
    lateral : float64 [F] path offset to the left [m]
    progress : float64 [F] distance along the heading [m]
    normalised_path : float64 [F, 3] progress, lateral and heave over the clip's whole progress [1];
        NaN where the car stood
    pitch_std : float64 [F] standard uncertainty of `pitch`: that of independent steps, or that of errors which stay in
        a region of the picture, whichever is larger; a bias that all regions share is not in it [rad]
    progress_std : float64 [F] the same of `progress` [m]
    inliers : int64 [F] points or pixels that carried the estimate; 0 in frame 0
    failed : bool [F]
    failures : one sentence per failed frame
    blind : every failed frame shows too little to follow
    """

    method: str
    T_rig0_rig: Floats
    pitch: Floats
    heave: Floats
    lateral: Floats
    progress: Floats
    normalised_path: Floats
    pitch_std: Floats
    progress_std: Floats
    inliers: NDArray[np.int64]
    failed: NDArray[np.bool_]
    failures: tuple[str, ...]
    blind: bool = False

    @property
    def typical_pitch_std(self) -> float:
        """Median of `pitch_std` over the frames that have one; NaN where none has [rad]."""
        known = self.pitch_std[np.isfinite(self.pitch_std)]
        return float(np.median(known)) if len(known) else float("nan")

    @property
    def T_previous_rig(self) -> Floats:
        """[F, 4, 4] rig poses in the rig frame of the frame before [m]; the identity in frame 0."""
        before = np.concatenate([self.T_rig0_rig[:1], self.T_rig0_rig[:-1]])
        return invert_pose(before) @ self.T_rig0_rig


@dataclass(frozen=True, kw_only=True)
class FrameStep:
    """One frame placed against an earlier one, in camera frames.

    Parameters
    ----------
    T_earlier_later : float64 [4, 4] pose of the later camera in the earlier one [m]
    covariance : float64 [6, 6] of the left twist (translation, rotation) that errors add, if they are independent; it
        weighs the step against others [m, rad]
    inliers : points or pixels that carried the estimate
    failure : why there is no estimate; empty where there is one
    blind : there is none because the pictures show too little to follow
    region_twists : float64 [R, 6] the twist that the errors of each region of the picture add; None where errors are
        not known by region [m, rad]
    """

    T_earlier_later: Floats
    covariance: Floats
    inliers: int
    failure: str = ""
    blind: bool = False
    region_twists: Floats | None = None


def failed_step(reason: str, inliers: int, *, blind: bool = False) -> FrameStep:
    """Return a step that could not be made, with the reason as the end of a sentence; ``blind`` as in `FrameStep`."""
    return FrameStep(
        T_earlier_later=np.full((4, 4), np.nan),
        covariance=np.full((6, 6), np.nan),
        inliers=inliers,
        failure=reason,
        blind=blind,
    )


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A frame, the earlier frame it was placed against, and the step between them."""

    anchor: int
    step: FrameStep


def place_frames(count: int, place: Callable[[int, int, Floats], FrameStep]) -> list[Placement]:
    """Place each frame against the last good one, predicted at the velocity of the last step.

    Parameters
    ----------
    count : number of frames [1]
    place : function of the anchor's index, the frame's index and the predicted ``T_anchor_frame`` [m]

    Returns
    -------
    one placement for each of the frames 1 .. count - 1
    """
    placements: list[Placement] = []
    anchor, per_frame = 0, np.eye(4)
    for frame in range(1, count):
        gap = frame - anchor
        if gap > MAX_GAP:
            step = failed_step(
                f"the track was lost in frame {anchor + 1} and not found again",
                0,
                blind=placements[anchor].step.blind,
            )
        else:
            step = place(anchor, frame, np.linalg.matrix_power(per_frame, gap))
        placements.append(Placement(anchor=anchor, step=step))
        if not step.failure:
            if gap == 1:
                per_frame = step.T_earlier_later
            anchor = frame
    return placements


def integrate_motion(
    method: str,
    placements: Sequence[Placement],
    T_rig_camera: Floats,
    route_rotations: Floats | None = None,
    metric: bool = True,
) -> RecoveredMotion:
    """Chain the steps and resolve the chain into pitch, heave, lateral offset and progress.

    Without `route_rotations` the route is taken as level: progress is the distance along the recovered
    heading, lateral and heave are coordinates in frame 0. With them, all four are resolved along the route.

    What is wrong in one region of the picture lasts, as a verge or a front stays there for many steps. So errors are
    summed by region over the steps, and the regions, not the steps, count as independent (Liang and Zeger 1986,
    DOI 10.1093/biomet/73.1.13). A few regions show too little of their spread, so the uncertainty is never below that
    of independent steps.

    Parameters
    ----------
    method : name of the pose check
    placements : one for each frame after the first
    T_rig_camera : float64 [4, 4] camera mount [m]
    route_rotations : float64 [F, 3, 3] route-to-world rotations of the undisturbed rig at the frames [1]
    metric : whether the steps' lengths are metres; else they share one unknown unit
    """
    count = len(placements) + 1
    T = np.full((count, 4, 4), np.nan)
    T[0] = np.eye(4)
    cov = np.zeros((count, 6, 6))
    progress_var = np.zeros(count)
    by_region, way_by_region = [np.zeros((1, 6))] * count, [np.zeros(1)] * count
    path = np.full((count, 3), np.nan)
    path[0] = 0.0
    route = None if route_rotations is None else np.swapaxes(route_rotations[:1], -1, -2) @ route_rotations
    pitch, pitch_var = np.zeros(count), np.zeros(count)
    failures = []
    for k, placed in enumerate(placements, start=1):
        a, step = placed.anchor, placed.step
        if step.failure:
            failures.append(f"{method}: frame {k} has no pose: {step.failure}.")
        Ad = adjoint_matrix(T_rig_camera)
        step_pose = T_rig_camera @ step.T_earlier_later @ invert_pose(T_rig_camera)
        step_cov = Ad @ step.covariance @ Ad.T
        twists = np.zeros((1, 6)) if step.region_twists is None else step.region_twists @ Ad.T
        T[k] = T[a] @ step_pose
        carry = adjoint_matrix(T[a])
        cov[k] = cov[a] + carry @ step_cov @ carry.T
        by_region[k] = by_region[a] + twists @ carry.T

        frame_axes = np.eye(3) if route is None else route[k]
        x, y, z = frame_axes.T @ T[k, :3, 0]
        pitch[k] = np.arctan2(-z, np.hypot(x, y))
        by_rotation = frame_axes @ np.array([-y, x, 0.0])
        pitch_var[k] = max(
            by_rotation @ cov[k, 3:, 3:] @ by_rotation, np.square(by_region[k][:, 3:] @ by_rotation).sum()
        )

        moved = T[k, :3, 3] - T[a, :3, 3]
        if route is None:
            heading = _level_direction(T[a, :3, 0]) + _level_direction(T[k, :3, 0])
            along = heading @ moved / np.linalg.norm(heading)
            path[k] = path[a, 0] + along, T[k, 1, 3], T[k, 2, 3]
        else:
            middle = route[a] + route[k]
            path[k] = path[a] + (middle / np.linalg.norm(middle, axis=0)).T @ moved
        _, ty, tz = step_pose[:3, 3]
        by_twist = np.array([1.0, 0.0, 0.0, 0.0, tz, -ty])
        progress_var[k] = progress_var[a] + by_twist @ step_cov @ by_twist
        way_by_region[k] = way_by_region[a] + twists @ by_twist

    failed = np.isnan(pitch)
    progress_std = np.sqrt(np.maximum(progress_var, [np.square(way).sum() for way in way_by_region]))
    last = np.flatnonzero(~failed)[-1]
    moving = abs(path[last, 0]) > max(5 * progress_std[last], LEAST_PROGRESS)
    lengths = path if metric else np.full_like(path, np.nan)
    if not metric:
        T[:, :3, 3] = progress_std[:] = np.nan
    return RecoveredMotion(
        method=method,
        T_rig0_rig=T,
        pitch=pitch,
        progress=lengths[:, 0],
        lateral=lengths[:, 1],
        heave=lengths[:, 2],
        normalised_path=path / path[last, 0] if moving else np.full_like(path, np.nan),
        pitch_std=np.sqrt(pitch_var),
        progress_std=progress_std,
        inliers=np.array([0, *(p.step.inliers for p in placements)], dtype=np.int64),
        failed=failed,
        failures=tuple(failures),
        blind=bool(failures) and all(placed.step.blind for placed in placements if placed.step.failure),
    )


def _level_direction(direction: Floats) -> Floats:
    return np.array([direction[0], direction[1], 0.0]) / np.hypot(direction[0], direction[1])


def check_clip(
    frames: NDArray[np.uint8],
    K: Floats,
    T_rig_camera: Floats,
    depth: NDArray[np.float32] | None = None,
    unusable: NDArray[np.bool_] | None = None,
    route_rotations: Floats | None = None,
) -> None:
    """Refuse a clip that no pose check can read.

    Parameters
    ----------
    frames : uint8 [F, H, W, 3] sRGB pictures [1]
    K : float64 [3, 3] intrinsics [px]
    T_rig_camera : float64 [4, 4] camera mount [m]
    depth : float32 [F, H, W] camera z, NaN where there is nothing [m]
    unusable : bool [F, H, W] pixels to leave out [1]
    route_rotations : float64 [F, 3, 3] route-to-world rotations [1]

    Raises
    ------
    InputError
        One sentence for each array that has the wrong shape, type or values.
    """
    problems = []
    if frames.ndim != 4 or frames.shape[-1:] != (3,) or frames.dtype != np.uint8 or 0 in frames.shape:
        raise InputError(
            f"A clip's frames must be uint8 [F, H, W, 3] with at least one frame, got {frames.dtype} {frames.shape}."
        )
    for name, array in (("depth", depth), ("unusable", unusable)):
        if array is not None and array.shape != frames.shape[:3]:
            problems.append(f"{name} must match the frames' [F, H, W] {frames.shape[:3]}, got {array.shape}.")
    if K.shape != (3, 3) or not np.isfinite(K).all() or K[0, 0] <= 0 or K[1, 1] <= 0:
        problems.append(f"K must be a finite 3 x 3 matrix with positive focal lengths, got {K.tolist()}.")
    if T_rig_camera.shape != (4, 4) or not np.isfinite(T_rig_camera).all():
        problems.append(f"T_rig_camera must be a finite 4 x 4 pose, got {T_rig_camera.tolist()}.")
    if route_rotations is not None and route_rotations.shape != (len(frames), 3, 3):
        problems.append(f"route_rotations must be [{len(frames)}, 3, 3], got {route_rotations.shape}.")
    if problems:
        raise InputError(problems)
