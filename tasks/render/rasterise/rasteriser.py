"""One view of a cloud of Gaussians: colour, depth, opacity, normal and class in one pass."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.render.rasterise.binning import tile_lists
from tasks.render.rasterise.blending import Buffers, blend_tiles
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.rasterise.placed_body import PlacedBody, Shade, project_bodies, shade_records
from tasks.render.rasterise.preparation import PreparedGaussians, prepare_gaussians
from tasks.render.rasterise.projection import project_gaussians
from tasks.render.rasterise.splat_back import splat_back
from tasks.render.rasterise.view import view_of

__all__ = ["PreparedGaussians", "prepare_gaussians", "rasterise_view", "splat_back"]


def rasterise_view(
    prepared: PreparedGaussians,
    viewmat: NDArray[np.floating],
    K: NDArray[np.floating],
    width: int,
    height: int,
    normals: bool = True,
    bodies: Sequence[PlacedBody] = (),
    shade: Shade | None = None,
) -> GBuffer:
    """Blend the cloud front to back as seen by one pinhole camera.

    Parameters
    ----------
    prepared : the cloud, from `prepare_gaussians`
    viewmat : [4, 4] world to camera; camera axes x right, y down, z forward [m]
    K : [3, 3] intrinsics; the top left pixel's centre is (0.5, 0.5) [px]
    width, height : picture size [px]
    normals : False leaves them 0, for a picture that nobody lights
    bodies : rigid clouds that are drawn among the other
    shade : which these cast on it

    Returns
    -------
    GBuffer

    Raises
    ------
    InputError
        The camera is not finite, has no positive focal length or the picture has no pixels.
    """
    view = view_of(viewmat, K, width, height)
    placed = project_bodies(bodies, view)
    records, slots = project_gaussians(prepared, view, placed)
    if shade is not None:
        shade_records(records[len(placed) :], slots, prepared, shade)
    starts, splats = tile_lists(records, width, height)
    buffers = Buffers(
        rgb=np.empty((height, width, 3), dtype=np.float32),
        depth=np.empty((height, width), dtype=np.float32),
        expected_depth=np.empty((height, width), dtype=np.float32),
        alpha=np.empty((height, width), dtype=np.float32),
        normal=np.zeros((height, width, 3), dtype=np.float32),
        class_id=np.empty((height, width), dtype=np.uint8),
        object_id=np.empty((height, width), dtype=np.uint16),
    )
    blend_tiles(records, view.rays.astype(np.float32), starts, splats, normals, buffers)
    return GBuffer(**buffers._asdict())
