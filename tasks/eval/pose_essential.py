"""Pose check without depth: a chain of essential matrices, by corners and intrinsics alone.

It never sees a renderer's data, so it can judge any video; the price is an unknown scale.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.eval.corners import cell_size, corner_strength, grid_corners, track_corners
from tasks.eval.epipolar import fit_rotation, refine_essential, scaled_step, step_length, triangulate
from tasks.eval.motion import (
    MAX_GAP,
    FrameStep,
    Placement,
    RecoveredMotion,
    check_clip,
    failed_step,
    integrate_motion,
)
from tasks.eval.rigid import Floats, invert_pose, viewing_rays
from tasks.eval.solve_pnp import solve_pnp
from tasks.eval.warp import bilinear_taps, view_from, warp_map


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
    min_parallax : median shift that no turn explains, below which two frames share one place [px]
    min_points : fewest points that carry a pose [1]
    min_inlier_share : least share of tracked points that must agree on the pose [1]
    noise_floor, noise_ceiling : smallest tracking error believed, and largest that is still a track [px]
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


@dataclass(frozen=True, kw_only=True)
class _Key:
    """The frame that later ones are placed against, and what is known of its depth, in the chain's unit."""

    index: int
    grey: NDArray[np.uint8]
    corners: NDArray[np.float32]
    depth: Floats  # [N]
    precision: Floats  # [N], relative, up to a factor; 0 where the depth is unknown
    inverse_depth: NDArray[np.float32]  # [H, W], a guess for every pixel


@dataclass(frozen=True, kw_only=True)
class _Pairs:
    """Points seen in two frames: first the earlier frame's corners, then the later frame's."""

    rays: Floats
    later_rays: Floats
    pixels: Floats
    later_pixels: Floats
    kept: NDArray[np.bool_]
    later_kept: NDArray[np.bool_]


def recover_motion_essential(
    frames: NDArray[np.uint8],
    K: Floats,
    T_rig_camera: Floats,
    route_rotations: Floats | None = None,
    settings: EssentialSettings | None = None,
) -> RecoveredMotion:
    """Ego motion up to scale by frame-to-frame essential matrices (Nister 2004, DOI 10.1109/TPAMI.2004.17).

    Each step's turn and direction come from the five-point method, refined on Sampson's error; its length
    from the depth that the step before gave the same corners. While the car stands, frames are placed
    against the last one that moved. Path and heave are those of the camera: the way from there to the
    rig's origin is in metres, which the chain's unknown unit cannot express.

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
    key = _key(0, frames[0], chosen)
    placements: list[Placement] = []
    missed, velocity, T_key_last, last = 0, np.eye(4), np.eye(4), 0
    for k in range(1, len(frames)):
        anchor = key.index
        if missed > MAX_GAP:
            step, moved_on = failed_step(f"the track was lost after frame {last} and not found again", 0), key
        else:
            predicted = T_key_last @ np.linalg.matrix_power(velocity, k - last)
            step, moved_on = _place(key, _key(k, frames[k], chosen), predicted, K, chosen)
        missed = missed + 1 if step.failure else 0
        placements.append(Placement(anchor=anchor, step=step))
        if not step.failure:
            if k - last == 1:
                velocity = invert_pose(T_key_last) @ step.T_earlier_later
            T_key_last = step.T_earlier_later if moved_on is key else np.eye(4)
            key, last = moved_on, k
    turned = np.eye(4)
    turned[:3, :3] = T_rig_camera[:3, :3]
    return integrate_motion("essential", placements, turned, route_rotations, metric=False)


def _key(index: int, rgb: NDArray[np.uint8], settings: EssentialSettings) -> _Key:
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    corners = grid_corners(
        corner_strength(grey), settings.cells_across, settings.window // 2, settings.corner_quality
    )
    unknown = np.zeros(len(corners))
    return _Key(
        index=index,
        grey=grey,
        corners=corners.astype(np.float32),
        depth=unknown,
        precision=unknown,
        inverse_depth=np.zeros(grey.shape, np.float32),
    )


def _place(
    key: _Key, later: _Key, predicted: Floats, K: Floats, settings: EssentialSettings
) -> tuple[FrameStep, _Key]:
    """The step to a frame, and the frame that the next one is to be placed against."""
    fewest = min(len(key.corners), len(later.corners))
    if fewest < settings.min_points:
        return failed_step(
            f"{fewest} points to track, at least {settings.min_points} are needed", fewest
        ), key
    if (key.precision > 0).any():
        found = _solve(key, later, predicted, settings.track_levels, K, settings)
        if not found[0].failure:
            return found
    # nothing to predict by: find motion and depth from the bare pictures, then again with their help
    blind = replace(key, inverse_depth=np.zeros_like(key.inverse_depth))
    step, rough = _solve(blind, later, np.eye(4), settings.search_levels, K, settings)
    if step.failure or rough is blind:
        return step, key
    return _solve(
        replace(key, inverse_depth=rough.inverse_depth),
        later,
        step.T_earlier_later,
        settings.track_levels,
        K,
        settings,
    )


def _solve(
    key: _Key, later: _Key, predicted: Floats, levels: int, K: Floats, settings: EssentialSettings
) -> tuple[FrameStep, _Key]:
    focal = float(K[0, 0] + K[1, 1]) / 2
    pairs = _track(key, later, predicted, levels, K, settings)
    count = len(pairs.rays)
    if count < settings.min_points:
        return failed_step(f"{count} points tracked, at least {settings.min_points} are needed", count), key
    turn, parallax = fit_rotation(pairs.rays, pairs.later_rays, focal)
    if parallax < settings.min_parallax:
        return _standing_step(key, turn, pairs, K, settings), key

    E, mask = cv2.findEssentialMat(pairs.pixels, pairs.later_pixels, K, cv2.RANSAC, 0.999, settings.epipolar)
    if E is None or E.shape != (3, 3):
        return failed_step("the points fix no essential matrix", 0), key
    inliers = int(mask.sum())
    if inliers < max(settings.min_points, settings.min_inlier_share * count):
        return failed_step(f"{inliers} of {count} tracked points agree on a pose", inliers), key
    _, R, t, _ = cv2.recoverPose(E, pairs.pixels, pairs.later_pixels, K, mask=mask)
    R, t, covariance, weight = refine_essential(
        R, t.ravel(), pairs.rays, pairs.later_rays, focal, settings.noise_floor
    )

    depth, later_depth, precision = triangulate(pairs.rays, pairs.later_rays, R, t)
    precision = np.where((weight > 0) & (depth > 0) & (later_depth > 0), precision, 0.0)
    split = int(pairs.kept.sum())
    length, length_std = 1.0, 0.0
    if (key.precision > 0).any():
        before = key.depth[pairs.kept], key.precision[pairs.kept]
        length, length_std = step_length(*before, depth[:split], precision[:split])
        if np.isnan(length):
            return failed_step("no point links this step's length to the one before", inliers), key
    placed = replace(
        later,
        depth=_scatter(later_depth[split:] * length, pairs.later_kept),
        precision=_scatter(precision[split:], pairs.later_kept),
        inverse_depth=_spread(
            pairs.later_pixels[precision > 0],
            1 / (later_depth[precision > 0] * length),
            later.grey.shape,
            settings,
        ),
    )
    return scaled_step(R, t, covariance, length, length_std, inliers), placed


def _track(
    key: _Key, later: _Key, predicted: Floats, levels: int, K: Floats, settings: EssentialSettings
) -> _Pairs:
    """Follow the corners of both frames, each into a view of the other picture from its own place.

    A street looks alike from one frame to the next, so the key frame's depth serves for both views.
    """
    tracker = (settings.window, levels, settings.forward_backward)
    to_later = warp_map(key.inverse_depth, invert_pose(predicted), K)
    ahead, kept = track_corners(key.grey, view_from(later.grey, to_later), key.corners, *tracker)
    seen_later, inside = _sample_map(to_later, ahead)
    kept &= inside
    to_key = warp_map(key.inverse_depth, predicted, K)
    behind, later_kept = track_corners(later.grey, view_from(key.grey, to_key), later.corners, *tracker)
    seen_key, inside = _sample_map(to_key, behind)
    later_kept &= inside
    pixels = np.concatenate([key.corners[kept], seen_key[later_kept]])
    later_pixels = np.concatenate([seen_later[kept], later.corners[later_kept]])
    return _Pairs(
        rays=viewing_rays(pixels, K),
        later_rays=viewing_rays(later_pixels, K),
        pixels=pixels,
        later_pixels=later_pixels,
        kept=kept,
        later_kept=later_kept,
    )


def _sample_map(where: NDArray[np.float32], at: NDArray[np.float32]) -> tuple[Floats, NDArray[np.bool_]]:
    taps, weights, inside = bilinear_taps(at, where.shape[:2])
    return (weights[..., None] * where[taps]).sum(axis=0), inside


def _standing_step(
    key: _Key, turn: Floats, pairs: _Pairs, K: Floats, settings: EssentialSettings
) -> FrameStep:
    """A frame taken from about where the key frame was: by the depth of its corners, or else as a turn."""
    T = np.eye(4)
    T[:3, :3] = turn
    split = int(pairs.kept.sum())
    known = key.precision[pairs.kept] > 0
    if known.sum() >= settings.min_points:
        points = pairs.rays[:split][known] * key.depth[pairs.kept][known, None]
        seen = pairs.later_pixels[:split][known]
        return solve_pnp(
            points, seen, T, K, settings.min_points, settings.noise_floor, settings.noise_ceiling
        )
    covariance = np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]) * (settings.min_parallax / K[0, 0]) ** 2
    return FrameStep(T_earlier_later=invert_pose(T), covariance=covariance, inliers=len(pairs.rays))


def _spread(
    pixels: Floats, inverse_depth: Floats, shape: tuple[int, ...], settings: EssentialSettings
) -> NDArray[np.float32]:
    """A smooth guess of inverse depth for every pixel, by normalised convolution over the grid cells."""
    cell = cell_size(shape[1], settings.cells_across)
    rows, columns = -(-shape[0] // cell), -(-shape[1] // cell)
    at = np.clip((pixels[:, ::-1] / cell).astype(np.int64), 0, [rows - 1, columns - 1])
    total, count = np.zeros((rows, columns)), np.zeros((rows, columns))
    np.add.at(total, tuple(at.T), inverse_depth)
    np.add.at(count, tuple(at.T), 1.0)
    near, far = ([cv2.GaussianBlur(a, (0, 0), width) for a in (total, count)] for width in (1.0, 6.0))
    # the wide blur only matters where no point lies near
    guess = (near[0] + 1e-3 * far[0]) / (near[1] + 1e-3 * far[1] + 1e-12)
    return cv2.resize(guess.astype(np.float32), (columns * cell, rows * cell))[: shape[0], : shape[1]]


def _scatter(values: Floats, where: NDArray[np.bool_]) -> Floats:
    spread = np.zeros(len(where))
    spread[where] = values
    return spread
