"""Drawing streaks: motion, defocus and the pixel's own width in one smooth, area-true stroke."""

from dataclasses import dataclass
from math import ceil, floor, pi, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import INLINED, LAW, new_picture, run_on_device, run_on_either

BLOCK_WIDTH, BLOCK_HEIGHT = 32, 16
"""Size of the blocks of the picture whose streaks are drawn together [px]."""
PIXEL_VARIANCE = 1 / 12 + 0.12
"""Variance of a pixel's square and of the blur of an ordinary lens [px2]."""
_ONE = np.float32(1)
# Columns of a stroke: its middle [px], its direction and half its length in half-widths, its strength [1], z [m], first
# and last pixels, and for a steep one columns per row and half its width in columns, else 0 [px].
_MID_U, _MID_V, _AX, _AY, _END, _STRENGTH, _Z, _LEFT, _RIGHT, _TOP, _BOTTOM, _SLOPE, _SPREAD = range(13)
_COLUMNS = 13


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

    They are drawn block after block of the picture, whose pixels then stay in the processor's cache. On a device every
    pixel takes the streaks of its block, in the same order.

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
    through, sums = new_picture(depth), new_picture(depth, 4)
    through += 1
    if len(streaks):
        light = np.ones((len(streaks), 4), dtype=np.float32)
        light[:, :3] = radiance
        order = _order_by_blocks(streaks, height, width)
        strokes = np.empty((len(streaks), _COLUMNS))
        _measure(streaks, float(K[0, 0]), float(aperture_m), height, width, strokes)
        if isinstance(depth, np.ndarray):
            _stroke(strokes, order, light, depth, through, sums)
        else:
            listed = _list_by_blocks(strokes[order], order, height, width)
            run_on_device(_stroke_pixel, depth, strokes, *listed, light, through, sums)
    rgb = new_picture(depth, 3)
    _settle(sums, through, rgb)
    return ParticleLayer(rgb=rgb, alpha=1 - through)


def _order_by_blocks(streaks: NDArray[np.void], height: int, width: int) -> NDArray[np.intp]:
    """Return the places of the streaks by the block of the picture that their middle lies in."""
    u, v = (0.5 * (streaks["begin"][:, k] + streaks["end"][:, k]) for k in (0, 1))
    column = (np.clip(u, 0, width - 1) / BLOCK_WIDTH).astype(np.uint16)
    row = (np.clip(v, 0, height - 1) / BLOCK_HEIGHT).astype(np.uint16)
    return np.argsort(row * np.uint16(-(-width // BLOCK_WIDTH)) + column, kind="stable")


def _list_by_blocks(
    strokes: NDArray[np.float64], order: NDArray[np.intp], height: int, width: int
) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """Return where the list of each block starts, and the streaks that reach it, in their order."""
    sides = strokes[:, _LEFT : _BOTTOM + 1].astype(np.int64)
    left, right, top, bottom = (sides // (BLOCK_WIDTH, BLOCK_WIDTH, BLOCK_HEIGHT, BLOCK_HEIGHT)).T
    wide, high = np.maximum(right - left + 1, 0), np.maximum(bottom - top + 1, 0)
    stroke = np.repeat(np.arange(len(order)), wide * high)
    within = np.arange(len(stroke)) - np.repeat(np.cumsum(wide * high) - wide * high, wide * high)
    down, along = np.divmod(within, wide[stroke])
    across = -(-width // BLOCK_WIDTH)
    block = (top[stroke] + down) * across + left[stroke] + along
    starts = np.concatenate(
        ((0,), np.cumsum(np.bincount(block, minlength=across * -(-height // BLOCK_HEIGHT))))
    )
    return starts, order[stroke[np.argsort(block, kind="stable")]]


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _swept(x):  # type: ignore[no-untyped-def]
    """Integral up to x of the biweight kernel 15/16 (1 - x^2)^2 on [-1, 1]."""
    if x <= -1:
        return 0.0
    if x >= 1:
        return 1.0
    return 0.5 + 0.9375 * x * (1 + x * x * (-2 / 3 + 0.2 * x * x))


@numba.njit(**LAW)
def _measure(streaks, focal, aperture, height, width, strokes):  # type: ignore[no-untyped-def]
    for s in range(len(streaks)):
        streak, stroke = streaks[s], strokes[s]
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
        stroke[_MID_U], stroke[_MID_V], stroke[_Z] = mid_u, mid_v, z
        stroke[_LEFT] = max(0, ceil(mid_u - reach_u - 0.5))
        stroke[_RIGHT] = min(width - 1, floor(mid_u + reach_u - 0.5))
        stroke[_TOP] = max(0, ceil(mid_v - reach_v - 0.5))
        stroke[_BOTTOM] = min(height - 1, floor(mid_v + reach_v - 0.5))
        steep = abs(ay) > 0.05
        stroke[_SLOPE], stroke[_SPREAD] = (ax / ay, half / abs(ay)) if steep else (0.0, 0.0)
        stroke[_STRENGTH] = streak.share * pi / 4 * disc * disc * 0.9375 / (half * length)
        # lengths are counted in half-widths of the streak
        stroke[_AX], stroke[_AY], stroke[_END] = ax / half, ay / half, 0.5 * length / half


@numba.njit(**INLINED)
def _cover_share(du, dv, ax, ay, end, strength):  # type: ignore[no-untyped-def]
    """Share of a pixel that a streak hides, the pixel's centre so far from the streak's middle [1]."""
    across, along = du * ay - dv * ax, du * ax + dv * ay
    if across * across >= 1 or abs(along) >= end + 1:
        return 0.0
    swept = _swept(along + end) - _swept(along - end)
    inside = 1 - across * across
    return min(1.0, swept * strength * (inside * inside))


@numba.njit(**INLINED)
def _add_light(row, column, share, light, s, through, sums):  # type: ignore[no-untyped-def]
    a = np.float32(share)
    through[row, column] *= _ONE - a
    for c in range(4):
        sums[row, column, c] += a * light[s, c]


@numba.njit(**LAW)
def _stroke(strokes, order, light, depth, through, sums):  # type: ignore[no-untyped-def]
    for s in order:
        mid_u, mid_v, ax, ay = strokes[s, _MID_U], strokes[s, _MID_V], strokes[s, _AX], strokes[s, _AY]
        end, strength, z = strokes[s, _END], strokes[s, _STRENGTH], strokes[s, _Z]
        slope, spread = strokes[s, _SLOPE], strokes[s, _SPREAD]
        left, right = int(strokes[s, _LEFT]), int(strokes[s, _RIGHT])
        for row in range(int(strokes[s, _TOP]), int(strokes[s, _BOTTOM]) + 1):
            first, last = left, right
            dv = row + 0.5 - mid_v
            if spread > 0:
                centre = mid_u + dv * slope - 0.5
                first, last = max(first, ceil(centre - spread)), min(last, floor(centre + spread))
            for column in range(first, last + 1):
                if depth[row, column] < z:
                    continue
                share = _cover_share(column + 0.5 - mid_u, dv, ax, ay, end, strength)
                if share > 0:
                    _add_light(row, column, share, light, s, through, sums)


@numba.njit(**LAW)
def _stroke_pixel(row, column, depth, strokes, starts, listed, light, through, sums):  # type: ignore[no-untyped-def]
    block = row // BLOCK_HEIGHT * -(-depth.shape[1] // BLOCK_WIDTH) + column // BLOCK_WIDTH
    for k in range(starts[block], starts[block + 1]):
        s = listed[k]
        inside = strokes[s, _LEFT] <= column <= strokes[s, _RIGHT]
        inside &= strokes[s, _TOP] <= row <= strokes[s, _BOTTOM]
        if depth[row, column] < strokes[s, _Z] or not inside:
            continue
        du, dv = column + 0.5 - strokes[s, _MID_U], row + 0.5 - strokes[s, _MID_V]
        share = _cover_share(
            du, dv, strokes[s, _AX], strokes[s, _AY], strokes[s, _END], strokes[s, _STRENGTH]
        )
        if share > 0:
            _add_light(row, column, share, light, s, through, sums)


@numba.njit(**INLINED)
def _settle_pixel(row, column, sums, through, rgb):  # type: ignore[no-untyped-def]
    """Light of a pixel: the mean of its particles' light, as far as they hide what is behind them."""
    if sums[row, column, 3] > 0:
        scale = (1 - through[row, column]) / sums[row, column, 3]
        for c in range(3):
            rgb[row, column, c] = scale * sums[row, column, c]


@run_on_either(_settle_pixel)
@numba.njit(**LAW)
def _settle(sums, through, rgb):  # type: ignore[no-untyped-def]
    for row in range(through.shape[0]):
        for column in range(through.shape[1]):
            _settle_pixel(row, column, sums, through, rgb)
