"""Lists of the splats that touch each tile of the picture, nearest first."""

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.rasterise.projection import (
    COLUMN_FALLOFF,
    DEPTH,
    HALF_HEIGHT,
    LOG_ALPHA,
    LOG_CUT,
    ROW_FALLOFF,
    SLOPE,
    X,
    Y,
)

TILE_WIDTH, TILE_HEIGHT = 16, 16
"""Pixels of one tile [px]."""

_ZERO, _HALF, _ONE, _LOG_CUT = (np.float32(c) for c in (0, 0.5, 1, LOG_CUT))


def tile_lists(
    records: NDArray[np.float32], width: int, height: int
) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Return the splats of every tile, nearest first; equal depths keep the order of the records.

    Parameters
    ----------
    records : float32 [V, 16] splat records of `tasks.render.rasterise.projection.project_gaussians`
    width, height : picture size [px]

    Returns
    -------
    starts : int64 [tiles + 1] where each tile's list begins, tiles row by row [1]
    splats : uint32 [entries] places in ``records`` [1]
    """
    # Bit patterns of positive floats sort as the floats do.
    order = depth_order(np.ascontiguousarray(records[:, DEPTH]).view(np.uint32))
    ends, tiles = touched_tiles(records, width, height)
    starts, splats = bin_splats(ends, tiles, order, -(-width // TILE_WIDTH) * -(-height // TILE_HEIGHT))
    return starts, splats


def depth_order(keys: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the places of the keys in ascending order; equal keys keep theirs.

    Parameters
    ----------
    keys : uint32 [V] sort keys [1]

    Returns
    -------
    uint32 [V] places [1]
    """
    # a number holds key and place: NumPy sorts numbers in vector registers, in a third of the time of places
    pairs = keys.astype(np.uint64) << np.uint64(32) | np.arange(len(keys), dtype=np.uint64)
    pairs.sort()
    return pairs.astype(np.uint32)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def touched_tiles(records, width, height):  # type: ignore[no-untyped-def]
    """Return the tiles that each splat's ellipse touches.

    Within a row of tiles an ellipse reaches furthest right at its own rightmost point, moved into the row.

    Parameters
    ----------
    records : float32 [V, 16] splat records
    width, height : picture size [px]

    Returns
    -------
    ends : int64 [V] where each splat's part of ``tiles`` ends [1]
    tiles : int32 [entries] tiles, numbered row by row [1]
    """
    across, down = -(-width // TILE_WIDTH), -(-height // TILE_HEIGHT)
    ends = np.empty(len(records), dtype=np.int64)
    tiles = np.empty(2 * len(records) + across * down, dtype=np.int32)
    count = 0
    for splat in range(len(records)):
        x0, y0 = records[splat, X] - _HALF, records[splat, Y] - _HALF
        half_height, slope = records[splat, HALF_HEIGHT], records[splat, SLOPE]
        falloff = records[splat, ROW_FALLOFF]
        reach, spread = records[splat, LOG_ALPHA] - _LOG_CUT, _ONE / records[splat, COLUMN_FALLOFF]
        half_width = np.sqrt(reach * (spread + slope * slope / falloff))
        top = int(np.ceil(max(y0 - half_height, _ZERO))) // TILE_HEIGHT
        bottom = int(np.floor(min(y0 + half_height, np.float32(height - 1)))) // TILE_HEIGHT
        left = int(np.ceil(max(x0 - half_width, _ZERO))) // TILE_WIDTH
        right = int(np.floor(min(x0 + half_width, np.float32(width - 1)))) // TILE_WIDTH
        if count + (bottom - top + 1) * (right - left + 1) > len(tiles):
            longer = np.empty(2 * len(tiles), dtype=np.int32)
            for entry in range(count):  # a slice would compile its error message too, for two seconds
                longer[entry] = tiles[entry]
            tiles = longer
        is_box = top == bottom or left == right
        tip = slope * half_height * half_height / half_width
        for row in range(top, bottom + 1):
            if not is_box:
                low = max(np.float32(row * TILE_HEIGHT) - y0, -half_height)
                high = min(np.float32(row * TILE_HEIGHT + TILE_HEIGHT - 1) - y0, half_height)
                dy = min(max(tip, low), high)
                end = x0 + slope * dy + np.sqrt(max(reach - falloff * dy * dy, _ZERO) * spread)
                dy = min(max(-tip, low), high)
                begin = x0 + slope * dy - np.sqrt(max(reach - falloff * dy * dy, _ZERO) * spread)
                left = int(np.ceil(max(begin, _ZERO))) // TILE_WIDTH
                right = int(np.floor(min(end, np.float32(width - 1)))) // TILE_WIDTH
            for column in range(left, right + 1):
                tiles[count] = row * across + column
                count += 1
        ends[splat] = count
    return ends, tiles[:count]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def bin_splats(ends, tiles, order, tile_count):  # type: ignore[no-untyped-def]
    """Append each splat, in the given order, to the list of every tile that it touches.

    Parameters
    ----------
    ends, tiles : see `touched_tiles`
    order : uint32 [V] splats, nearest first [1]
    tile_count : tiles of the picture [1]

    Returns
    -------
    starts, splats : see `tile_lists`
    """
    starts = np.zeros(tile_count + 1, dtype=np.int64)
    for tile in tiles:
        starts[tile + 1] += 1
    for tile in range(tile_count):
        starts[tile + 1] += starts[tile]
    free = starts[:-1].copy()
    splats = np.empty(len(tiles), dtype=np.uint32)
    for i in range(len(order)):
        splat = np.int64(order[i])
        for k in range(ends[splat - 1] if splat > 0 else 0, ends[splat]):
            splats[free[tiles[k]]] = splat
            free[tiles[k]] += 1
    return starts, splats
