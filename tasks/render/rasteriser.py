"""One view of a cloud of Gaussians: colour, depth, opacity, normal and class in one pass."""

import numpy as np
from numpy.typing import NDArray

from tasks.render.binning import tile_lists
from tasks.render.blending import blend
from tasks.render.gbuffer import GBuffer
from tasks.render.preparation import PreparedGaussians, prepare
from tasks.render.projection import project, view_of
from tasks.render.splat_back import splat_back

__all__ = ["PreparedGaussians", "prepare", "rasterise", "splat_back"]


def rasterise(
    prepared: PreparedGaussians,
    viewmat: NDArray[np.floating],
    K: NDArray[np.floating],
    width: int,
    height: int,
) -> GBuffer:
    """Blend the cloud front to back as seen by one pinhole camera.

    Parameters
    ----------
    prepared : the cloud, from `prepare`
    viewmat : [4, 4] world to camera; camera axes x right, y down, z forward [m]
    K : [3, 3] intrinsics; the top left pixel's centre is (0.5, 0.5) [px]
    width, height : picture size [px]

    Returns
    -------
    GBuffer

    Raises
    ------
    InputError
        The camera is not finite, has no positive focal length or the picture has no pixels.
    """
    view = view_of(viewmat, K, width, height)
    records, _ = project(prepared, view)
    starts, splats = tile_lists(records, width, height)
    out = blend(records, starts, splats, width, height)
    alpha = 1 - out[..., 0]
    with np.errstate(invalid="ignore", divide="ignore"):
        depth = out[..., 2] / alpha
        normal = out[..., 6:9] / np.linalg.norm(out[..., 6:9], axis=-1, keepdims=True)
    covered = alpha > 0
    return GBuffer(
        rgb=np.ascontiguousarray(out[..., 3:6]),
        depth=np.where(covered, depth, np.nan).astype(np.float32),
        alpha=alpha,
        normal=np.where(covered[..., None], normal, 0).astype(np.float32),
        class_id=np.where(out[..., 0] < 0.5, out[..., 1], 0).astype(np.uint8),
    )
