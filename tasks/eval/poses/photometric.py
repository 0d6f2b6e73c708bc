"""Pose check by every pixel: Gauss-Newton on grey levels from frame to frame, with rendered depth."""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.air import (
    LEAST_EXTINCTION,
    Air,
    convert_to_linear_light,
    fit_extinction,
    measure_sky_light,
    take_air_away,
)
from tasks.eval.poses.depth_chain import Attempt, invert_depth, place_frames_by_depth, prepare_on_demand
from tasks.eval.poses.grey_equations import (
    compute_correlation,
    find_histogram_median,
    find_informative_pixels,
    form_normal_equations,
)
from tasks.eval.poses.links import chained_poses
from tasks.eval.poses.motion import (
    FrameStep,
    RecoveredMotion,
    check_clip,
    failed_step,
    integrate_motion,
)
from tasks.eval.poses.rigid import (
    Floats,
    adjoint_matrix,
    advance_pose,
    invert_pose,
    project_points,
    viewing_rays,
)
from tasks.eval.poses.twists import pose_from_twist
from tasks.eval.poses.warp import bilinear_taps


@dataclass(frozen=True, kw_only=True)
class PhotometricSettings:
    """Settings of the pixel check.

    Parameters
    ----------
    levels : most pyramid levels, full resolution among them [1]
    smallest_side : shorter side of the smallest picture [px]
    track_level : coarsest level where the motion is predicted [1]
    search_advances : ways ahead to try as first guesses where it is not [m]
    iterations : most Gauss-Newton steps per level [1]
    converged : motion of a step, in the picture, at which a level is done [px]
    smoothing : Gaussian blur of the pictures, which reduces the effect of bilinear resampling [px]
    least_gradient : grey levels per pixel below which a pixel is left out [1]
    depth_kink : largest relative bend of inverse depth beside a pixel; more is an edge [1]
    min_pixels : fewest full-resolution pixels that carry a pose [1]
    min_inlier_share : least share of the pixels whose grey level must agree [1]
    min_correlation : least correlation of the aligned pictures [1]
    noise_floor : smallest assumed error of a grey level, that of rounding two of them [1]
    block : side of the blocks whose errors count as independent [px]
    air_spans, air_steps : runs of frames on which the air is measured, and steps of each [1]
    air_level : finest level of the pictures that it is measured on [1]
    air_converged : motion of a step there at which a level is done [px]
    """

    levels: int = 4
    smallest_side: int = 32
    track_level: int = 2
    search_advances: tuple[float, ...] = (0.0, 1.0, 2.0, 4.0)
    iterations: int = 15
    converged: float = 0.003
    smoothing: float = 0.6
    least_gradient: float = 1.0
    depth_kink: float = 0.1
    min_pixels: int = 1000
    min_inlier_share: float = 0.4
    min_correlation: float = 0.5
    noise_floor: float = 0.5
    block: int = 32
    air_spans: int = 4
    air_steps: int = 4
    air_level: int = 1
    air_converged: float = 0.03


@dataclass(frozen=True, kw_only=True)
class _Level:
    """One pyramid level: the picture, and its pixels that can be aligned to another picture."""

    level: int
    grey: NDArray[np.float32]
    pixels: NDArray[np.float32]  # [P, 6]: x, y, 1/z, grey level, d/dx, d/dy
    K: Floats


def recover_motion_photometric(
    frames: NDArray[np.uint8],
    depth: NDArray[np.float32],
    K: Floats,
    T_rig_camera: Floats,
    unusable: NDArray[np.bool_] | None = None,
    route_rotations: Floats | None = None,
    settings: PhotometricSettings | None = None,
) -> RecoveredMotion:
    """Recover ego motion by frame-to-frame alignment of grey levels with rendered depth.

    Inverse-compositional Gauss-Newton (Baker and Matthews 2004, DOI 10.1023/B:VISI.0000011205.11775.fd)
    from coarse to fine, with Tukey's weights on the grey levels.

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
    chosen = settings or PhotometricSettings()
    hidden = np.zeros(depth.shape, np.bool_) if unusable is None else unusable
    greys = np.stack([cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY) for frame in frames])
    guesses = [advance_pose(way, T_rig_camera) for way in chosen.search_advances]
    air = _measure_air(greys, depth, hidden, K, guesses, chosen)

    def prepare_frame(k: int) -> list[_Level]:
        clear = greys[k] if air is None else take_air_away(greys[k], depth[k], K, air)
        return _build_pyramid(clear, depth[k], hidden[k], K, chosen)

    placements = place_frames_by_depth(
        len(frames),
        prepare_on_demand(prepare_frame),
        track=lambda earlier, later, guess: _align_pictures(
            earlier[: chosen.track_level + 1], later, guess, chosen
        ),
        search=lambda earlier, later, guess: _align_pictures(earlier, later, guess, chosen),
        guesses=guesses,
    )
    return integrate_motion("photometric", placements, T_rig_camera, route_rotations)


def _measure_air(
    greys: NDArray[np.uint8],
    depth: NDArray[np.float32],
    hidden: NDArray[np.bool_],
    K: Floats,
    guesses: list[Floats],
    settings: PhotometricSettings,
) -> Air | None:
    """Return the air of a clip from a few of its runs of frames, or None where it is clear or cannot be measured.

    Smaller pictures suffice: an error of the pose moves greys either way, the veil all of them towards its own. Pixels
    without a gradient are read too: they show the veil and nothing of the pose.
    """
    steps = min(settings.air_steps, len(greys) - 1)
    starts = np.unique(np.linspace(0, len(greys) - 1 - steps, settings.air_spans).astype(int))
    light = measure_sky_light(greys[starts], depth[starts])
    if light is None or not steps:
        return None
    rough = replace(settings, least_gradient=0.0, converged=settings.air_converged)

    def align_roughly(earlier: list[_Level], later: list[_Level], guess: Floats) -> Attempt:
        return _align_pictures(earlier, later, guess, rough)

    def prepare_frame(k: int) -> list[_Level]:
        return _build_pyramid(greys[k], depth[k], hidden[k], K, rough, settings.air_level)

    seen = []
    for start in starts:
        prepared = [prepare_frame(k) for k in range(start, start + steps + 1)]
        T_first_last = chained_poses(
            place_frames_by_depth(steps + 1, prepared.__getitem__, align_roughly, align_roughly, guesses)
        )[-1]
        if np.isfinite(T_first_last).all():
            seen.append(_compare_light(prepared[0][0], prepared[-1][0], T_first_last))
    if not seen:
        return None
    far, near, nearing = np.concatenate(seen, axis=1)
    extinction = fit_extinction(far, near, nearing, light)
    return Air(extinction=extinction, light=light) if extinction >= LEAST_EXTINCTION else None


def _compare_light(far: _Level, near: _Level, T_far_near: Floats) -> Floats:
    """Return the light of surfaces from afar and from nearer by [1], and by how much nearer [m]: float64 [3, N]."""
    xy, q = near.pixels[:, :2].astype(np.float64), near.pixels[:, 2].astype(np.float64)
    points = viewing_rays(xy, near.K) / q[:, None]
    before = points @ T_far_near[:3, :3].T + T_far_near[:3, 3]
    ahead = before[:, 2] > 0
    at, weights, inside = bilinear_taps(
        project_points(np.where(ahead[:, None], before, 1.0), far.K).astype(np.float32), far.grey.shape
    )
    shown = ahead & inside
    grey = (weights * far.grey[at]).sum(axis=0)
    nearing = np.linalg.norm(before, axis=1) - np.linalg.norm(points, axis=1)
    return np.stack([convert_to_linear_light(grey), convert_to_linear_light(near.pixels[:, 3]), nearing])[
        :, shown
    ]


def _build_pyramid(
    picture: NDArray[np.number[Any]],
    depth: NDArray[np.float32],
    hidden: NDArray[np.bool_],
    K: Floats,
    settings: PhotometricSettings,
    finest: int = 0,
) -> list[_Level]:
    """Return the levels of a picture [H, W], from `finest` on where the pyramid has so many."""
    grey = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), settings.smoothing)
    scaled = [(grey, invert_depth(depth, hidden), K)]
    while len(scaled) < settings.levels and min(scaled[-1][0].shape) >= 2 * settings.smallest_side:
        grey, q, K = scaled[-1]
        # pixel i of the smaller picture is centred on pixel 2 i of the larger one
        scaled.append((cv2.pyrDown(grey), q[::2, ::2], np.diag([0.5, 0.5, 1.0]) @ K))
    return [
        _Level(
            level=level,
            grey=grey,
            pixels=find_informative_pixels(grey, q, settings.least_gradient, settings.depth_kink),
            K=K,
        )
        for level, (grey, q, K) in enumerate(scaled)
        if level >= min(finest, len(scaled) - 1)
    ]


def _align_pictures(
    earlier: list[_Level], later: list[_Level], T_earlier_later: Floats, settings: PhotometricSettings
) -> Attempt:
    """Align the later picture to the earlier one and the earlier to the later one at once.

    Resampling changes the picture that is resampled, which biases the pose; aligned both ways, the two biases cancel.
    """
    T, scale = T_earlier_later, 20.0
    for a, b in reversed(list(zip(earlier, later, strict=False))):
        level, least = a.level, max(settings.min_pixels >> (2 * a.level), 12)
        fewest = min(len(a.pixels), len(b.pixels))
        if fewest < least:
            return _failed_attempt(
                f"{fewest} pixels with depth and contrast, at least {settings.min_pixels} are needed", 0
            )
        per_metre = float(np.median(b.pixels[:, 2]))
        for _ in range(settings.iterations):
            onto_a = form_normal_equations(b.pixels, a.grey, b.K, T, scale, settings.block >> level)
            onto_b = form_normal_equations(
                a.pixels, b.grey, a.K, invert_pose(T), scale, settings.block >> level
            )
            back = -adjoint_matrix(T)
            H = onto_a[0] + back.T @ onto_b[0] @ back
            gradient = onto_a[1] + onto_b[1] @ back
            sums, histogram = onto_a[2] + onto_b[2], onto_a[3] + onto_b[3]
            try:
                twist = np.linalg.solve(H, gradient.sum(axis=0))
            except np.linalg.LinAlgError:
                return _failed_attempt("the picture does not fix the pose", 0)
            if not np.isfinite(twist).all():
                return _failed_attempt("the alignment diverged", 0)
            T = T @ pose_from_twist(-twist)
            scale = max(find_histogram_median(histogram) * 1.4826, settings.noise_floor)
            moved = b.K[0, 0] * (np.abs(twist[:3]).max() * per_metre + np.abs(twist[3:]).max())
            if moved < settings.converged:
                break
    agreeing, possible = int(sums[0]), len(a.pixels) + len(b.pixels)
    correlation = compute_correlation(sums)
    if agreeing < max(least, settings.min_inlier_share * possible):
        return _failed_attempt(f"{agreeing} of {possible} pixels agree on a pose", agreeing)
    if correlation < settings.min_correlation:
        return _failed_attempt(f"the aligned pictures correlate by {correlation:.2f} only", agreeing)
    # errors are correlated within a block, so the blocks count as independent, not the pixels
    twists = gradient @ np.linalg.inv(H) @ adjoint_matrix(T).T
    step = FrameStep(T_earlier_later=T, covariance=twists.T @ twists, inliers=agreeing, region_twists=twists)
    return Attempt(step=step, quality=correlation)


def _failed_attempt(reason: str, agreeing: int) -> Attempt:
    return Attempt(step=failed_step(reason, agreeing), quality=0.0)
