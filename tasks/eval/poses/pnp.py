"""Pose check by points: track corners from frame to frame, place each camera by their rendered depth.

The earlier frame is first warped to the place where the later one is expected, so that the tracker meets small
shifts and no change of scale. The tracker measures the pixels, not the expectation. It reads pictures of even contrast,
since a surface that comes nearer loses veil.
"""

from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.corners import (
    Tracks,
    cell_size,
    corner_strength,
    even_contrast,
    grid_corners,
    least_strength,
    merge_tracks,
    track_corners,
)
from tasks.eval.poses.depth_chain import Attempt, invert_depth, place_frames_by_depth, prepare_on_demand
from tasks.eval.poses.links import Link, chained_poses, link_placements
from tasks.eval.poses.motion import (
    FrameStep,
    RecoveredMotion,
    check_clip,
    failed_step,
    integrate_motion,
)
from tasks.eval.poses.rigid import Floats, advance_pose, invert_pose, project_points, viewing_rays
from tasks.eval.poses.solve_pnp import PnpLimits, solve_pnp
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
    near_prediction : mean shift below which the prediction is good enough to track all corners from [px]
    coarse_stride : every how many corners the prediction is corrected by [1]
    crowded : share of points that disagree above which something moves in front of the scene [1]
    crowded_contrast : difference of grey levels, of 255, to the warped earlier frame that shows such a thing [1]
    min_points : fewest points that carry a pose [1]
    min_inlier_share : least share of tracked points that must agree on the pose [1]
    followed : share of corners that come back below which a failure says that too little can be followed: .02 to .08
        under flakes that tear the points apart, .3 and more with the depth of other pictures [1]
    noise_floor, noise_ceiling : smallest assumed tracking error, and largest error of a valid track [px]
    least_contrast : standard deviation of a patch that noise alone may have, 8-bit [1]
    depth_error : relative standard error of the rendered depth [1]
    regions_across : regions over the picture's width whose errors count as independent: wider than a hedge is high, and
        enough that their spread is known [1]
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
    coarse_stride: int = 2
    crowded: float = 0.4
    crowded_contrast: int = 40
    min_points: int = 30
    min_inlier_share: float = 0.3
    followed: float = 0.2
    noise_floor: float = 0.01
    noise_ceiling: float = 2.0
    least_contrast: float = 2.0
    depth_error: float = 0.01
    regions_across: int = 10
    link_span: int = 4
    link_stride: int = 2


@dataclass(frozen=True, kw_only=True)
class _Frame:
    """One frame: grey levels [H, W] and the same of even contrast [1], inverse depth [H, W] [1/m] and its corners on
    smooth surfaces [N, 2] [px]."""

    grey: NDArray[np.uint8]
    evened: NDArray[np.uint8]
    inverse_depth: NDArray[np.float32]
    corners: NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class _WarpedAnchor:
    """The anchor's picture as seen from the place where the frame is expected.

    Parameters
    ----------
    T_anchor_frame : float64 [4, 4] that place [m]
    source : float32 [H, W, 2] where each pixel lies in the anchor's picture [px]
    grey, evened : uint8 [H, W] its grey levels, and the same of even contrast [1]
    """

    T_anchor_frame: Floats
    source: NDArray[np.float32]
    grey: NDArray[np.uint8]
    evened: NDArray[np.uint8]


def recover_motion_pnp(
    frames: NDArray[np.uint8],
    depth: NDArray[np.float32],
    K: Floats,
    T_rig_camera: Floats,
    unusable: NDArray[np.bool_] | None = None,
    route_rotations: Floats | None = None,
    settings: PnpSettings | None = None,
) -> RecoveredMotion:
    """Recover ego motion by frame-to-frame PnP with rendered depth.

    Parameters
    ----------
    frames : uint8 [F, H, W, 3] sRGB pictures [1]
    depth : float32 [F, H, W] camera z, NaN where there is nothing [m]
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    T_rig_camera : float64 [4, 4] camera mount [m]
    unusable : bool [F, H, W] pixels to leave out, see `tasks.eval.poses.checks` [1]
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
    corners: dict[int, NDArray[np.int64]] = {}  # they are small, and found once

    def prepare_frame(k: int) -> _Frame:
        grey = cv2.cvtColor(frames[k], cv2.COLOR_RGB2GRAY)
        inverse_depth = invert_depth(depth[k], None if unusable is None else unusable[k])
        if k not in corners:
            corners[k] = _find_smooth_corners(grey, inverse_depth, chosen)
        evened = even_contrast(grey, chosen.window, chosen.least_contrast)
        return _Frame(grey=grey, evened=evened, inverse_depth=inverse_depth, corners=corners[k])

    prepared = prepare_on_demand(prepare_frame)

    def attempt_step(earlier: _Frame, later: _Frame, guess: Floats, levels: int) -> Attempt:
        step = _place_frame(earlier, later, guess, K, levels, chosen)
        return Attempt(step=step, quality=step.inliers)

    placements = place_frames_by_depth(
        len(frames),
        prepared,
        track=partial(attempt_step, levels=chosen.track_levels),
        search=partial(attempt_step, levels=chosen.search_levels),
        guesses=[advance_pose(way, T_rig_camera) for way in chosen.search_advances],
    )
    poses, links = chained_poses(placements), []
    for k in range(0, len(frames) - chosen.link_span, chosen.link_stride):
        between = invert_pose(poses[k]) @ poses[k + chosen.link_span]
        if np.isfinite(between).all():
            pair = prepared(k), prepared(k + chosen.link_span)
            step = _place_frame(*pair, between, K, chosen.track_levels, chosen)
            links.append(Link(earlier=k, later=k + chosen.link_span, step=step))
    return integrate_motion("pnp", link_placements(placements, links), T_rig_camera, route_rotations)


def _find_smooth_corners(
    grey: NDArray[np.uint8],
    inverse_depth: NDArray[np.float32],
    settings: PnpSettings,
    hidden: NDArray[np.bool_] | None = None,
) -> NDArray[np.int64]:
    """Return the corners whose patch lies on one smooth surface, [N, 2] as x, y [px]."""
    strength, reach = corner_strength(grey), settings.window // 2
    least = least_strength(strength, settings.corner_quality)
    corners = grid_corners(strength, settings.cells_across, reach, least, hidden)
    x, y = corners.T
    q = inverse_depth[y, x]
    # 1/z of a plane is linear in the picture, so any bend is an edge or a curve
    bend_x = np.abs(inverse_depth[y, x - reach] + inverse_depth[y, x + reach] - 2 * q)
    bend_y = np.abs(inverse_depth[y - reach, x] + inverse_depth[y + reach, x] - 2 * q)
    return corners[(q > 0) & (np.maximum(bend_x, bend_y) <= settings.depth_kink * q)]


def _place_frame(
    anchor: _Frame, frame: _Frame, predicted: Floats, K: Floats, levels: int, settings: PnpSettings
) -> FrameStep:
    """Find the way to the frame by every second corner, then place it by all of them, less what things fly before."""
    corners = frame.corners
    for stride in (settings.coarse_stride, 1):
        some = corners[::stride]
        view, tracks, step = _follow_prediction(anchor, frame, some, predicted, K, levels, settings)
        if not step.failure:
            break
    else:
        return step
    if step.inliers < (1 - settings.crowded) * len(some):
        strange = (cv2.absdiff(view.grey, frame.grey) > settings.crowded_contrast).astype(np.uint8)
        hidden = cv2.dilate(strange, np.ones((settings.window, settings.window), np.uint8)) > 0
        unhidden = _find_smooth_corners(frame.grey, frame.inverse_depth, settings, hidden)
        seen = _track_into_frame(view, frame, unhidden, 0, settings)
        placed = _solve_tracks(anchor, frame, unhidden, seen, view, K, settings)
        if placed.inliers > settings.coarse_stride * step.inliers and not placed.failure:
            return placed
    others = np.arange(len(corners)) % stride > 0  # a corner's track does not depend on those of others
    rest = _track_into_frame(view, frame, corners[others], levels, settings)
    tracks = merge_tracks(others, rest, tracks)
    placed = _solve_tracks(anchor, frame, corners, tracks, view, K, settings)
    return step if placed.failure else placed


def _follow_prediction(
    anchor: _Frame,
    frame: _Frame,
    corners: NDArray[np.int64],
    predicted: Floats,
    K: Floats,
    levels: int,
    settings: PnpSettings,
) -> tuple[_WarpedAnchor, Tracks, FrameStep]:
    """Track and solve; again from the step found where the prediction was far off.

    Returns the view it ended with, the tracks of the corners in it, and the step.
    """
    for _ in range(levels + 1):
        view = _warp_anchor(anchor, frame, predicted, K, settings)
        tracks = _track_into_frame(view, frame, corners, levels, settings)
        step = _solve_tracks(anchor, frame, corners, tracks, view, K, settings)
        if (
            step.failure
            or _mean_shift(frame, corners, predicted, step.T_earlier_later, K) <= settings.near_prediction
        ):
            return view, tracks, step
        predicted = step.T_earlier_later
    view = _warp_anchor(anchor, frame, predicted, K, settings)
    return view, _track_into_frame(view, frame, corners, levels, settings), step


def _warp_anchor(
    anchor: _Frame, frame: _Frame, predicted: Floats, K: Floats, settings: PnpSettings
) -> _WarpedAnchor:
    source = warp_map(frame.inverse_depth, predicted, K)
    grey = view_from(anchor.grey, source)
    evened = even_contrast(grey, settings.window, settings.least_contrast)
    return _WarpedAnchor(T_anchor_frame=predicted, source=source, grey=grey, evened=evened)


def _mean_shift(
    frame: _Frame, corners: NDArray[np.int64], predicted: Floats, found: Floats, K: Floats
) -> float:
    """Mean distance in the picture between predicted and found corners [px]."""
    points = viewing_rays(corners, K) / frame.inverse_depth[corners[:, 1], corners[:, 0], None]
    expected, seen = (project_points(points @ T[:3, :3].T + T[:3, 3], K) for T in (predicted, found))
    return float(np.mean(np.linalg.norm(seen - expected, axis=-1)))


def _track_into_frame(
    view: _WarpedAnchor, frame: _Frame, corners: NDArray[np.int64], levels: int, settings: PnpSettings
) -> Tracks:
    return track_corners(
        view.evened,
        frame.evened,
        corners.astype(np.float32),
        settings.window,
        levels,
        settings.forward_backward,
    )


def _solve_tracks(
    anchor: _Frame,
    frame: _Frame,
    corners: NDArray[np.int64],
    tracks: Tracks,
    view: _WarpedAnchor,
    K: Floats,
    settings: PnpSettings,
) -> FrameStep:
    if len(corners) < settings.min_points:
        return failed_step(
            f"{len(corners)} points to track, at least {settings.min_points} are needed", 0, blind=True
        )
    origin = view.source[corners[:, 1], corners[:, 0]]
    q, smooth = _sample_inverse_depth(anchor.inverse_depth, origin, settings)
    tracked = tracks.came_back & smooth
    count = int(tracked.sum())
    if count < settings.min_points:
        return failed_step(
            f"{count} points tracked, at least {settings.min_points} are needed", count, blind=True
        )
    points = viewing_rays(origin[tracked], K) / q[tracked, None]
    height, width = frame.grey.shape
    side = -(-width // settings.regions_across)
    limits = PnpLimits(
        min_inliers=max(settings.min_points, int(settings.min_inlier_share * count)),
        noise_floor=settings.noise_floor,
        noise_ceiling=settings.noise_ceiling,
        overlap=max(settings.window / cell_size(width, settings.cells_across), 1.0) ** 2,
        depth_error=settings.depth_error,
        regions=settings.regions_across * -(-height // side),
    )
    column, row = corners[tracked].T // side
    step = solve_pnp(
        points,
        tracks.places[tracked].astype(np.float64),
        invert_pose(view.T_anchor_frame),
        K,
        limits,
        row * settings.regions_across + column,
    )
    torn = bool(step.failure) and count < settings.followed * len(corners)
    return replace(step, blind=True) if torn else step


def _sample_inverse_depth(
    inverse_depth: NDArray[np.float32], at: NDArray[np.float32], settings: PnpSettings
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return bilinear 1/z [N], exact on planes, and whether the four pixels around lie on one surface."""
    taps, weights, inside = bilinear_taps(at, inverse_depth.shape)
    around = inverse_depth[taps].astype(np.float64)
    q = (weights * around).sum(axis=0)
    twist = np.abs(around[0] + around[3] - around[1] - around[2])
    smooth = inside & (around.min(axis=0) > 0) & (twist <= settings.depth_kink * q)
    return np.where(smooth, q, 1.0), smooth
