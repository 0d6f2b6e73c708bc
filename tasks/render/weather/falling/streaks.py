"""Drawing streaks: motion, defocus and the pixel's own width in one smooth, area-true stroke."""

from dataclasses import dataclass
from math import ceil, floor, pi, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

BLOCK_WIDTH, BLOCK_HEIGHT = 32, 16
"""Size of the blocks of the picture whose streaks are drawn together [px]."""
PIXEL_VARIANCE = 1 / 12 + 0.12
"""Variance of a pixel's square and of the blur of an ordinary lens [px2]."""
_ONE = np.float32(1)


@dataclass(frozen=True, kw_only=True)
class ParticleLayer:
    """Light and opacity of the drawn particles, to be composed as ``picture (1 - alpha) + rgb``.

    Parameters
    ----------
    rgb : float32 [H, W, 3] their light, premultiplied, linear [1]
    alpha : float32 [H, W] share of the background they hide [1]
    """

    rgb: NDArray[np.float32]
    alpha: NDArray[np.float32]


def draw_streaks(
    streaks: NDArray[np.void],
    radiance: NDArray[np.floating],
    depth: NDArray[np.float32],
    K: NDArray[np.floating],
    aperture_m: float,
) -> ParticleLayer:
    """Blend streaks into a layer; the result does not depend on their order but for rounding.

    They are drawn block after block of the picture, whose pixels then stay in the processor's cache.

    A particle's disc covers its true area, spread along its path during the exposure and across it by the
    opening of the lens, which is focused at infinity: an opening of diameter A blurs a particle by exactly
    its own perspective, A f / z. Light is averaged with the weights of coverage (weighted blended
    transparency, McGuire & Bavoil 2013, jcgt.org/published/0002/02/09).

    Parameters
    ----------
    streaks : `STREAK` [P] from `visible_streaks`
    radiance : [P, 3] light of each particle, linear [1]
    depth : float32 [H, W] camera z of the scene; NaN where there is none [m]
    K : [3, 3] intrinsics [px]
    aperture_m : diameter of the lens opening [m]

    Returns
    -------
    ParticleLayer
    """
    height, width = depth.shape
    through = np.ones((height, width), dtype=np.float32)
    sums = np.zeros((height, width, 4), dtype=np.float32)
    if len(streaks):
        light = np.ones((len(streaks), 4), dtype=np.float32)
        light[:, :3] = radiance
        order = _order_by_blocks(streaks, height, width)
        _stroke(streaks, order, light, depth, float(K[0, 0]), float(aperture_m), through, sums)
    rgb = np.zeros((height, width, 3), dtype=np.float32)
    _settle(sums, through, rgb)
    return ParticleLayer(rgb=rgb, alpha=1 - through)


def _order_by_blocks(streaks: NDArray[np.void], height: int, width: int) -> NDArray[np.intp]:
    """Return the places of the streaks by the block of the picture that their middle lies in."""
    u, v = (0.5 * (streaks["begin"][:, k] + streaks["end"][:, k]) for k in (0, 1))
    column = (np.clip(u, 0, width - 1) / BLOCK_WIDTH).astype(np.uint16)
    row = (np.clip(v, 0, height - 1) / BLOCK_HEIGHT).astype(np.uint16)
    return np.argsort(row * np.uint16(-(-width // BLOCK_WIDTH)) + column, kind="stable")


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _swept(x):  # type: ignore[no-untyped-def]
    """Integral up to x of the biweight kernel 15/16 (1 - x^2)^2 on [-1, 1]."""
    if x <= -1:
        return 0.0
    if x >= 1:
        return 1.0
    return 0.5 + 0.9375 * x * (1 + x * x * (-2 / 3 + 0.2 * x * x))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _stroke(streaks, order, light, depth, focal, aperture, through, sums):  # type: ignore[no-untyped-def]
    height, width = depth.shape
    for s in order:
        streak = streaks[s]
        (u0, v0), (u1, v1), z = streak.begin, streak.end, streak.z
        disc, blur = focal * streak.diameter / z, focal * aperture / z
        # a disc's chord has variance d^2 / 16, the biweight kernel of half-width w has w^2 / 7
        half = sqrt(7 * ((disc * disc + blur * blur) / 16 + PIXEL_VARIANCE))
        length = sqrt((u1 - u0) ** 2 + (v1 - v0) ** 2)
        if length > 0.05:
            ax, ay = (u1 - u0) / length, (v1 - v0) / length
        else:
            length, ax, ay = 0.05, 1.0, 0.0
        mid_u, mid_v = 0.5 * (u0 + u1), 0.5 * (v0 + v1)
        reach_u, reach_v = 0.5 * length * abs(ax) + half, 0.5 * length * abs(ay) + half
        first_u, last_u = max(0, ceil(mid_u - reach_u - 0.5)), min(width - 1, floor(mid_u + reach_u - 0.5))
        first_v, last_v = max(0, ceil(mid_v - reach_v - 0.5)), min(height - 1, floor(mid_v + reach_v - 0.5))
        steep = abs(ay) > 0.05
        slope, spread = (ax / ay, half / abs(ay)) if steep else (0.0, 0.0)
        strength = streak.share * pi / 4 * disc * disc * 0.9375 / (half * length)
        # from here on lengths are counted in half-widths of the streak
        ax, ay, end = ax / half, ay / half, 0.5 * length / half
        for row in range(first_v, last_v + 1):
            dv = row + 0.5 - mid_v
            first, last = first_u, last_u
            if steep:
                centre = mid_u + dv * slope - 0.5
                first, last = max(first, ceil(centre - spread)), min(last, floor(centre + spread))
            for column in range(first, last + 1):
                du = column + 0.5 - mid_u
                across, along = du * ay - dv * ax, du * ax + dv * ay
                if depth[row, column] < z or across * across >= 1 or abs(along) >= end + 1:
                    continue
                swept = _swept(along + end) - _swept(along - end)
                a = np.float32(min(1.0, swept * strength * (1 - across * across) ** 2))
                through[row, column] *= _ONE - a
                for c in range(4):
                    sums[row, column, c] += a * light[s, c]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _settle(sums, through, rgb):  # type: ignore[no-untyped-def]
    """Light of each pixel: the mean of its particles' light, as far as they hide what is behind them."""
    for row in range(through.shape[0]):
        for column in range(through.shape[1]):
            if sums[row, column, 3] > 0:
                scale = (1 - through[row, column]) / sums[row, column, 3]
                for c in range(3):
                    rgb[row, column, c] = scale * sums[row, column, c]
