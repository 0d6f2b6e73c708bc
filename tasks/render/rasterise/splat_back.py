"""The transpose of blending: sums over the pixels of one view for each Gaussian, tile by tile."""

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.render.rasterise.binning import TILE_HEIGHT, TILE_WIDTH, tile_lists
from tasks.render.rasterise.preparation import PreparedGaussians
from tasks.render.rasterise.projection import COLUMN_FALLOFF, project_gaussians
from tasks.render.rasterise.strips import (
    BATCH,
    PLANE,
    absorb_light,
    find_open_rows,
    list_strips,
    new_strips,
    open_tile,
)
from tasks.render.rasterise.view import view_of

_ZERO = np.float32(0)


def splat_back(
    prepared: PreparedGaussians,
    viewmat: NDArray[np.floating],
    K: NDArray[np.floating],
    width: int,
    height: int,
    residual: NDArray[np.floating],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the sum over the pixels of blend weight times residual, for every Gaussian.

    With w_i(p) the weight that `rasterise_view` gives Gaussian i at pixel p, the picture is
    ``sum_i w_i(p) colour_i``; this is its transpose, ``sum_p w_i(p) residual(p)``.

    Parameters
    ----------
    prepared : the cloud, from `prepare_gaussians`
    viewmat : [4, 4] world to camera; camera axes x right, y down, z forward [m]
    K : [3, 3] intrinsics [px]
    width, height : picture size [px]
    residual : [height, width, C] finite values per pixel [1]

    Returns
    -------
    numerator : float32 [N, C] weighted sums, in the order of the original cloud [1]
    weight : float32 [N] sum of w_i over the pixels; 0 for a Gaussian that this view does not show [1]

    Raises
    ------
    InputError
        The camera is unusable, or the residual's shape does not fit the picture.
    """
    view = view_of(viewmat, K, width, height)
    residual = np.asarray(residual, dtype=np.float32)
    if residual.ndim != 3 or residual.shape[:2] != (height, width):
        raise InputError(
            f"splat_back: residual must have shape ({height}, {width}, channels); it has {residual.shape}"
        )
    records, slots = project_gaussians(prepared, view)
    starts, splats = tile_lists(records, width, height)
    # A channel of ones carries the weight's own sum.
    channels = np.concatenate((residual, np.ones((height, width, 1), dtype=np.float32)), axis=2)
    seen = np.zeros((len(records), channels.shape[2]))
    blend_transposed(records, starts, splats, channels, seen)
    sums = np.zeros((len(prepared), channels.shape[2]), dtype=np.float32)
    sums[prepared.order[slots]] = seen
    return sums[:, :-1], sums[:, -1]


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
