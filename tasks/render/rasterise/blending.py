"""Front-to-back blending of depth-ordered splats, tile by tile, and its transpose.

Rules: pixel centres at +0.5; opacity at most 0.999; a splat counts where its opacity is at least 1/255;
a pixel closes before the splat that would bring its transmittance to 1e-4 or below.

Work goes by strips, one row of a tile, as wide as the widest vector register. For a batch of splats the
strips that each one reaches are listed first; a second loop, free of unpredictable branches, blends them.
All state of a tile lies in one flat array, so that the compiler can see that nothing overlaps. No
fast-math flag is set: every operation of the kernels rounds as IEEE 754 says, whatever the processor.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.rasterise.binning import TILE_HEIGHT, TILE_WIDTH
from tasks.render.rasterise.projection import (
    BLUE,
    CLASS,
    COLUMN_FALLOFF,
    DEPTH,
    DISTANCE,
    GREEN,
    HALF_HEIGHT,
    LOG_ALPHA,
    LOG_CUT,
    NORMAL_X,
    NORMAL_Y,
    NORMAL_Z,
    RED,
    ROW_FALLOFF,
    SLOPE,
    X,
    Y,
)

MAX_ALPHA, STOP = 0.999, 1e-4
"""Largest opacity of one splat at one pixel, and the transmittance at which a pixel closes [1]."""

_BATCH = 64
PIXELS = TILE_WIDTH * TILE_HEIGHT
"""Pixels of one tile [px]."""
# Planes of a tile's state; the first is the transmittance in front of the next splat. One cache line more
# than a power of two, so that they do not evict one another.
# Offsets are unsigned: a signed index may be negative, and the compiler would gather pixel by pixel.
_PLANE = PIXELS + 16
_FRONT, _ALPHA, _DEPTH, _RED, _GREEN, _BLUE, _NX, _NY, _NZ = (np.uint64(k * _PLANE) for k in range(1, 10))
_STATE = 10 * _PLANE
_FIRST = np.uint64(1)  # splats are counted from 1 in the plane _FRONT, exact in single precision up to 2^24

SURFACE_RATIO = 1.25
"""Where a splat's plane is nearer or further than its centre by more than this, the disc is nearly edge-on,
and its centre's depth counts [1]."""

_MAX_ALPHA, _STOP, _LOG_CUT = np.float32(MAX_ALPHA), np.float32(STOP), np.float32(LOG_CUT)
_ZERO, _HALF, _ONE = np.float32(0), np.float32(0.5), np.float32(1)
_RATIO = np.float32(SURFACE_RATIO)
_RIGHT, _BOTTOM = np.float32(TILE_WIDTH - 1), np.float32(TILE_HEIGHT - 1)
# Minimax fit of exp(x) on [-ln(255)/16, 0] with value 1 at 0; its 16th power is exp to 4e-6 relative.
_E1, _E2, _E3, _E4 = (
    np.float32(c) for c in (0.9999923298856865, 0.499785338077005, 0.1647944853931433, 0.03514230867353842)
)
_SIXTEENTH = np.float32(1 / 16)


class Buffers(NamedTuple):
    """The arrays of a `GBuffer`, as the kernel fills them."""

    rgb: NDArray[np.float32]
    depth: NDArray[np.float32]
    expected_depth: NDArray[np.float32]
    alpha: NDArray[np.float32]
    normal: NDArray[np.float32]
    class_id: NDArray[np.uint8]


class _Strips(NamedTuple):
    """The strips of one batch of splats, and the scratch space to list them.

    Parameters
    ----------
    entry : place of the splat in the tile's list
    pixel : first pixel of the strip within the tile
    middle : where the splat's middle crosses the row, from that pixel [px]
    log_alpha : logarithm of the splat's opacity there
    rows : first and last row of each splat of the batch
    is_open : rows of the tile where light still passes
    """

    entry: NDArray[np.int64]
    pixel: NDArray[np.int64]
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
def _open_tile(s, rows, columns):  # type: ignore[no-untyped-def]
    """Reset the state: transmittance 1 inside the picture, 0 in the part of the tile beyond it."""
    s[:] = _ZERO
    for y in range(rows):
        for x in range(columns):
            s[y * TILE_WIDTH + x] = _ONE


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _find_open_rows(s, is_open):  # type: ignore[no-untyped-def]
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
def _new_strips():  # type: ignore[no-untyped-def]
    size = _BATCH * TILE_HEIGHT + 1
    return _Strips(
        np.empty(size, np.int64),
        np.empty(size, np.int64),
        np.empty(size, np.float32),
        np.empty(size, np.float32),
        np.empty((_BATCH, 2), np.int64),
        np.empty(TILE_HEIGHT, np.bool_),
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _list_strips(records, splats, start, end, x_tile, y_tile, strips):  # type: ignore[no-untyped-def]
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
        slope, falloff, log_alpha = (
            records[splat, SLOPE],
            records[splat, ROW_FALLOFF],
            records[splat, LOG_ALPHA],
        )
        spread = _ONE / records[splat, COLUMN_FALLOFF]
        for y in range(rows[i, 0], rows[i, 1] + 1):
            dy = np.float32(y) - y0
            p = log_alpha - falloff * dy * dy
            middle = x0 + slope * dy
            half = np.sqrt(max(p - _LOG_CUT, _ZERO) * spread)
            left, right = np.ceil(max(middle - half, _ZERO)), np.floor(min(middle + half, _RIGHT))
            strips.entry[listed] = start + i
            strips.pixel[listed] = y * TILE_WIDTH
            strips.middle[listed] = middle
            strips.log_alpha[listed] = p
            # Counting instead of branching: the next strip overwrites one that is not wanted.
            listed += np.uint64((left <= right) & is_open[y])
    return np.int64(listed)


def _compile_blend_strips(normals):  # type: ignore[no-untyped-def]
    """Return the inner loop with or without normals: decided when it is compiled, it costs no branch."""

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def blend_strips(s, records, splats, listed, strips):  # type: ignore[no-untyped-def]
        for i in range(listed):
            splat, first = np.uint64(splats[strips.entry[i]]), np.uint64(strips.pixel[i])
            middle, log_alpha, falloff = strips.middle[i], strips.log_alpha[i], records[splat, COLUMN_FALLOFF]
            z, number = records[splat, DEPTH], np.float32(splat + _FIRST)
            r, g, b = records[splat, RED], records[splat, GREEN], records[splat, BLUE]
            nx, ny, nz = records[splat, NORMAL_X], records[splat, NORMAL_Y], records[splat, NORMAL_Z]
            for x in range(TILE_WIDTH):
                l = first + np.uint64(x)
                dx = np.float32(x) - middle
                before = s[l]
                w, after = absorb_light(log_alpha - falloff * dx * dx, before)
                s[l] = after
                s[_FRONT + l] += number if (before >= _HALF) & (after < _HALF) else _ZERO
                s[_ALPHA + l] += w
                s[_DEPTH + l] += w * z
                s[_RED + l] += w * r
                s[_GREEN + l] += w * g
                s[_BLUE + l] += w * b
                if normals:
                    s[_NX + l] += w * nx
                    s[_NY + l] += w * ny
                    s[_NZ + l] += w * nz

    return blend_strips


_blend_strips, _blend_strips_flat = _compile_blend_strips(True), _compile_blend_strips(False)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _plane_depth(record, rays, u, v):  # type: ignore[no-untyped-def]
    """Return camera z of a splat's plane at picture point (u, v); of its centre if the plane is nearly edge-on."""
    slant = (
        record[NORMAL_X] * (rays[0, 0] * u + rays[1, 0] * v + rays[2, 0])
        + record[NORMAL_Y] * (rays[0, 1] * u + rays[1, 1] * v + rays[2, 1])
        + record[NORMAL_Z] * (rays[0, 2] * u + rays[1, 2] * v + rays[2, 2])
    )
    plane, centre = record[DISTANCE] / slant, record[DEPTH]
    return plane if (plane < centre * _RATIO) & (centre < plane * _RATIO) else centre


@numba.njit(cache=True, nogil=True, error_model="numpy")
def blend_tiles(records, rays, starts, splats, normals, buffers):  # type: ignore[no-untyped-def]
    """Blend every tile and write the finished buffers of `GBuffer`.

    Parameters
    ----------
    records : float32 [V, 16] splat records
    rays : float32 [3, 3] world directions of the picture, see `View.rays` [1]
    starts, splats : tile lists, see `tasks.render.rasterise.binning.bin_splats`
    normals : False leaves the normals 0, for a fifth less time
    buffers : overwritten
    """
    rgb, depth, expected_depth, alpha, normal, class_id = buffers
    height, width = alpha.shape
    across = -(-width // TILE_WIDTH)
    s = np.empty(_STATE, dtype=np.float32)
    strips = _new_strips()
    for tile in range(len(starts) - 1):
        x_tile, y_tile = (tile % across) * TILE_WIDTH, (tile // across) * TILE_HEIGHT
        row_count, column_count = min(TILE_HEIGHT, height - y_tile), min(TILE_WIDTH, width - x_tile)
        _open_tile(s, row_count, column_count)
        start, last = starts[tile], starts[tile + 1]
        while start < last and _find_open_rows(s, strips.is_open) > 0:
            end = min(start + _BATCH, last)
            listed = _list_strips(records, splats, start, end, x_tile, y_tile, strips)
            if normals:
                _blend_strips(s, records, splats, listed, strips)
            else:
                _blend_strips_flat(s, records, splats, listed, strips)
            start = end
        for y in range(row_count):
            for x in range(column_count):
                l = np.uint64(y * TILE_WIDTH + x)
                i, j = y_tile + y, x_tile + x
                nx, ny, nz = s[_NX + l], s[_NY + l], s[_NZ + l]
                length = np.sqrt(nx * nx + ny * ny + nz * nz)
                scale = _ONE / length if length > _ZERO else _ZERO
                alpha[i, j] = s[_ALPHA + l]
                z = s[_DEPTH + l] / s[_ALPHA + l]  # NaN where no splat contributes
                expected_depth[i, j] = z
                class_id[i, j] = 0
                front = np.int64(s[_FRONT + l]) - 1
                if front >= 0:
                    class_id[i, j] = np.uint8(records[front, CLASS])
                    z = _plane_depth(records[front], rays, np.float32(j) + _HALF, np.float32(i) + _HALF)
                depth[i, j] = z
                rgb[i, j, 0], rgb[i, j, 1], rgb[i, j, 2] = s[_RED + l], s[_GREEN + l], s[_BLUE + l]
                normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = nx * scale, ny * scale, nz * scale


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
    s = np.empty((1 + channels) * _PLANE, dtype=np.float32)
    weights = np.empty(TILE_WIDTH, dtype=np.float32)
    strips = _new_strips()
    for tile in range(len(starts) - 1):
        x_tile, y_tile = (tile % across) * TILE_WIDTH, (tile // across) * TILE_HEIGHT
        row_count, column_count = min(TILE_HEIGHT, height - y_tile), min(TILE_WIDTH, width - x_tile)
        _open_tile(s, row_count, column_count)
        for c in range(channels):
            for y in range(row_count):
                for x in range(column_count):
                    s[(1 + c) * _PLANE + y * TILE_WIDTH + x] = residual[y_tile + y, x_tile + x, c]
        start, last = starts[tile], starts[tile + 1]
        while start < last and _find_open_rows(s, strips.is_open) > 0:
            end = min(start + _BATCH, last)
            listed = _list_strips(records, splats, start, end, x_tile, y_tile, strips)
            _gather_strips(s, records, splats, listed, strips, weights, sums)
            start = end


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _gather_strips(s, records, splats, listed, strips, weights, sums):  # type: ignore[no-untyped-def]
    for i in range(listed):
        splat, first = np.uint64(splats[strips.entry[i]]), np.uint64(strips.pixel[i])
        middle, log_alpha, falloff = strips.middle[i], strips.log_alpha[i], records[splat, COLUMN_FALLOFF]
        for x in range(TILE_WIDTH):
            l = first + np.uint64(x)
            dx = np.float32(x) - middle
            weights[x], s[l] = absorb_light(log_alpha - falloff * dx * dx, s[l])
        for c in range(sums.shape[1]):
            plane = np.uint64((1 + c) * _PLANE) + first
            # Four running sums, which do not wait for one another.
            t0, t1, t2, t3 = _ZERO, _ZERO, _ZERO, _ZERO
            for x in range(0, TILE_WIDTH, 4):
                l = plane + np.uint64(x)
                t0 += weights[x] * s[l]
                t1 += weights[x + 1] * s[l + np.uint64(1)]
                t2 += weights[x + 2] * s[l + np.uint64(2)]
                t3 += weights[x + 3] * s[l + np.uint64(3)]
            sums[splat, c] += (t0 + t1) + (t2 + t3)
