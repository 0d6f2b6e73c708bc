"""The derivative of blending with respect to each Gaussian's colour, opacity and place.

The picture is ``C = sum_i T_i a_i c_i + T_end sky`` with ``T_i`` the transmittance in front of Gaussian i.
Then ``dC/dc_i = T_i a_i`` and ``dC/da_i = T_i (c_i - B_i)``, where ``B_i`` is what is seen behind Gaussian i.
Front to back, ``B_i`` is the finished picture less what has been blended so far, over the transmittance left.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.rasterise.binning import TILE_HEIGHT, TILE_WIDTH, tile_lists
from tasks.render.rasterise.projection import (
    COLUMN_FALLOFF,
    HALF_HEIGHT,
    LOG_ALPHA,
    LOG_CUT,
    RED,
    ROW_FALLOFF,
    SLOPE,
    X,
    Y,
)

COLOUR, WEIGHT, OPACITY, OPACITY_SQUARE, ALONG_X, ALONG_Y, SQUARE_XX, SQUARE_XY, SQUARE_YY = (
    0,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
)
"""Columns of the sums per splat; colour has three."""
SUMS = 11

_PLANE = TILE_WIDTH * TILE_HEIGHT + 16
# the first plane is the light that is left
_RED, _GREEN, _BLUE, _MISS_RED, _MISS_GREEN, _MISS_BLUE, _WEIGHT = (
    np.uint64(k * _PLANE) for k in range(1, 8)
)
_LOG_CUT, _ZERO, _HALF, _ONE, _TWO = (np.float32(c) for c in (LOG_CUT, 0, 0.5, 1, 2))
_MAX_ALPHA, _TINY, _DARK = (np.float32(c) for c in (0.999, 1e-4, 0.01))
_SHARE, _SIXTH, _TWENTYFOURTH = (np.float32(1 / n) for n in (64, 6, 24))
_BOTTOM = np.float32(TILE_HEIGHT - 1)


class _Tile(NamedTuple):
    """A tile's part of the splat list, and its first column and row [px]."""

    start: int
    end: int
    x: int
    y: int


def blend_and_derive(
    records: NDArray[np.float32],
    target: NDArray[np.float32],
    weight: NDArray[np.float32],
    sky: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the blended picture, and per splat the sums of derivative times residual and of derivative squared.

    Parameters
    ----------
    records : float32 [V, 16] splats, from `tasks.render.rasterise.projection.project_gaussians`
    target : float32 [H, W, 3] the target picture; where negative, any value above its modulus matches
    weight : float32 [H, W] of a pixel's squared residual [1]
    sky : float32 [H, W, 3] what is seen where no splat is [1]

    Returns
    -------
    picture : float32 [H, W, 4] blended colour over the sky, and the transmittance left
    sums : float32 [V, 11] columns as named in this module: for the colour, blend weight times residual per
        channel and blend weight; for the logarithm of opacity and the place in the picture [px], derivative
        times residual, and products of derivatives
    """
    height, width = weight.shape
    starts, splats = tile_lists(records, width, height)
    planes = np.concatenate([target, weight[..., None], sky], axis=2)
    return _blend_and_derive(records, starts, splats, planes)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _opacity_of_logarithm(p):  # type: ignore[no-untyped-def]
    """Return the opacity of logarithm p, 0 where the rasteriser draws nothing: the 64th power of four Taylor terms.

    The library's exponential would prevent vectorisation of the loops; the error of this one is 3e-6.
    """
    x = p * _SHARE
    e = _ONE + x * (_ONE + x * (_HALF + x * (_SIXTH + x * _TWENTYFOURTH)))
    e *= e
    e *= e
    e *= e
    e *= e
    e *= e
    e *= e
    return min(e, _MAX_ALPHA) if p >= _LOG_CUT else _ZERO


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _blend_and_derive(records, starts, splats, planes):  # type: ignore[no-untyped-def]
    height, width = planes.shape[:2]
    per_row = -(-width // TILE_WIDTH)
    sums = np.zeros((len(records), SUMS), dtype=np.float32)
    picture = np.empty((height, width, 4), dtype=np.float32)
    s = np.empty(8 * _PLANE, dtype=np.float32)
    lanes = np.empty(SUMS * TILE_WIDTH, dtype=np.float32)
    for tile in range(len(starts) - 1):
        x_tile, y_tile = (tile % per_row) * TILE_WIDTH, (tile // per_row) * TILE_HEIGHT
        rows, columns = min(TILE_HEIGHT, height - y_tile), min(TILE_WIDTH, width - x_tile)
        s[:] = _ZERO
        for y in range(rows):
            for x in range(columns):
                s[np.uint64(y * TILE_WIDTH + x)] = _ONE
        part = _Tile(starts[tile], starts[tile + 1], x_tile, y_tile)
        last = _blend_tile(s, records, splats, part)
        for y in range(rows):
            for x in range(columns):
                l = np.uint64(y * TILE_WIDTH + x)
                i, j = y_tile + y, x_tile + x
                q = planes[i, j, 3]
                picture[i, j, 3] = s[l]
                for c in range(3):
                    value = s[_RED + np.uint64(c * _PLANE) + l] + s[l] * planes[i, j, 4 + c]
                    wanted = planes[i, j, c]
                    picture[i, j, c] = value
                    s[_RED + np.uint64(c * _PLANE) + l] = value
                    miss = wanted - value if wanted >= _ZERO else max(-wanted - value, _ZERO)
                    s[_MISS_RED + np.uint64(c * _PLANE) + l] = miss
                s[_WEIGHT + l] = q
                s[l] = _ONE
        _derive_tile(s, lanes, records, splats, _Tile(part.start, last, x_tile, y_tile), sums)
    return picture, sums


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _row_range(records, splat, y_tile):  # type: ignore[no-untyped-def]
    y0 = records[splat, Y] - np.float32(y_tile) - _HALF
    half_height = records[splat, HALF_HEIGHT]
    return int(np.ceil(max(y0 - half_height, _ZERO))), int(np.floor(min(y0 + half_height, _BOTTOM)))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _blend_tile(s, records, splats, tile):  # type: ignore[no-untyped-def]
    """Blend colours front to back; return the end of the splats that still received light."""
    start, end, x_tile, y_tile = tile
    for i in range(start, end):
        if (i - start) % 64 == 0:
            open_pixels = 0
            for pixel in range(TILE_WIDTH * TILE_HEIGHT):
                open_pixels += s[pixel] > _DARK
            if open_pixels == 0:
                return i
        splat = np.uint64(splats[i])
        first, final = _row_range(records, splat, y_tile)
        r, g, b, falloff = (
            records[splat, RED],
            records[splat, RED + 1],
            records[splat, RED + 2],
            records[splat, COLUMN_FALLOFF],
        )
        for y in range(first, final + 1):
            dy = np.float32(y_tile + y) + _HALF - records[splat, Y]
            row = records[splat, LOG_ALPHA] - records[splat, ROW_FALLOFF] * dy * dy
            middle = records[splat, X] + records[splat, SLOPE] * dy - np.float32(x_tile) - _HALF
            base = np.uint64(y * TILE_WIDTH)
            for x in range(TILE_WIDTH):
                l = base + np.uint64(x)
                dx = np.float32(x) - middle
                w = s[l] * _opacity_of_logarithm(row - falloff * dx * dx)
                s[l] -= w
                s[_RED + l] += w * r
                s[_GREEN + l] += w * g
                s[_BLUE + l] += w * b
    return end


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _derive_tile(s, lanes, records, splats, tile, sums):  # type: ignore[no-untyped-def]
    start, end, x_tile, y_tile = tile
    for i in range(start, end):
        splat = np.uint64(splats[i])
        first, final = _row_range(records, splat, y_tile)
        r, g, b, falloff = (
            records[splat, RED],
            records[splat, RED + 1],
            records[splat, RED + 2],
            records[splat, COLUMN_FALLOFF],
        )
        slope = records[splat, SLOPE]
        lanes[:] = _ZERO
        for y in range(first, final + 1):
            dy = np.float32(y_tile + y) + _HALF - records[splat, Y]
            row = records[splat, LOG_ALPHA] - records[splat, ROW_FALLOFF] * dy * dy
            middle = records[splat, X] + slope * dy - np.float32(x_tile) - _HALF
            base = np.uint64(y * TILE_WIDTH)
            down = _TWO * records[splat, ROW_FALLOFF] * dy
            for x in range(TILE_WIDTH):
                l = base + np.uint64(x)
                dx = np.float32(x) - middle
                before = s[l]
                a = _opacity_of_logarithm(row - falloff * dx * dx)
                w = before * a
                after = before - w
                s[l] = after
                # The finished picture less this splat, over the light left, is the colour behind the splat.
                left_r, left_g, left_b = s[_RED + l] - w * r, s[_GREEN + l] - w * g, s[_BLUE + l] - w * b
                s[_RED + l], s[_GREEN + l], s[_BLUE + l] = left_r, left_g, left_b
                share = before / max(after, _TINY)
                dr, dg, db = (
                    before * r - share * left_r,
                    before * g - share * left_g,
                    before * b - share * left_b,
                )
                miss_r, miss_g, miss_b = s[_MISS_RED + l], s[_MISS_GREEN + l], s[_MISS_BLUE + l]
                wq, aq = w * s[_WEIGHT + l], (a if before > _DARK else _ZERO) * s[_WEIGHT + l]
                gain = aq * (dr * miss_r + dg * miss_g + db * miss_b)
                square = aq * a * (dr * dr + dg * dg + db * db)
                across = _TWO * falloff * dx
                along = down - across * slope
                k = np.uint64(x)
                lanes[k] += wq * miss_r
                lanes[np.uint64(TILE_WIDTH) + k] += wq * miss_g
                lanes[np.uint64(2 * TILE_WIDTH) + k] += wq * miss_b
                lanes[np.uint64(WEIGHT * TILE_WIDTH) + k] += wq
                lanes[np.uint64(OPACITY * TILE_WIDTH) + k] += gain
                lanes[np.uint64(OPACITY_SQUARE * TILE_WIDTH) + k] += square
                lanes[np.uint64(ALONG_X * TILE_WIDTH) + k] += gain * across
                lanes[np.uint64(ALONG_Y * TILE_WIDTH) + k] += gain * along
                lanes[np.uint64(SQUARE_XX * TILE_WIDTH) + k] += square * across * across
                lanes[np.uint64(SQUARE_XY * TILE_WIDTH) + k] += square * across * along
                lanes[np.uint64(SQUARE_YY * TILE_WIDTH) + k] += square * along * along
        for column in range(SUMS):
            total = _ZERO
            for x in range(TILE_WIDTH):
                total += lanes[column * TILE_WIDTH + x]
            sums[splat, column] += total
