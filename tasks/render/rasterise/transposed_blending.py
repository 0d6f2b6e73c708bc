"""The transpose of blending: sums over the pixels of weight times residual, tile by tile."""

import numba
import numpy as np

from tasks.render.rasterise.binning import TILE_HEIGHT, TILE_WIDTH
from tasks.render.rasterise.projection import COLUMN_FALLOFF
from tasks.render.rasterise.strips import (
    BATCH,
    PLANE,
    absorb_light,
    find_open_rows,
    list_strips,
    new_strips,
    open_tile,
)

_ZERO = np.float32(0)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def blend_transposed(records, starts, splats, residual, sums):  # type: ignore[no-untyped-def]
    """For every splat and channel, add the sum over all pixels of weight times residual.

    Parameters
    ----------
    records : float32 [V, 16] splat records
    starts, splats : tile lists, see `tasks.render.rasterise.binning.bin_splats`
    residual : float32 [H, W, C] per pixel
    sums : float64 [V, C] added to
    """
    height, width, channels = residual.shape
    across = -(-width // TILE_WIDTH)
    s = np.empty((1 + channels) * PLANE, dtype=np.float32)
    weights = np.empty(TILE_WIDTH, dtype=np.float32)
    strips = new_strips()
    for tile in range(len(starts) - 1):
        x_tile, y_tile = (tile % across) * TILE_WIDTH, (tile // across) * TILE_HEIGHT
        row_count, column_count = min(TILE_HEIGHT, height - y_tile), min(TILE_WIDTH, width - x_tile)
        open_tile(s, row_count, column_count)
        for c in range(channels):
            for y in range(row_count):
                for x in range(column_count):
                    s[(1 + c) * PLANE + y * TILE_WIDTH + x] = residual[y_tile + y, x_tile + x, c]
        start, last = starts[tile], starts[tile + 1]
        while start < last and find_open_rows(s, strips.is_open) > 0:
            end = min(start + BATCH, last)
            listed = list_strips(records, splats, start, end, x_tile, y_tile, strips)
            _gather_strips(s, records, listed, strips, weights, sums)
            start = end


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _gather_strips(s, records, listed, strips, weights, sums):  # type: ignore[no-untyped-def]
    for i in range(listed):
        splat, first = np.uint64(strips.splat[i]), np.uint64(strips.pixel[i])
        middle, log_alpha, falloff = strips.middle[i], strips.log_alpha[i], records[splat, COLUMN_FALLOFF]
        for x in range(TILE_WIDTH):
            l = first + np.uint64(x)
            dx = np.float32(x) - middle
            weights[x], s[l] = absorb_light(log_alpha - falloff * dx * dx, s[l])
        for c in range(sums.shape[1]):
            plane = np.uint64((1 + c) * PLANE) + first
            # Four running sums, which do not wait for one another.
            t0, t1, t2, t3 = _ZERO, _ZERO, _ZERO, _ZERO
            for x in range(0, TILE_WIDTH, 4):
                l = plane + np.uint64(x)
                t0 += weights[x] * s[l]
                t1 += weights[x + 1] * s[l + np.uint64(1)]
                t2 += weights[x + 2] * s[l + np.uint64(2)]
                t3 += weights[x + 3] * s[l + np.uint64(3)]
            sums[splat, c] += (t0 + t1) + (t2 + t3)
