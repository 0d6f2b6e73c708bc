"""Front-to-back blending of depth-ordered splats, tile by tile."""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.rasterise.binning import TILE_HEIGHT, TILE_WIDTH
from tasks.render.rasterise.projection import (
    BLUE,
    CLASS,
    CODES,
    COLUMN_FALLOFF,
    DEPTH,
    DISTANCE,
    GREEN,
    NORMAL_X,
    NORMAL_Y,
    NORMAL_Z,
    RED,
)
from tasks.render.rasterise.strips import (
    BATCH,
    PLANE,
    absorb_light,
    find_open_rows,
    list_strips,
    new_strips,
    open_tile,
)

# Planes of a tile's state after the first, the transmittance.
# Offsets are unsigned: a signed index may be negative, and the compiler would gather pixel by pixel.
_FRONT, _ALPHA, _DEPTH, _RED, _GREEN, _BLUE, _NX, _NY, _NZ = (np.uint64(k * PLANE) for k in range(1, 10))
_STATE = 10 * PLANE
_FIRST = np.uint64(1)  # splats are counted from 1 in the plane _FRONT, exact in single precision up to 2^24

SURFACE_RATIO = 1.25
"""Where a splat's plane is nearer or further than its centre by more than this, the disc is nearly edge-on,
and its centre's depth counts [1]."""

_ZERO, _HALF, _ONE = np.float32(0), np.float32(0.5), np.float32(1)
_RATIO = np.float32(SURFACE_RATIO)


class Buffers(NamedTuple):
    """The arrays of a `GBuffer`, as the kernel fills them."""

    rgb: NDArray[np.float32]
    depth: NDArray[np.float32]
    expected_depth: NDArray[np.float32]
    alpha: NDArray[np.float32]
    normal: NDArray[np.float32]
    class_id: NDArray[np.uint8]
    object_id: NDArray[np.uint16]


def _compile_blend_strips(normals):  # type: ignore[no-untyped-def]
    """Return the inner loop with or without normals: decided when it is compiled, it costs no branch."""

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def blend_strips(s, records, listed, strips):  # type: ignore[no-untyped-def]
        for i in range(listed):
            splat, first = np.uint64(strips.splat[i]), np.uint64(strips.pixel[i])
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
    normals : False leaves the normals as they are, for a tenth less time
    buffers : overwritten
    """
    rgb, depth, expected_depth, alpha, normal, class_id, object_id = buffers
    height, width = alpha.shape
    across = -(-width // TILE_WIDTH)
    s = np.empty(_STATE, dtype=np.float32)
    strips = new_strips()
    for tile in range(len(starts) - 1):
        x_tile, y_tile = (tile % across) * TILE_WIDTH, (tile // across) * TILE_HEIGHT
        row_count, column_count = min(TILE_HEIGHT, height - y_tile), min(TILE_WIDTH, width - x_tile)
        open_tile(s, row_count, column_count)
        start, last = starts[tile], starts[tile + 1]
        while start < last and find_open_rows(s, strips.is_open) > 0:
            end = min(start + BATCH, last)
            listed = list_strips(records, splats, start, end, x_tile, y_tile, strips)
            if normals:
                _blend_strips(s, records, listed, strips)
            else:
                _blend_strips_flat(s, records, listed, strips)
            start = end
        for y in range(row_count):
            for x in range(column_count):
                l = np.uint64(y * TILE_WIDTH + x)
                i, j = y_tile + y, x_tile + x
                alpha[i, j] = s[_ALPHA + l]
                z = s[_DEPTH + l] / s[_ALPHA + l]  # NaN where no splat contributes
                expected_depth[i, j] = z
                class_id[i, j] = object_id[i, j] = 0
                front = np.int64(s[_FRONT + l]) - 1
                if front >= 0:
                    code = np.int64(records[front, CLASS])
                    class_id[i, j], object_id[i, j] = code & (CODES - 1), code // CODES
                    z = _plane_depth(records[front], rays, np.float32(j) + _HALF, np.float32(i) + _HALF)
                depth[i, j] = z
                rgb[i, j, 0], rgb[i, j, 1], rgb[i, j, 2] = s[_RED + l], s[_GREEN + l], s[_BLUE + l]
                if normals:
                    nx, ny, nz = s[_NX + l], s[_NY + l], s[_NZ + l]
                    length = np.sqrt(nx * nx + ny * ny + nz * nz)
                    scale = _ONE / length if length > _ZERO else _ZERO
                    normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = nx * scale, ny * scale, nz * scale
