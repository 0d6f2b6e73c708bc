"""Front-to-back blending of depth-ordered splats, tile by tile, and its transpose.

Pixel centres lie at +0.5; opacity is at most 0.999; a splat counts where its opacity is at least 1/255;
a pixel closes before the splat that would bring its transmittance to 1e-4 or below.
"""

import numba
import numpy as np

from tasks.render.binning import TILE_HEIGHT, TILE_WIDTH
from tasks.render.projection import (
    CLASS,
    COLUMN_FALLOFF,
    DEPTH,
    LOG_ALPHA,
    LOG_CUT,
    RECORD,
    ROW_FALLOFF,
    SLOPE,
    X,
    Y,
)

LANES = 8
BATCH = 64
PIXELS = TILE_WIDTH * TILE_HEIGHT
FEATURES = CLASS - DEPTH
"""Depth, three colours and three normal components: the columns of a record that blend."""
_MAX_ALPHA, _STOP = np.float32(0.999), np.float32(1e-4)
_LOG_CUT = np.float32(LOG_CUT)
_ZERO, _HALF, _ONE = (np.float32(c) for c in (0, 0.5, 1))
# Minimax fit of exp(x) on [-ln(255)/16, 0] with value 1 at 0; its 16th power is exp to 3.4e-6 relative.
_E1, _E2, _E3, _E4 = (
    np.float32(c) for c in (0.9999923298856865, 0.499785338077005, 0.1647944853931433, 0.03514230867353842)
)
_SIXTEENTH = np.float32(1 / 16)

# Planes of a tile's state, PIXELS floats each: the transmittance, negative once the pixel is closed,
# the class at half transmittance, then the blended features.
_TRANSMITTANCE, _CLASS, _BLENDED = 0, PIXELS, 2 * PIXELS


@numba.njit(cache=True, nogil=True)
def _exp(p):  # type: ignore[no-untyped-def]
    x = p * _SIXTEENTH
    e = _ONE + x * (_E1 + x * (_E2 + x * (_E3 + x * _E4)))
    e *= e
    e *= e
    e *= e
    return e * e


@numba.njit(cache=True, nogil=True)
def blend(records, starts, splats, width, height):  # type: ignore[no-untyped-def]
    out = np.zeros((height, width, FEATURES + 2), dtype=np.float32)
    across = -(-width // TILE_WIDTH)
    s = np.empty((2 + FEATURES) * PIXELS, dtype=np.float32)
    for tile in range(len(starts) - 1):
        x_tile, y_tile = (tile % across) * TILE_WIDTH, (tile // across) * TILE_HEIGHT
        s[:] = _ZERO
        for l in range(PIXELS):
            s[l] = _ONE
        for i in range(starts[tile], starts[tile + 1]):
            r = records[splats[i]]
            for y in range(TILE_HEIGHT):
                dy = np.float32(y_tile + y) + _HALF - r[Y]
                row = r[LOG_ALPHA] - r[ROW_FALLOFF] * dy * dy
                if row < _LOG_CUT:
                    continue
                x0 = r[X] + r[SLOPE] * dy - np.float32(x_tile) - _HALF
                for x in range(TILE_WIDTH):
                    l = y * TILE_WIDTH + x
                    t = np.float32(x) - x0
                    p = row - r[COLUMN_FALLOFF] * t * t
                    a = min(_exp(p), _MAX_ALPHA)
                    before = s[l]
                    after = before * (_ONE - a)
                    drawn = p >= _LOG_CUT
                    opened = drawn & (after > _STOP)
                    w = before * a if opened else _ZERO
                    s[l] = after if opened else (-abs(before) if drawn else before)
                    s[_CLASS + l] = r[CLASS] if opened & (before >= _HALF) else s[_CLASS + l]
                    for f in range(FEATURES):
                        s[_BLENDED + f * PIXELS + l] += w * r[DEPTH + f]
        for y in range(min(TILE_HEIGHT, height - y_tile)):
            for x in range(min(TILE_WIDTH, width - x_tile)):
                l = y * TILE_WIDTH + x
                out[y_tile + y, x_tile + x, 0] = abs(s[l])
                out[y_tile + y, x_tile + x, 1] = s[_CLASS + l]
                for f in range(FEATURES):
                    out[y_tile + y, x_tile + x, 2 + f] = s[_BLENDED + f * PIXELS + l]
    return out


@numba.njit(cache=True, nogil=True)
def blend_transposed(records, starts, splats, residual, sums):  # type: ignore[no-untyped-def]
    height, width, channels = residual.shape
    across = -(-width // TILE_WIDTH)
    s = np.empty((1 + channels) * PIXELS, dtype=np.float32)
    for tile in range(len(starts) - 1):
        x_tile, y_tile = (tile % across) * TILE_WIDTH, (tile // across) * TILE_HEIGHT
        s[:] = _ZERO
        for y in range(min(TILE_HEIGHT, height - y_tile)):
            for x in range(min(TILE_WIDTH, width - x_tile)):
                l = y * TILE_WIDTH + x
                s[l] = _ONE
                for f in range(channels):
                    s[(1 + f) * PIXELS + l] = residual[y_tile + y, x_tile + x, f]
        for i in range(starts[tile], starts[tile + 1]):
            r = records[splats[i]]
            for y in range(TILE_HEIGHT):
                dy = np.float32(y_tile + y) + _HALF - r[Y]
                row = r[LOG_ALPHA] - r[ROW_FALLOFF] * dy * dy
                if row < _LOG_CUT:
                    continue
                x0 = r[X] + r[SLOPE] * dy - np.float32(x_tile) - _HALF
                for x in range(TILE_WIDTH):
                    l = y * TILE_WIDTH + x
                    t = np.float32(x) - x0
                    p = row - r[COLUMN_FALLOFF] * t * t
                    if p < _LOG_CUT or s[l] <= _ZERO:
                        continue
                    a = min(_exp(p), _MAX_ALPHA)
                    after = s[l] * (_ONE - a)
                    if after <= _STOP:
                        s[l] = -s[l]
                        continue
                    w = s[l] * a
                    s[l] = after
                    sums[splats[i], channels] += w
                    for f in range(channels):
                        sums[splats[i], f] += w * s[(1 + f) * PIXELS + l]
