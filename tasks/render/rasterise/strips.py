"""Strips of a tile: which rows of pixels the splats of a batch reach, and how much light each pixel lets through.

Rules: pixel centres at +0.5; opacity at most 0.999; a splat counts where its opacity is at least 1/255;
a pixel closes before the splat that would bring its transmittance to 1e-4 or below.

Work goes by strips, one row of a tile, as wide as the widest vector register. For a batch of splats the
strips that each one reaches are listed first; a second loop, free of unpredictable branches, blends them
(`blending`) or sums over them (`splat_back`). All state of a tile lies in one flat array, so that the
compiler can see that nothing overlaps. No fast-math flag is set: every operation of the kernels rounds as
IEEE 754 says, whatever the processor.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.rasterise.binning import TILE_HEIGHT, TILE_WIDTH
from tasks.render.rasterise.projection import (
    COLUMN_FALLOFF,
    HALF_HEIGHT,
    LOG_ALPHA,
    LOG_CUT,
    ROW_FALLOFF,
    SLOPE,
    X,
    Y,
)

MAX_ALPHA, STOP = 0.999, 1e-4
"""Largest opacity of one splat at one pixel, and the transmittance at which a pixel closes [1]."""

BATCH = 64
"""Splats whose strips are listed at once [1]."""
PIXELS = TILE_WIDTH * TILE_HEIGHT
"""Pixels of one tile [px]."""
PLANE = PIXELS + 16
"""Length of a plane of a tile's state; the first plane is the transmittance in front of the next splat. One cache
line more than a power of two, so that they do not evict one another."""

_MAX_ALPHA, _STOP, _LOG_CUT = np.float32(MAX_ALPHA), np.float32(STOP), np.float32(LOG_CUT)
_ZERO, _HALF, _ONE = np.float32(0), np.float32(0.5), np.float32(1)
_RIGHT, _BOTTOM = np.float32(TILE_WIDTH - 1), np.float32(TILE_HEIGHT - 1)
# Minimax fit of exp(x) on [-ln(255)/16, 0] with value 1 at 0; its 16th power is exp to 4e-6 relative.
_E1, _E2, _E3, _E4 = (
    np.float32(c) for c in (0.9999923298856865, 0.499785338077005, 0.1647944853931433, 0.03514230867353842)
)
_SIXTEENTH = np.float32(1 / 16)


class Strips(NamedTuple):
    """The strips of one batch of splats, and the scratch space to list them.

    Parameters
    ----------
    splat : its record
    pixel : first pixel of the strip within the tile
    middle : where the splat's middle crosses the row, from that pixel [px]
    log_alpha : logarithm of the splat's opacity there
    rows : first and last row of each splat of the batch
    is_open : rows of the tile where light still passes
    """

    splat: NDArray[np.uint32]
    pixel: NDArray[np.uint32]
    middle: NDArray[np.float32]
    log_alpha: NDArray[np.float32]
    rows: NDArray[np.int64]
    is_open: NDArray[np.bool_]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def absorb_light(p, before):  # type: ignore[no-untyped-def]
    """Return the blend weight of a splat with logarithmic opacity p, and the transmittance behind it.

    Once a pixel's transmittance is down at the stop it stays there, so no splat behind gets a weight.
    """
    x = p * _SIXTEENTH
    xx = x * x
    e = (_ONE + x * _E1) + xx * ((_E2 + x * _E3) + xx * _E4)
    e *= e
    e *= e
    e *= e
    e *= e
    weight = before * (min(e, _MAX_ALPHA) if p >= _LOG_CUT else _ZERO)
    after = before - weight
    return weight if after > _STOP else _ZERO, after


@numba.njit(cache=True, nogil=True, error_model="numpy")
def open_tile(s, rows, columns):  # type: ignore[no-untyped-def]
    """Reset the state: transmittance 1 inside the picture, 0 in the part of the tile beyond it."""
    s[:] = _ZERO
    for y in range(rows):
        for x in range(columns):
            s[y * TILE_WIDTH + x] = _ONE


@numba.njit(cache=True, nogil=True, error_model="numpy")
def find_open_rows(s, is_open):  # type: ignore[no-untyped-def]
    """Mark the rows where light still passes; return the number of pixels where it does."""
    total = 0
    for y in range(TILE_HEIGHT):
        count = 0
        for x in range(TILE_WIDTH):
            count += s[y * TILE_WIDTH + x] > _STOP
        is_open[y] = count > 0
        total += count
    return total


@numba.njit(cache=True, nogil=True, error_model="numpy")
def new_strips():  # type: ignore[no-untyped-def]
    """Return room for the strips of a batch."""
    size = BATCH * TILE_HEIGHT + 1
    return Strips(
        np.empty(size, np.uint32),
        np.empty(size, np.uint32),
        np.empty(size, np.float32),
        np.empty(size, np.float32),
        np.empty((BATCH, 2), np.int64),
        np.empty(TILE_HEIGHT, np.bool_),
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def list_strips(records, splats, start, end, x_tile, y_tile, strips):  # type: ignore[no-untyped-def]
    """List the open strips that the splats ``splats[start:end]`` reach, nearest splat first."""
    x_first, y_first = np.float32(x_tile) + _HALF, np.float32(y_tile) + _HALF
    rows, is_open = strips.rows, strips.is_open
    # A separate loop, so that the cache misses of a whole batch overlap.
    for i in range(end - start):
        splat = np.uint64(splats[start + i])
        y0, half_height = records[splat, Y] - y_first, records[splat, HALF_HEIGHT]
        rows[i, 0] = int(np.ceil(max(y0 - half_height, _ZERO)))
        rows[i, 1] = int(np.floor(min(y0 + half_height, _BOTTOM)))
    listed = np.uint64(0)
    for i in range(end - start):
        splat = np.uint64(splats[start + i])
        x0, y0 = records[splat, X] - x_first, records[splat, Y] - y_first
        slope, log_alpha = records[splat, SLOPE], records[splat, LOG_ALPHA]
        row_falloff, falloff = records[splat, ROW_FALLOFF], records[splat, COLUMN_FALLOFF]
        for y in range(rows[i, 0], rows[i, 1] + 1):
            dy = np.float32(y) - y0
            p = log_alpha - row_falloff * dy * dy
            middle = x0 + slope * dy
            off = min(max(np.rint(middle), _ZERO), _RIGHT) - middle
            strips.splat[listed] = splat
            strips.pixel[listed] = y * TILE_WIDTH
            strips.middle[listed] = middle
            strips.log_alpha[listed] = p
            # Counting instead of branching: the next strip overwrites one that is not wanted.
            listed += np.uint64((p - falloff * off * off >= _LOG_CUT) & is_open[y])
    return np.int64(listed)
