"""Pose check by points: track corners from frame to frame, place each camera by their rendered depth.

The earlier frame is first warped to where the later one is expected, so that tracking meets small
shifts and no change of scale; what it then measures is pixels, not the expectation.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.corners import cell_size, corner_strength, grid_corners, track_corners
from tasks.eval.poses.links import Link, chained_poses, link_placements
from tasks.eval.poses.motion import (
    FrameStep,
    RecoveredMotion,
    check_clip,
    failed_step,
    integrate_motion,
    place_frames,
)
from tasks.eval.poses.rigid import Floats, advance_pose, invert_pose, project, viewing_rays
from tasks.eval.poses.solve_pnp import solve_pnp
from tasks.eval.poses.warp import bilinear_taps, view_from, warp_map


@dataclass(frozen=True, kw_only=True)
class PnpSettings:
    """Settings of the point check.

    Parameters
    ----------
    cells_across : grid cells over the picture's width, which give one corner each [1]
    corner_quality : least corner strength as a share of the frame's 95th percentile [1]
    window : side of the tracked patches [px]
    track_levels : pyramid levels above full resolution where the motion is predicted [1]
    search_levels : the same where it is not: at the start, and after a failure [1]
    search_advances : ways ahead to try there as first guesses [m]
    forward_backward : largest distance between a point and its track there and back [px]
    depth_kink : largest relative bend of inverse depth across a patch: more is an edge, where the depth
        of the point and that of its neighbours belong to different things [1]
    near_prediction : mean shift below which the prediction was good enough for one pass [px]
    crowded : share of points that disagree beyond which something moves in front of the scene [1]
    crowded_contrast : grey levels of 255 between it and the warped earlier frame that betray it [1]
    min_points : fewest points that carry a pose [1]
    min_inlier_share : least share of tracked points that must agree on the pose [1]
    noise_floor, noise_ceiling : smallest tracking error believed, and largest that is still a track [px]
    depth_error : relative standard error of the rendered depth [1]
    link_span : frames that the longer steps beside the chain span [1]
    link_stride : frames between their starts [1]
    """

    cells_across: int = 60
    corner_quality: float = 0.02
    window: int = 11
    track_levels: int = 1
    search_levels: int = 4
    search_advances: tuple[float, ...] = (0.0, 1.0, 2.0, 4.0)
    forward_backward: float = 0.3
    depth_kink: float = 0.1
    near_prediction: float = 0.2
    crowded: float = 0.4
    crowded_contrast: int = 40
    min_points: int = 30
    min_inlier_share: float = 0.3
    noise_floor: float = 0.01
    noise_ceiling: float = 2.0
    depth_error: float = 0.01
    link_span: int = 4
    link_stride: int = 2


@dataclass(frozen=True, kw_only=True)
class _Frame:
    grey: NDArray[np.uint8]
    inverse_depth: NDArray[np.float32]
    strength: NDArray[np.float32]


def recover_motion_pnp(
    frames: NDArray[np.uint8],
    depth: NDArray[np.float32],
    K: Floats,
    T_rig_camera: Floats,
    unusable: NDArray[np.bool_] | None = None,
    route_rotations: Floats | None = None,
    settings: PnpSettings | None = None,
) -> RecoveredMotion:
    """Ego motion by frame-to-frame PnP with rendered depth.

    Parameters
    ----------
    frames : uint8 [F, H, W, 3] sRGB pictures [1]
    depth : float32 [F, H, W] camera z, NaN where there is nothing [m]
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    T_rig_camera : float64 [4, 4] camera mount [m]
    unusable : bool [F, H, W] pixels to leave out, see `tasks.eval.poses.unusable` [1]
    route_rotations : float64 [F, 3, 3] route-to-world rotations of the undisturbed rig, for a route that
        is not level [1]
    settings : thresholds of the check

    Raises
    ------
    InputError
        If an array has the wrong shape, type or values.
    """
    check_clip(frames, K, T_rig_camera, depth, unusable, route_rotations)
    chosen = settings or PnpSettings()
    prepared: dict[int, _Frame] = {}

    def prepare(k: int) -> _Frame:
        if k not in prepared:
            for old in [i for i in prepared if i < k - 8]:
                del prepared[old]
            hidden = None if unusable is None else unusable[k]
            prepared[k] = _prepare(frames[k], depth[k], hidden, chosen)
        return prepared[k]

    def place(anchor: int, frame: int, predicted: Floats) -> FrameStep:
        earlier, later = prepare(anchor), prepare(frame)
        if anchor > 0:
            step = _place(earlier, later, predicted, K, chosen.track_levels, chosen)
            if not step.failure:
                return step
        guesses = [advance_pose(way, T_rig_camera) for way in chosen.search_advances]
        found = [_place(earlier, later, guess, K, chosen.search_levels, chosen) for guess in guesses]
        return max(found, key=lambda step: (not step.failure, step.inliers))

    placements = place_frames(len(frames), place)
    poses, links = chained_poses(placements), []
    for k in range(0, len(frames) - chosen.link_span, chosen.link_stride):
        between = invert_pose(poses[k]) @ poses[k + chosen.link_span]
        if np.isfinite(between).all():
            pair = prepare(k), prepare(k + chosen.link_span)
            step = _place(*pair, between, K, chosen.track_levels, chosen)
            links.append(Link(earlier=k, later=k + chosen.link_span, step=step))
    return integrate_motion("pnp", link_placements(placements, links), T_rig_camera, route_rotations)


def _prepare(
    rgb: NDArray[np.uint8],
    depth: NDArray[np.float32],
    hidden: NDArray[np.bool_] | None,
    settings: PnpSettings,
) -> _Frame:
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    seen = np.isfinite(depth) & (depth > 0)
    if hidden is not None:
        seen &= ~hidden
    inverse_depth = np.divide(1.0, depth, out=np.zeros_like(depth), where=seen)
    return _Frame(grey=grey, inverse_depth=inverse_depth, strength=corner_strength(grey))


def _corners(
    frame: _Frame, settings: PnpSettings, hidden: NDArray[np.bool_] | None = None
) -> NDArray[np.int64]:
    """Corners whose patch lies on one smooth surface, [N, 2] as x, y [px]."""
    reach, q_map = settings.window // 2, frame.inverse_depth
    corners = grid_corners(frame.strength, settings.cells_across, reach, settings.corner_quality, hidden)
    x, y = corners.T
    q = q_map[y, x]
    # 1/z of a plane is linear in the picture, so any bend is an edge or a curve
    bend_x = np.abs(q_map[y, x - reach] + q_map[y, x + reach] - 2 * q)
    bend_y = np.abs(q_map[y - reach, x] + q_map[y + reach, x] - 2 * q)
    return corners[(q > 0) & (np.maximum(bend_x, bend_y) <= settings.depth_kink * q)]


def _place(
    anchor: _Frame, frame: _Frame, predicted: Floats, K: Floats, levels: int, settings: PnpSettings
) -> FrameStep:
    """Track and solve; again from what was found where the prediction was far off or things fly by."""
    corners = _corners(frame, settings)
    for _ in range(levels + 1):
        source = warp_map(frame.inverse_depth, predicted, K)
        warped = view_from(anchor.grey, source)
        step = _track_and_solve(anchor, frame, corners, source, warped, predicted, K, levels, settings)
        if (
            step.failure
            or _shift(frame, corners, predicted, step.T_earlier_later, K) <= settings.near_prediction
        ):
            break
        predicted = step.T_earlier_later
    if step.inliers < (1 - settings.crowded) * len(corners) and not step.failure:
        source = warp_map(frame.inverse_depth, step.T_earlier_later, K)
        warped = view_from(anchor.grey, source)
        strange = (cv2.absdiff(warped, frame.grey) > settings.crowded_contrast).astype(np.uint8)
        hidden = cv2.dilate(strange, np.ones((settings.window, settings.window), np.uint8)) > 0
        again = _track_and_solve(
            anchor,
            frame,
            _corners(frame, settings, hidden),
            source,
            warped,
            step.T_earlier_later,
            K,
            0,
            settings,
        )
        if again.inliers > step.inliers and not again.failure:
            return again
    return step


def _shift(frame: _Frame, corners: NDArray[np.int64], predicted: Floats, found: Floats, K: Floats) -> float:
    """Mean way in the picture between predicted and found corners [px]."""
    points = viewing_rays(corners, K) / frame.inverse_depth[corners[:, 1], corners[:, 0], None]
    expected, seen = (project(points @ T[:3, :3].T + T[:3, 3], K) for T in (predicted, found))
    return float(np.mean(np.linalg.norm(seen - expected, axis=-1)))


def _track_and_solve(
    anchor: _Frame,
    frame: _Frame,
    corners: NDArray[np.int64],
    source: NDArray[np.float32],
    warped: NDArray[np.uint8],
    predicted: Floats,
    K: Floats,
    levels: int,
    settings: PnpSettings,
) -> FrameStep:
    if len(corners) < settings.min_points:
        return failed_step(f"{len(corners)} points to track, at least {settings.min_points} are needed", 0)
    here, tracked = track_corners(
        warped, frame.grey, corners.astype(np.float32), settings.window, levels, settings.forward_backward
    )
    origin = source[corners[:, 1], corners[:, 0]]
    q, smooth = _sample_inverse_depth(anchor.inverse_depth, origin, settings)
    tracked &= smooth
    count = int(tracked.sum())
    if count < settings.min_points:
        return failed_step(f"{count} points tracked, at least {settings.min_points} are needed", count)
    points = viewing_rays(origin[tracked], K) / q[tracked, None]
    return solve_pnp(
        points,
        here[tracked].astype(np.float64),
        invert_pose(predicted),
        K,
        min_inliers=max(settings.min_points, int(settings.min_inlier_share * count)),
        noise_floor=settings.noise_floor,
        noise_ceiling=settings.noise_ceiling,
        overlap=max(settings.window / cell_size(frame.grey.shape[1], settings.cells_across), 1.0) ** 2,
        depth_error=settings.depth_error,
    )


def _sample_inverse_depth(
    inverse_depth: NDArray[np.float32], at: NDArray[np.float32], settings: PnpSettings
) -> tuple[Floats, NDArray[np.bool_]]:
    """Bilinear 1/z [N], exact on planes, and whether the four pixels around belong together."""
    taps, weights, inside = bilinear_taps(at, inverse_depth.shape)
    around = inverse_depth[taps].astype(np.float64)
    q = (weights * around).sum(axis=0)
    twist = np.abs(around[0] + around[3] - around[1] - around[2])
    smooth = inside & (around.min(axis=0) > 0) & (twist <= settings.depth_kink * q)
    return np.where(smooth, q, 1.0), smooth
