"""Pose check without depth: a chain of essential matrices, by corners and intrinsics alone.

It reads no data of a renderer, so it can judge any video; in return, the scale stays unknown.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.epipolar import (
    fit_rotation,
    five_point_pose,
    refine_essential,
    scaled_step,
    step_length,
    triangulate_points,
)
from tasks.eval.poses.key_frames import KeyFrame, give_depth, keep_sharper_depth, make_key_frame
from tasks.eval.poses.links import Link, link_placements
from tasks.eval.poses.motion import (
    MAX_GAP,
    FrameStep,
    Placement,
    RecoveredMotion,
    check_clip,
    failed_step,
    integrate_motion,
)
from tasks.eval.poses.point_pairs import PointPairs, Tracker, correct_turn, track_pairs
from tasks.eval.poses.rigid import Floats, invert_pose
from tasks.eval.poses.solve_pnp import PnpLimits, solve_pnp


@dataclass(frozen=True, kw_only=True)
class EssentialSettings:
    """Settings of the camera-only check.

    Parameters
    ----------
    cells_across : grid cells over the picture's width, which give one corner each [1]
    corner_quality : least corner strength as a share of the frame's 95th percentile [1]
    window : side of the tracked patches [px]
    track_levels : pyramid levels above full resolution where motion and depth are predicted [1]
    search_levels : the same where they are not: at the start, and after a failure [1]
    forward_backward : largest distance between a point and its track there and back [px]
    epipolar : RANSAC's largest distance from the epipolar line [px]
    min_parallax : median shift that no rotation explains, below which the camera counts as standing [px]
    min_points : fewest points that carry a pose [1]
    min_inlier_share : least share of tracked points that must agree on the pose [1]
    noise_floor, noise_ceiling : smallest assumed tracking error, and largest error of a valid track [px]
    least_contrast : standard deviation of a patch that noise alone may have, 8-bit [1]
    near_prediction : median shift of the corners up to which the predicted turn is kept [px]
    link_span : frames that the longer steps beside the chain span [1]
    link_stride : frames between their starts [1]
    """

    cells_across: int = 34
    corner_quality: float = 0.02
    window: int = 11
    track_levels: int = 1
    search_levels: int = 4
    forward_backward: float = 0.3
    epipolar: float = 0.7
    min_parallax: float = 0.5
    min_points: int = 40
    min_inlier_share: float = 0.3
    noise_floor: float = 0.01
    noise_ceiling: float = 2.0
    least_contrast: float = 2.0
    near_prediction: float = 1.5
    link_span: int = 8
    link_stride: int = 2


def recover_motion_essential(
    frames: NDArray[np.uint8],
    K: Floats,
    T_rig_camera: Floats,
    route_rotations: Floats | None = None,
    settings: EssentialSettings | None = None,
) -> RecoveredMotion:
    """Recover ego motion up to scale by frame-to-frame essential matrices (Nister 2004, DOI 10.1109/TPAMI.2004.17).

    The rotation and direction of each step come from the five-point method, refined on Sampson's error, and its
    length from the depth of the same corners in the step before. Steps over more frames constrain the chain further,
    and their depths, several times as sharp, keep its unit of length from creeping.
    While the car stands, frames are placed against the last one that moved. Path and heave are those of the camera:
    its offset from the rig's origin is in metres, which the chain's unknown unit cannot express.

    Parameters
    ----------
    frames : uint8 [F, H, W, 3] sRGB pictures [1]
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    T_rig_camera : float64 [4, 4] camera mount; only its rotation is used [m]
    route_rotations : float64 [F, 3, 3] route-to-world rotations of the undisturbed rig, for a route that
        is not level [1]
    settings : thresholds of the check

    Raises
    ------
    InputError
        If an array has the wrong shape, type or values.
    """
    check_clip(frames, K, T_rig_camera, route_rotations=route_rotations)
    chosen = settings or EssentialSettings()
    key = _make_key_frame(0, frames[0], chosen)
    placements: list[Placement] = []
    poses, passed, links = [np.eye(4)], dict[int, KeyFrame](), list[Link]()
    missed, velocity, T_key_last, last = 0, np.eye(4), np.eye(4), 0
    for k in range(1, len(frames)):
        anchor, later = key.index, _make_key_frame(k, frames[k], chosen)
        if missed > MAX_GAP:
            step, moved_on = failed_step(f"the track was lost after frame {last} and not found again", 0), key
        else:
            predicted = T_key_last @ np.linalg.matrix_power(velocity, k - last)
            step, moved_on = _place_frame(key, later, predicted, K, chosen)
        missed = missed + 1 if step.failure else 0
        placements.append(Placement(anchor=anchor, step=step))
        poses.append(poses[anchor] @ step.T_earlier_later)
        start = passed.pop(k - chosen.link_span, None)
        if start is not None and start.index % chosen.link_stride == 0 and not step.failure:
            between = invert_pose(poses[start.index]) @ poses[k]
            link, linked = _solve_step(start, later, between, chosen.track_levels, K, chosen, trusted=True)
            links.append(Link(earlier=start.index, later=k, step=link))
            if linked is not start and moved_on is not key:
                moved_on = keep_sharper_depth(moved_on, linked)
        if not step.failure:
            if k - last == 1:
                velocity = invert_pose(T_key_last) @ step.T_earlier_later
            T_key_last = step.T_earlier_later if moved_on is key else np.eye(4)
            key, last = moved_on, k
            if key.index == k:
                passed[k] = key
    turned = np.eye(4)
    turned[:3, :3] = T_rig_camera[:3, :3]
    return integrate_motion(
        "essential", link_placements(placements, links), turned, route_rotations, metric=False
    )


def _make_key_frame(index: int, rgb: NDArray[np.uint8], settings: EssentialSettings) -> KeyFrame:
    return make_key_frame(
        index, rgb, settings.cells_across, settings.corner_quality, settings.window, settings.least_contrast
    )


def _place_frame(
    key: KeyFrame, later: KeyFrame, predicted: Floats, K: Floats, settings: EssentialSettings
) -> tuple[FrameStep, KeyFrame]:
    """Return the step to a frame, and the frame against which the next one is placed."""
    fewest = min(len(key.corners), len(later.corners))
    if fewest < settings.min_points:
        return failed_step(
            f"{fewest} points to track, at least {settings.min_points} are needed", fewest
        ), key
    if (key.precision > 0).any():
        found = _solve_step(key, later, predicted, settings.track_levels, K, settings)
        if not found[0].failure:
            return found
    # without a prediction: find motion and depth from the pictures alone, then again from that first result
    blind = replace(key, inverse_depth=np.zeros_like(key.inverse_depth))
    step, rough = _solve_step(blind, later, np.eye(4), settings.search_levels, K, settings)
    if step.failure or rough is blind:
        return step, key
    return _solve_step(
        replace(key, inverse_depth=rough.inverse_depth),
        later,
        step.T_earlier_later,
        settings.track_levels,
        K,
        settings,
    )


def _solve_step(
    key: KeyFrame,
    later: KeyFrame,
    predicted: Floats,
    levels: int,
    K: Floats,
    settings: EssentialSettings,
    trusted: bool = False,
) -> tuple[FrameStep, KeyFrame]:
    """Solve the step by the tracked points; a trusted prediction replaces the RANSAC first guess."""
    focal = float(K[0, 0] + K[1, 1]) / 2
    pairs = _track_points(key, later, predicted, levels, K, settings, trusted)
    count = len(pairs.rays)
    if count < settings.min_points:
        return failed_step(f"{count} points tracked, at least {settings.min_points} are needed", count), key
    turn, parallax = fit_rotation(pairs.rays, pairs.later_rays, focal)
    if parallax < settings.min_parallax:
        return _standing_step(key, turn, pairs, K, settings), key

    if trusted:
        ahead = invert_pose(predicted)
        R, t, inliers = ahead[:3, :3], ahead[:3, 3] / np.linalg.norm(ahead[:3, 3]), count
    else:
        R, t, inliers = five_point_pose(pairs.pixels, pairs.later_pixels, K, settings.epipolar)
        if inliers == 0:
            return failed_step("the points fix no essential matrix", 0), key
    R, t, covariance, weight = refine_essential(
        R, t, pairs.rays, pairs.later_rays, focal, settings.noise_floor
    )
    inliers = min(inliers, int((weight > 0).sum()))
    if inliers < max(settings.min_points, settings.min_inlier_share * count):
        return failed_step(f"{inliers} of {count} tracked points agree on a pose", inliers), key

    depth, later_depth, precision = triangulate_points(pairs.rays, pairs.later_rays, R, t)
    precision = np.where((weight > 0) & (depth > 0) & (later_depth > 0), precision, 0.0)
    if (precision > 0).sum() < max(settings.min_points, settings.min_inlier_share * count):
        # the car pitches without moving: the baseline is too short for depth, so the known depth is used
        return _standing_step(key, turn, pairs, K, settings), key
    split = int(pairs.kept.sum())
    length, length_std = 1.0, 0.0
    if (key.precision > 0).any():
        before = key.depth[pairs.kept], key.precision[pairs.kept]
        length, length_std = step_length(*before, depth[:split], precision[:split])
        if np.isnan(length):
            return failed_step("no point links this step's length to the one before", inliers), key
    placed = give_depth(later, pairs, later_depth * length, precision, settings.cells_across)
    return scaled_step(R, t, covariance, length, length_std, inliers), placed


def _track_points(
    key: KeyFrame,
    later: KeyFrame,
    predicted: Floats,
    levels: int,
    K: Floats,
    settings: EssentialSettings,
    trusted: bool,
) -> PointPairs:
    tracker = Tracker(settings.window, levels, settings.forward_backward)
    if trusted:
        # over a longer step pictures differ in scale: they are evened as one camera sees the other
        pictures = (key.grey, key.corners), (later.grey, later.corners)
        evening = tracker._replace(least_contrast=settings.least_contrast)
        return track_pairs(*pictures, key.inverse_depth, predicted, K, evening)
    coarse = (key.coarse, key.corners), later.coarse
    rules = settings.min_points, settings.near_prediction
    turned = correct_turn(*coarse, key.inverse_depth, predicted, K, tracker, *rules)
    pictures = (key.evened, key.corners), (later.evened, later.corners)
    return track_pairs(*pictures, key.inverse_depth, turned, K, tracker)


def _standing_step(
    key: KeyFrame, turn: Floats, pairs: PointPairs, K: Floats, settings: EssentialSettings
) -> FrameStep:
    """Return the step to a frame taken near the key frame: by the depth of its corners, or else as a rotation."""
    T = np.eye(4)
    T[:3, :3] = turn
    split = int(pairs.kept.sum())
    known = key.precision[pairs.kept] > 0
    if known.sum() >= settings.min_points:
        points = pairs.rays[:split][known] * key.depth[pairs.kept][known, None]
        seen = pairs.later_pixels[:split][known]
        limits = PnpLimits(
            min_inliers=settings.min_points,
            noise_floor=settings.noise_floor,
            noise_ceiling=settings.noise_ceiling,
        )
        return solve_pnp(points, seen, T, K, limits)
    covariance = np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]) * (settings.min_parallax / K[0, 0]) ** 2
    return FrameStep(T_earlier_later=invert_pose(T), covariance=covariance, inliers=len(pairs.rays))
