"""The transpose of blending: sums over the pixels of one view for each Gaussian."""

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.render.rasterise.binning import tile_lists
from tasks.render.rasterise.preparation import PreparedGaussians
from tasks.render.rasterise.projection import project_gaussians
from tasks.render.rasterise.transposed_blending import blend_transposed
from tasks.render.rasterise.view import view_of


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
