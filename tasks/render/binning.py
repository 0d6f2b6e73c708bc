"""Which splats touch which tile of the picture, nearest first."""

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.projection import (
    COLUMN_FALLOFF,
    DEPTH,
    HALF_HEIGHT,
    HALF_WIDTH,
    LOG_ALPHA,
    LOG_CUT,
    ROW_FALLOFF,
    SLOPE,
    X,
    Y,
)

TILE_WIDTH, TILE_HEIGHT = 16, 16
"""Pixels of one tile [px]."""

_DIGIT_BITS = 11
_ZERO, _HALF, _LOG_CUT = np.float32(0), np.float32(0.5), np.float32(LOG_CUT)


@numba.njit(cache=True, nogil=True)
def depth_order(keys: NDArray[np.uint32]) -> NDArray[np.int32]:
    """Stable ascending order of the keys, by radix sort.

    Parameters
    ----------
    keys : uint32 [V] bit patterns of positive float32 depths, which sort as the depths do

    Returns
    -------
    int32 [V] indices; equal keys keep their order
    """
    n = len(keys)
    order, other = np.empty(n, dtype=np.int32), np.empty(n, dtype=np.int32)
    counts = np.zeros((3, 1 << _DIGIT_BITS), dtype=np.int64)
    mask = np.uint32((1 << _DIGIT_BITS) - 1)
    for i in range(n):
        order[i] = i
        for digit in range(3):
            counts[digit, (keys[i] >> np.uint32(digit * _DIGIT_BITS)) & mask] += 1
    for digit in range(3):
        start = 0
        for value in range(1 << _DIGIT_BITS):
            start, counts[digit, value] = start + counts[digit, value], start
        for i in range(n):
            value = (keys[order[i]] >> np.uint32(digit * _DIGIT_BITS)) & mask
            other[counts[digit, value]] = order[i]
            counts[digit, value] += 1
        order, other = other, order
    return order


@numba.njit(cache=True, nogil=True)
def bin_splats(records, order, width, height):  # type: ignore[no-untyped-def]
    """Lists of splats per tile, each in depth order.

    Parameters
    ----------
    records : float32 [V, 16] splat records
    order : int32 [V] nearest first
    width, height : picture size [px]

    Returns
    -------
    starts : int64 [tiles + 1] where each tile's list begins, tiles row by row
    splats : int32 [entries] indices into ``records``
    """
    across, down = -(-width // TILE_WIDTH), -(-height // TILE_HEIGHT)
    starts = np.zeros(across * down + 1, dtype=np.int64)
    spans = np.empty((down, 3), dtype=np.int64)
    for i in range(len(order)):
        for j in range(_tile_spans(records[i], width, height, spans)):
            for tile in range(spans[j, 0] * across + spans[j, 1], spans[j, 0] * across + spans[j, 2] + 1):
                starts[tile + 1] += 1
    for tile in range(across * down):
        starts[tile + 1] += starts[tile]
    splats = np.empty(starts[-1], dtype=np.int32)
    ends = starts[:-1].copy()
    for i in order:
        for j in range(_tile_spans(records[i], width, height, spans)):
            for tile in range(spans[j, 0] * across + spans[j, 1], spans[j, 0] * across + spans[j, 2] + 1):
                splats[ends[tile]] = i
                ends[tile] += 1
    return starts, splats


@numba.njit(cache=True, nogil=True)
def _tile_spans(splat, width, height, spans):  # type: ignore[no-untyped-def]
    """Tiles that the splat's ellipse touches: per tile row, the first and the last column.

    Within a tile row the ellipse reaches furthest right at its own rightmost point, moved into the row.
    """
    y0, half_height, slope = splat[Y], splat[HALF_HEIGHT], splat[SLOPE]
    tip = slope * half_height * half_height / splat[HALF_WIDTH]
    reach = splat[LOG_ALPHA] - _LOG_CUT
    top = max(np.ceil(y0 - half_height - _HALF), _ZERO)
    bottom = min(np.floor(y0 + half_height - _HALF), np.float32(height - 1))
    count = 0
    for row in range(int(top) // TILE_HEIGHT, int(bottom) // TILE_HEIGHT + 1):
        low = max(np.float32(row * TILE_HEIGHT), top) + _HALF - y0
        high = min(np.float32(row * TILE_HEIGHT + TILE_HEIGHT - 1), bottom) + _HALF - y0
        dy = min(max(tip, low), high)
        right = slope * dy + np.sqrt(max(reach - splat[ROW_FALLOFF] * dy * dy, _ZERO) / splat[COLUMN_FALLOFF])
        dy = min(max(-tip, low), high)
        left = slope * dy - np.sqrt(max(reach - splat[ROW_FALLOFF] * dy * dy, _ZERO) / splat[COLUMN_FALLOFF])
        first = max(np.ceil(splat[X] + left - _HALF), _ZERO)
        last = min(np.floor(splat[X] + right - _HALF), np.float32(width - 1))
        if first <= last:
            spans[count, 0] = row
            spans[count, 1] = int(first) // TILE_WIDTH
            spans[count, 2] = int(last) // TILE_WIDTH
            count += 1
    return count


def tile_lists(
    records: NDArray[np.float32], width: int, height: int
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Depth-ordered splat lists of every tile; see `bin_splats`."""
    order = depth_order(np.ascontiguousarray(records[:, DEPTH]).view(np.uint32))
    starts, splats = bin_splats(records, order, width, height)
    return starts, splats
