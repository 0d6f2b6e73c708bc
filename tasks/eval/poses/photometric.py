"""Pose check by every pixel: Gauss-Newton on grey levels from frame to frame, with rendered depth."""

from dataclasses import dataclass

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.depth_chain import Attempt, invert_depth, place_frames_by_depth, prepare_on_demand
from tasks.eval.poses.motion import (
    FrameStep,
    RecoveredMotion,
    check_clip,
    failed_step,
    integrate_motion,
)
from tasks.eval.poses.rigid import Floats, adjoint_matrix, advance_pose, invert_pose
from tasks.eval.poses.twists import pose_from_twist


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


@dataclass(frozen=True, kw_only=True)
class _Level:
    """One pyramid level: the picture, and its pixels that can be aligned to another picture."""

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
    chosen = settings or PhotometricSettings()
    prepared = prepare_on_demand(
        lambda k: _build_pyramid(frames[k], depth[k], None if unusable is None else unusable[k], K, chosen)
    )
    placements = place_frames_by_depth(
        len(frames),
        prepared,
        track=lambda earlier, later, guess: _align_pictures(
            earlier[: chosen.track_level + 1], later, guess, chosen
        ),
        search=lambda earlier, later, guess: _align_pictures(earlier, later, guess, chosen),
        guesses=[advance_pose(way, T_rig_camera) for way in chosen.search_advances],
    )
    return integrate_motion("photometric", placements, T_rig_camera, route_rotations)


def _build_pyramid(
    rgb: NDArray[np.uint8],
    depth: NDArray[np.float32],
    hidden: NDArray[np.bool_] | None,
    K: Floats,
    settings: PhotometricSettings,
) -> list[_Level]:
    grey = cv2.GaussianBlur(
        cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float32), (0, 0), settings.smoothing
    )
    q = invert_depth(depth, hidden)
    levels = []
    for level in range(settings.levels):
        if level and min(grey.shape) < 2 * settings.smallest_side:
            break
        if level:
            # pixel i of the smaller picture is centred on pixel 2 i of the larger one
            grey, q, K = cv2.pyrDown(grey), q[::2, ::2], np.diag([0.5, 0.5, 1.0]) @ K
        levels.append(_Level(grey=grey, pixels=_informative_pixels(grey, q, settings), K=K))
    return levels


def _informative_pixels(
    grey: NDArray[np.float32], q: NDArray[np.float32], settings: PhotometricSettings
) -> NDArray[np.float32]:
    gx, gy = np.zeros_like(grey), np.zeros_like(grey)
    gx[:, 1:-1] = (grey[:, 2:] - grey[:, :-2]) / 2
    gy[1:-1] = (grey[2:] - grey[:-2]) / 2
    bend = np.full_like(q, np.inf)
    bend[1:-1, 1:-1] = np.maximum(
        np.abs(q[1:-1, 2:] + q[1:-1, :-2] - 2 * q[1:-1, 1:-1]),
        np.abs(q[2:, 1:-1] + q[:-2, 1:-1] - 2 * q[1:-1, 1:-1]),
    )
    useful = (gx * gx + gy * gy >= settings.least_gradient**2) & (bend <= settings.depth_kink * q) & (q > 0)
    useful[::2, ::2] = useful[1::2, 1::2] = False  # neighbours hold nearly the same: a chequerboard suffices
    y, x = np.nonzero(useful)
    return np.stack([x, y, q[y, x], grey[y, x], gx[y, x], gy[y, x]], axis=-1).astype(np.float32)


def _align_pictures(
    earlier: list[_Level], later: list[_Level], T_earlier_later: Floats, settings: PhotometricSettings
) -> Attempt:
    """Align the later picture to the earlier one and the earlier to the later one at once.

    Resampling changes the picture that is resampled, which biases the pose; aligned both ways, the two biases cancel.
    """
    T, scale = T_earlier_later, 20.0
    for level in range(len(earlier) - 1, -1, -1):
        a, b = earlier[level], later[level]
        fewest = min(len(a.pixels), len(b.pixels))
        if fewest < max(settings.min_pixels >> (2 * level), 12):
            return _failed_attempt(
                f"{fewest} pixels with depth and contrast, at least {settings.min_pixels} are needed", 0
            )
        per_metre = float(np.median(b.pixels[:, 2]))
        for _ in range(settings.iterations):
            onto_a = _normal_equations(b.pixels, a.grey, b.K, T, scale, settings.block >> level)
            onto_b = _normal_equations(a.pixels, b.grey, a.K, invert_pose(T), scale, settings.block >> level)
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
            scale = max(_histogram_median(histogram) * 1.4826, settings.noise_floor)
            moved = b.K[0, 0] * (np.abs(twist[:3]).max() * per_metre + np.abs(twist[3:]).max())
            if moved < settings.converged:
                break
    agreeing, possible = int(sums[0]), len(a.pixels) + len(b.pixels)
    correlation = _correlation_from_sums(sums)
    if agreeing < max(settings.min_pixels, settings.min_inlier_share * possible):
        return _failed_attempt(f"{agreeing} of {possible} pixels agree on a pose", agreeing)
    if correlation < settings.min_correlation:
        return _failed_attempt(f"the aligned pictures correlate by {correlation:.2f} only", agreeing)
    # errors are correlated within a block, so the blocks count as independent, not the pixels
    spread = np.linalg.inv(H) @ (gradient.T @ gradient) @ np.linalg.inv(H)
    carry = adjoint_matrix(T)
    step = FrameStep(T_earlier_later=T, covariance=carry @ spread @ carry.T, inliers=agreeing)
    return Attempt(step=step, quality=correlation)


def _failed_attempt(reason: str, agreeing: int) -> Attempt:
    return Attempt(step=failed_step(reason, agreeing), quality=0.0)


BINS_PER_GREY_LEVEL = 4


def _histogram_median(histogram: NDArray[np.int64]) -> float:
    half = np.searchsorted(np.cumsum(histogram), max(histogram.sum(), 1) / 2)
    return (float(half) + 0.5) / BINS_PER_GREY_LEVEL


def _correlation_from_sums(sums: Floats) -> float:
    n, a, b, aa, bb, ab = sums
    if n == 0:
        return 0.0
    variance = (aa - a * a / n) * (bb - b * b / n)
    return float((ab - a * b / n) / np.sqrt(variance)) if variance > 0 else 0.0


def _normal_equations(
    pixels: NDArray[np.float32], source: NDArray[np.float32], K: Floats, T: Floats, scale: float, block: int
) -> tuple[Floats, Floats, Floats, NDArray[np.int64]]:
    return _accumulate_normal_equations(
        pixels,
        source,
        K @ T[:3, :3] @ np.linalg.inv(K),
        K @ T[:3, 3],
        (K[0, 0], K[1, 1], K[0, 2], K[1, 2]),
        scale,
        block,
    )


@numba.njit(cache=True, nogil=True)
def _accumulate_normal_equations(pixels, source, warp, shift, intrinsics, scale, block):  # type: ignore[no-untyped-def]
    """Weighted JTJ [6, 6], weighted JTr of each block [B, 6], sums for the correlation of the inliers
    (n, a, b, aa, bb, ab) and a histogram of the absolute residuals [1]."""
    fx, fy, cx, cy = intrinsics
    rows_in, columns_in = source.shape
    columns = columns_in // block + 1
    blocks = columns * (rows_in // block + 1)
    H = np.zeros((6, 6))
    gradient = np.zeros((blocks, 6))
    sums = np.zeros(6)
    histogram = np.zeros(256 * BINS_PER_GREY_LEVEL, np.int64)
    J = np.empty(6)
    cut = 1.0 / (4.685 * scale) ** 2
    for p in range(pixels.shape[0]):
        x, y, q = pixels[p, 0], pixels[p, 1], pixels[p, 2]
        Z = warp[2, 0] * x + warp[2, 1] * y + warp[2, 2] + shift[2] * q
        if Z <= 1e-3:
            continue
        u = (warp[0, 0] * x + warp[0, 1] * y + warp[0, 2] + shift[0] * q) / Z
        v = (warp[1, 0] * x + warp[1, 1] * y + warp[1, 2] + shift[1] * q) / Z
        if not (u >= 0.0 and v >= 0.0 and u < columns_in - 1 and v < rows_in - 1):
            continue
        j, i = int(u), int(v)
        a, b = u - j, v - i
        seen = (1 - b) * ((1 - a) * source[i, j] + a * source[i, j + 1]) + b * (
            (1 - a) * source[i + 1, j] + a * source[i + 1, j + 1]
        )
        grey = pixels[p, 3]
        r = seen - grey
        histogram[min(int(abs(r) * BINS_PER_GREY_LEVEL), histogram.size - 1)] += 1
        w = 1.0 - r * r * cut
        if w <= 0.0:
            continue
        w *= w
        X, Y, gx, gy = (x - cx) / fx, (y - cy) / fy, fx * pixels[p, 4], fy * pixels[p, 5]
        along = X * gx + Y * gy
        J[0], J[1], J[2] = q * gx, q * gy, -q * along
        J[3], J[4], J[5] = -gy - Y * along, gx + X * along, X * gy - Y * gx
        here = (int(y) // block) * columns + int(x) // block
        for m in range(6):
            wj = w * J[m]
            gradient[here, m] += wj * r
            for n in range(m, 6):
                H[m, n] += wj * J[n]
        sums[0] += 1.0
        sums[1] += seen
        sums[2] += grey
        sums[3] += seen * seen
        sums[4] += grey * grey
        sums[5] += seen * grey
    for m in range(6):
        for n in range(m):
            H[m, n] = H[n, m]
    return H, gradient, sums, histogram
