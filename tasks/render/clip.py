"""A clip's frames, one after the other, from rig poses to finished pictures in their weather."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.render.camera import Camera, RigAt, world_to_camera
from tasks.render.composition import compose_over_sky, encode_8bit, round_depth
from tasks.render.environment import environment_view
from tasks.render.labels import clip_flow, forward_flow, frame_labels, row_flow
from tasks.render.rasterise.backend import Backend
from tasks.render.readout import sensor_field
from tasks.render.road_edit import Profile, RoadRelief
from tasks.render.sensor import apply_sensor
from tasks.render.sight import take_drawn_frame, take_frame_through_sensor
from tasks.render.weather.attribution import paper_picture
from tasks.render.weather.falling.particles import Shutter
from tasks.render.weather.layers import apply_weather, weather_scene
from tasks.render.weather.parameters import WeatherParameters, WeatherState
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
    to_sun: NDArray[np.float64] | None = None,
    labelled: Profile | None = None,
    rig_at: RigAt | None = None,
    composition: Literal["linear", "paper"] = "linear",
) -> dict[str, NDArray[np.generic]]:
    """Render every frame of a clip.

    Parameters
    ----------
    gaussians : the street with the clip's road edit in it
    environment : float32 [He, We, 3] clear sky and far field, as in `Scene.environment` [1]
    route : along which wheels have left tracks in the snow
    camera : intrinsics, mount, lens and shutter
    T_world_rig : float64 [F, 4, 4] rig poses with heave and pitch
    frame_rate_hz : frames per second [Hz]
    weather : what falls, and what lies on the road
    looks : how that looks
    seed : visual seed; it moves particles and snow, and nothing else [1]
    backend : the rasteriser
    relief : the road feature, as the light meets it; None for a flat road
    to_sun : float64 [3] as in `Scene.to_sun` [1]
    labelled : H_g(s) of the clip; with it the clip gets the labels of `tasks.render.labels` too
    rig_at : rig poses about each frame; a camera that `moves` during a frame needs them
    composition : ``paper`` finishes pictures as `paper_picture` does, without lens, shutter and sensor

    Returns
    -------
    ``rgb`` uint8 [F, H, W, 3] sRGB, ``depth`` float32 [F, H, W] camera z [m] (NaN where nothing is seen),
    ``class`` uint8 [F, H, W] `SemanticClass`; with labels ``normal``, ``road``, ``marks`` and ``flow``
    """
    focal_px = float(camera.K[0, 0])
    scene, clip_weather = weather_scene(
        gaussians, environment, weather, looks, focal_px, seed, route, relief, to_sun
    )
    prepared = backend.prepare(scene)
    field = sensor_field(camera)
    T_world_camera = T_world_rig @ camera.T_rig_camera
    T_world_rows = _row_poses(camera, T_world_camera, rig_at)
    velocity = np.gradient(T_world_camera[:, :3, 3], 1 / frame_rate_hz, axis=0)
    frames: list[dict[str, NDArray[np.generic]]] = []
    for frame, pose in enumerate(T_world_camera):
        view = world_to_camera(pose)
        gbuffer = backend.rasterise(prepared, view, field.K, field.width, field.height)
        sky = environment_view(environment, view, field.K, field.width, field.height)
        shutter = Shutter(
            T_world_camera=pose,
            K=field.K,
            width=field.width,
            height=field.height,
            velocity=velocity[frame],
            time_s=frame / frame_rate_hz,
            exposure_s=camera.exposure_s,
        )
        clear = compose_over_sky(gbuffer, sky, gaussians.display_encoded)
        finished = apply_weather(clip_weather, clear, gbuffer, shutter, particles=camera.plain)
        of_frame = (clip_weather, finished, gbuffer, shutter)
        if T_world_rows is None:
            seen = take_drawn_frame(*of_frame, labelled is not None)
        else:
            seen = take_frame_through_sensor(
                *of_frame, camera, field, T_world_rows[frame], labelled is not None
            )
        developed = (
            paper_picture(finished)
            if composition == "paper"
            else encode_8bit(apply_sensor(seen.picture, camera.sensor, seed, frame))
        )
        buffers: dict[str, NDArray[np.generic]] = {
            "rgb": developed,
            "depth": round_depth(seen.depth),
            "class": seen.class_id,
        }
        if labelled is not None and seen.points is not None and seen.changes is not None:
            buffers |= frame_labels(seen.normal, seen.class_id, seen.points, seen.changes, route, labelled)
        frames.append(buffers)
    clip = {name: np.stack([buffers[name] for buffers in frames]) for name in frames[0]}
    if labelled is not None:
        depth = clip["depth"]

        def flow_from(k: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
            pair = depth[k], depth[k + 1]
            if T_world_rows is None:
                return forward_flow(*pair, camera.K, T_world_camera[k], T_world_camera[k + 1])
            return row_flow(*pair, field.directions, camera, T_world_rows[k][1], T_world_rows[k + 1][1])

        clip["flow"], occluded = clip_flow(depth, flow_from)
        clip["marks"] |= occluded
    return clip


def _row_poses(
    camera: Camera, T_world_camera: NDArray[np.float64], rig_at: RigAt | None
) -> list[NDArray[np.float64]] | None:
    """Camera poses [3, H, 4, 4] of each frame at its rows' times; None where one pose says it all."""
    if camera.plain:
        return None
    if not camera.moves:
        return [np.broadcast_to(pose, (3, camera.height, 4, 4)) for pose in T_world_camera]
    if rig_at is None:
        raise InputError(
            f"camera: {camera.name} moves during a frame; rendering needs rig poses between frames"
        )
    times = camera.row_times
    return [
        rig_at(k, times.ravel()).reshape(*times.shape, 4, 4) @ camera.T_rig_camera
        for k in range(len(T_world_camera))
    ]
