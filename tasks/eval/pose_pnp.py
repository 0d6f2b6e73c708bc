"""Pose check by points: track corners from frame to frame, place each camera by their rendered depth.

The earlier frame is first warped to where the later one is expected, so that tracking meets small
shifts and no change of scale; what it then measures is pixels, not the expectation.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.eval.motion import FrameStep, RecoveredMotion, check_clip, failed_step, integrate_motion, place_frames
from tasks.eval.rigid import (
    Floats,
    adjoint,
    advance_pose,
    invert_pose,
    pose_from_twist,
    projection_jacobian,
)


@dataclass(frozen=True, kw_only=True)
class PnpSettings:
    """Settings of the point check.

    Parameters
    ----------
    cell : side of the grid cells that give one corner each [px]
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
    noise_floor : smallest tracking error believed [px]
    """

    cell: int = 14
    corner_quality: float = 0.02
    window: int = 11
    track_levels: int = 1
    search_levels: int = 4
    search_advances: tuple[float, ...] = (0.0, 1.0, 2.0, 4.0)
    forward_backward: float = 0.3
    depth_kink: float = 0.1
    near_prediction: float = 1.5
    crowded: float = 0.4
    crowded_contrast: int = 40
    min_points: int = 30
    min_inlier_share: float = 0.3
    noise_floor: float = 0.01


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
    class_id: NDArray[np.uint8] | None = None,
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
    class_id : uint8 [F, H, W] semantic classes; the sky's pixels are left out [1]
    route_rotations : float64 [F, 3, 3] route-to-world rotations of the undisturbed rig, for a route that
        is not level [1]
    settings : thresholds of the check

    Raises
    ------
    InputError
        If an array has the wrong shape, type or values.
    """
    check_clip(frames, K, T_rig_camera, depth, class_id, route_rotations)
    chosen = settings or PnpSettings()
    prepared: dict[int, _Frame] = {}

    def prepare(k: int) -> _Frame:
        if k not in prepared:
            for old in [i for i in prepared if i < k - 8]:
                del prepared[old]
            sky = None if class_id is None else class_id[k] == SemanticClass.SKY
            prepared[k] = _prepare(frames[k], depth[k], sky, chosen)
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

    return integrate_motion("pnp", place_frames(len(frames), place), T_rig_camera, route_rotations)


def _prepare(
    rgb: NDArray[np.uint8], depth: NDArray[np.float32], sky: NDArray[np.bool_] | None, settings: PnpSettings
) -> _Frame:
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    seen = np.isfinite(depth) & (depth > 0)
    if sky is not None:
        seen &= ~sky
    inverse_depth = np.divide(1.0, depth, out=np.zeros_like(depth), where=seen)
    return _Frame(grey=grey, inverse_depth=inverse_depth, strength=cv2.cornerMinEigenVal(grey, blockSize=5))


def _corners(frame: _Frame, settings: PnpSettings, hidden: NDArray[np.bool_] | None = None) -> NDArray[np.float32]:
    """The strongest corner (Shi and Tomasi 1994, DOI 10.1109/CVPR.1994.323794) of each grid cell that lies
    on one smooth surface and is not `hidden`, [N, 2] as x, y [px]."""
    cell, reach, q_map = settings.cell, settings.window // 2, frame.inverse_depth
    strength = frame.strength if hidden is None else np.where(hidden, 0.0, frame.strength)
    rows, cols = (n // cell * cell for n in strength.shape)
    cells = strength[:rows, :cols].reshape(rows // cell, cell, cols // cell, cell).swapaxes(1, 2)
    best = cells.reshape(rows // cell, cols // cell, cell * cell).argmax(axis=-1)
    i, j = np.indices(best.shape)
    y, x = (i * cell + best // cell).ravel(), (j * cell + best % cell).ravel()
    inside = (y >= reach) & (y < strength.shape[0] - reach) & (x >= reach) & (x < strength.shape[1] - reach)
    y, x = y[inside], x[inside]
    q = q_map[y, x]
    # 1/z of a plane is linear in the picture, so any bend is an edge or a curve
    bend_x = np.abs(q_map[y, x - reach] + q_map[y, x + reach] - 2 * q)
    bend_y = np.abs(q_map[y - reach, x] + q_map[y + reach, x] - 2 * q)
    strong = strength[y, x] > settings.corner_quality * np.percentile(frame.strength, 95)
    good = strong & (q > 0) & (np.maximum(bend_x, bend_y) <= settings.depth_kink * q)
    return np.stack([x[good], y[good]], axis=-1).astype(np.float32)


def _place(
    anchor: _Frame, frame: _Frame, predicted: Floats, K: Floats, levels: int, settings: PnpSettings
) -> FrameStep:
    """Track and solve; again from what was found where the prediction was far off or things fly by."""
    corners = _corners(frame, settings)
    for _ in range(levels + 1):
        source = _warp_map(frame.inverse_depth, predicted, K)
        warped = cv2.remap(anchor.grey, source, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        step = _track_and_solve(anchor, frame, corners, source, warped, predicted, K, levels, settings)
        if step.failure or _shift(frame, corners, predicted, step.T_earlier_later, K) <= settings.near_prediction:
            break
        predicted = step.T_earlier_later
    if step.inliers < (1 - settings.crowded) * len(corners) and not step.failure:
        source = _warp_map(frame.inverse_depth, step.T_earlier_later, K)
        warped = cv2.remap(anchor.grey, source, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        strange = (cv2.absdiff(warped, frame.grey) > settings.crowded_contrast).astype(np.uint8)
        hidden = cv2.dilate(strange, np.ones((settings.window, settings.window), np.uint8)) > 0
        again = _track_and_solve(
            anchor, frame, _corners(frame, settings, hidden), source, warped, step.T_earlier_later, K, 0, settings
        )
        if again.inliers > step.inliers and not again.failure:
            return again
    return step


def _shift(frame: _Frame, corners: NDArray[np.float32], predicted: Floats, found: Floats, K: Floats) -> float:
    """Mean way in the picture between predicted and found corners [px]."""
    at = corners.astype(np.int64)
    points = _rays(corners.astype(np.float64), K) / frame.inverse_depth[at[:, 1], at[:, 0], None]
    expected, seen = (_project(points @ T[:3, :3].T + T[:3, 3], K) for T in (predicted, found))
    return float(np.mean(np.linalg.norm(seen - expected, axis=-1)))


def _track_and_solve(
    anchor: _Frame,
    frame: _Frame,
    corners: NDArray[np.float32],
    source: NDArray[np.float32],
    warped: NDArray[np.uint8],
    predicted: Floats,
    K: Floats,
    levels: int,
    settings: PnpSettings,
) -> FrameStep:
    if len(corners) < settings.min_points:
        return failed_step(f"{len(corners)} points to track, at least {settings.min_points} are needed", 0)
    options = {
        "winSize": (settings.window, settings.window),
        "maxLevel": levels,
        "criteria": (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.003),
    }
    here, found, _ = cv2.calcOpticalFlowPyrLK(warped, frame.grey, corners, None, **options)
    back, found_back, _ = cv2.calcOpticalFlowPyrLK(frame.grey, warped, here, None, **options)
    start = corners.astype(np.int64)
    origin = source[start[:, 1], start[:, 0]]
    q, smooth = _sample_inverse_depth(anchor.inverse_depth, origin, settings)
    tracked = (
        (found.ravel() == 1)
        & (found_back.ravel() == 1)
        & (np.linalg.norm(back - corners, axis=-1) < settings.forward_backward)
        & smooth
    )
    count = int(tracked.sum())
    if count < settings.min_points:
        return failed_step(f"{count} points tracked, at least {settings.min_points} are needed", count)
    points = _rays(origin[tracked].astype(np.float64), K) / q[tracked, None]
    return solve_pnp_robust(points, here[tracked].astype(np.float64), invert_pose(predicted), K, settings)


def solve_pnp_robust(
    points: Floats, pixels: Floats, T_start: Floats, K: Floats, settings: PnpSettings
) -> FrameStep:
    """Place a camera by 3-D points and their pixels, by Gauss-Newton with Tukey's weights.

    Parameters
    ----------
    points : float64 [N, 3] in the earlier camera frame [m]
    pixels : float64 [N, 2] where the later camera sees them [px]
    T_start : float64 [4, 4] first guess of ``T_later_earlier`` [m]
    K : float64 [3, 3] intrinsics [px]
    settings : thresholds of the check

    Source: Beaton and Tukey 1974, DOI 10.1080/00401706.1974.10489171, with their constant 4.685; the
    scale is the median absolute residual, annealed as the fit improves.
    """
    T = T_start
    for _ in range(40):
        moved = points @ T[:3, :3].T + T[:3, 3]
        ahead = moved[:, 2] > 1e-3
        if ahead.sum() < settings.min_points:
            return failed_step(f"{int(ahead.sum())} points lie ahead of the camera", int(ahead.sum()))
        moved[~ahead, 2] = 1.0
        residual = pixels - _project(moved, K)
        size = np.linalg.norm(residual, axis=-1)
        # the median length of a 2-D Gaussian error is 1.1774 of its standard deviation
        scale = max(float(np.median(size[ahead])) / 1.1774, settings.noise_floor)
        weight = np.where(ahead, np.maximum(1 - (size / (4.685 * scale)) ** 2, 0.0) ** 2, 0.0)
        J = projection_jacobian(moved, K)
        JW = J * weight[:, None, None]
        H = np.einsum("nij,nik->jk", JW, J)
        try:
            twist = np.linalg.solve(H, np.einsum("nij,ni->j", JW, residual))
        except np.linalg.LinAlgError:
            return failed_step("the points do not fix the pose", 0)
        T = pose_from_twist(twist) @ T
        if np.abs(twist).max() < 1e-9:
            break
    inliers = int((weight > 0).sum())
    if inliers < max(settings.min_points, settings.min_inlier_share * len(points)):
        return failed_step(f"{inliers} of {len(points)} tracked points agree on a pose", inliers)
    variance = max((weight * size**2).sum() / (2 * weight.sum() - 6), settings.noise_floor**2)
    pose = invert_pose(T)
    carry = adjoint(pose)  # the error of an inverse pose is the carried error, sign aside
    return FrameStep(
        T_earlier_later=pose, covariance=carry @ (variance * np.linalg.inv(H)) @ carry.T, inliers=inliers
    )


def _warp_map(inverse_depth: NDArray[np.float32], T_anchor_frame: Floats, K: Floats) -> NDArray[np.float32]:
    """Where in the anchor each of the frame's pixels lies, [H, W, 2]; without depth, as if at infinity."""
    M = (K @ T_anchor_frame[:3, :3] @ np.linalg.inv(K)).astype(np.float32)
    shift = (K @ T_anchor_frame[:3, 3]).astype(np.float32)
    H, W = inverse_depth.shape
    u, v = np.arange(W, dtype=np.float32), np.arange(H, dtype=np.float32)[:, None]
    X, Y, Z = ((M[i, 0] * u + (M[i, 1] * v + M[i, 2])) + shift[i] * inverse_depth for i in range(3))
    scale = 1.0 / np.maximum(Z, np.float32(1e-3))
    exact = np.stack([X * scale, Y * scale], axis=-1)
    # cv2.remap samples at whole 1/32 px: say so, or every shift below that would read as none
    return np.rint(exact * np.float32(32)) / np.float32(32)


def _sample_inverse_depth(
    inverse_depth: NDArray[np.float32], at: NDArray[np.float32], settings: PnpSettings
) -> tuple[Floats, NDArray[np.bool_]]:
    """Bilinear 1/z [N], exact on planes, and whether the four pixels around belong together."""
    H, W = inverse_depth.shape
    x = np.clip(at[:, 0], 0, W - 1.001).astype(np.float64)
    y = np.clip(at[:, 1], 0, H - 1.001).astype(np.float64)
    i, j = y.astype(np.int64), x.astype(np.int64)
    fy, fx = y - i, x - j
    corners = np.stack([inverse_depth[i + a, j + b] for a in (0, 1) for b in (0, 1)]).astype(np.float64)
    q = (1 - fy) * ((1 - fx) * corners[0] + fx * corners[1]) + fy * ((1 - fx) * corners[2] + fx * corners[3])
    inside = (at[:, 0] >= 0) & (at[:, 0] <= W - 1) & (at[:, 1] >= 0) & (at[:, 1] <= H - 1)
    twist = np.abs(corners[0] + corners[3] - corners[1] - corners[2])
    smooth = inside & (corners.min(axis=0) > 0) & (twist <= settings.depth_kink * q)
    return np.where(smooth, q, 1.0), smooth


def _rays(pixels: Floats, K: Floats) -> Floats:
    return np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(K).T


def _project(points: Floats, K: Floats) -> Floats:
    homogeneous = points @ K.T
    return homogeneous[:, :2] / homogeneous[:, 2:]
