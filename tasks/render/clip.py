"""A clip's frames, one after the other, from rig poses to finished pictures in their weather."""

import numpy as np
from numpy.typing import NDArray

from tasks.render.backend import Backend
from tasks.render.camera import Camera, viewmat
from tasks.render.composition import compose, encode_8bit, round_depth
from tasks.render.environment import environment_view
from tasks.render.labels import clip_flow, frame_labels
from tasks.render.road_edit import Profile, RoadRelief
from tasks.render.sensor import photographed
from tasks.render.weather.layers import apply_weather, weather_scene
from tasks.render.weather.parameters import WeatherParameters, WeatherState
from tasks.render.weather.particles import Shutter
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route


def render_clip(
    gaussians: Gaussians,
    environment: NDArray[np.float32],
    route: Route,
    camera: Camera,
    T_world_rig: NDArray[np.float64],
    *,
    frame_rate_hz: float,
    weather: WeatherState,
    looks: WeatherParameters,
    seed: int,
    backend: Backend,
    relief: RoadRelief | None = None,
    labelled: Profile | None = None,
) -> dict[str, NDArray[np.generic]]:
    """Render every frame of a clip.

    Parameters
    ----------
    gaussians : the street with the clip's road edit in it
    environment : float32 [He, We, 3] clear sky and far field, as in `Scene.environment` [1]
    route : along which wheels have left tracks in the snow
    camera : intrinsics, mount and exposure
    T_world_rig : float64 [F, 4, 4] rig poses with heave and pitch
    frame_rate_hz : frames per second [Hz]
    weather : what falls, and what lies on the road
    looks : how that looks
    seed : visual seed; it moves particles and snow, and nothing else [1]
    backend : the rasteriser
    relief : the road feature, as the light meets it; None for a flat road
    labelled : H_g(s) of the clip; with it the clip gets the labels of `tasks.render.labels` too

    Returns
    -------
    ``rgb`` uint8 [F, H, W, 3] sRGB, ``depth`` float32 [F, H, W] camera z [m] (NaN where nothing is seen),
    ``class`` uint8 [F, H, W] `SemanticClass`; with labels ``normal``, ``road``, ``marks`` and ``flow``
    """
    focal_px = float(camera.K[0, 0])
    scene, clip_weather = weather_scene(gaussians, environment, weather, looks, focal_px, seed, route, relief)
    prepared = backend.prepare(scene)
    T_world_camera = T_world_rig @ camera.T_rig_camera
    velocity = np.gradient(T_world_camera[:, :3, 3], 1 / frame_rate_hz, axis=0)
    frames: list[dict[str, NDArray[np.generic]]] = []
    for frame, pose in enumerate(T_world_camera):
        view = viewmat(pose)
        gbuffer = backend.rasterise(prepared, view, camera.K, camera.width, camera.height)
        sky = environment_view(environment, view, camera.K, camera.width, camera.height)
        shutter = Shutter(
            T_world_camera=pose,
            K=camera.K,
            width=camera.width,
            height=camera.height,
            velocity=velocity[frame],
            time_s=frame / frame_rate_hz,
            exposure_s=camera.exposure_s,
        )
        clear = compose(gbuffer, sky, gaussians.display_encoded)
        finished = apply_weather(clip_weather, clear, gbuffer, shutter)
        buffers: dict[str, NDArray[np.generic]] = {
            "rgb": encode_8bit(photographed(finished.picture, camera.sensor, seed, frame)),
            "depth": round_depth(gbuffer.depth),
            "class": gbuffer.class_id,
        }
        if labelled is not None:
            buffers |= frame_labels(clip_weather, finished, gbuffer, shutter, route, labelled)
        frames.append(buffers)
    clip = {name: np.stack([buffers[name] for buffers in frames]) for name in frames[0]}
    if labelled is not None:
        clip["flow"], occluded = clip_flow(clip["depth"], camera.K, T_world_camera)
        clip["marks"] |= occluded
    return clip
