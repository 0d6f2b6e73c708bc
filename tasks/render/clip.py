"""A clip's frames, one after the other, from rig poses to finished pictures."""

import numpy as np
from numpy.typing import NDArray

from tasks.render.backend import Backend
from tasks.render.camera import Camera, viewmat
from tasks.render.composition import compose, encode_8bit, round_depth
from tasks.render.environment import environment_view
from tasks.render.road_shade import RoadShade, shade_road
from tasks.scene.gaussians import Gaussians


def render_clip(
    gaussians: Gaussians,
    environment: NDArray[np.float32],
    camera: Camera,
    T_world_rig: NDArray[np.float64],
    *,
    film_depth_mm: float,
    snow_coverage: float,
    shade: RoadShade,
    backend: Backend,
) -> dict[str, NDArray[np.generic]]:
    """Render every frame of a clip.

    Parameters
    ----------
    gaussians : the street with the clip's road edit in it
    environment : float32 [He, We, 3] sky and far field, as in `Scene.environment` [1]
    camera : intrinsics and mount
    T_world_rig : float64 [F, 4, 4] rig poses with heave and pitch
    film_depth_mm : water film on the road [mm]
    snow_coverage : share of the road that snow covers [1]
    shade : how a film darkens and snow whitens the road
    backend : the rasteriser

    Returns
    -------
    ``rgb`` uint8 [F, H, W, 3] sRGB, ``depth`` float32 [F, H, W] camera z [m] (NaN where nothing is seen),
    ``class`` uint8 [F, H, W] `SemanticClass`
    """
    prepared = backend.prepare(gaussians)
    shape = (len(T_world_rig), camera.height, camera.width)
    rgb = np.empty((*shape, 3), np.uint8)
    depth = np.empty(shape, np.float32)
    class_id = np.empty(shape, np.uint8)
    for frame, pose in enumerate(T_world_rig):
        view = viewmat(pose @ camera.T_rig_camera)
        gbuffer = backend.rasterise(prepared, view, camera.K, camera.width, camera.height)
        sky = environment_view(environment, view, camera.K, camera.width, camera.height)
        clear = compose(gbuffer, sky, gaussians.display_encoded)
        rgb[frame] = encode_8bit(shade_road(clear, gbuffer.class_id, film_depth_mm, snow_coverage, shade))
        depth[frame] = round_depth(gbuffer.depth)
        class_id[frame] = gbuffer.class_id
    return {"rgb": rgb, "depth": depth, "class": class_id}
