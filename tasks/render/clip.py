"""A clip's frames, one after the other, from rig poses to finished pictures in their weather."""

import ctypes
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.render.camera import Camera, RigAt, world_to_camera
from tasks.render.composition import compose_over_sky, round_depth
from tasks.render.display_bytes import encode_picture
from tasks.render.environment import environment_view
from tasks.render.grain import add_grain
from tasks.render.labels import MovedPixels, compute_clip_flow, compute_flow, compute_row_flow, label_frame
from tasks.render.moving_bodies import BodiesInClip, MovingBody
from tasks.render.pixels import bring_to_host
from tasks.render.rasterise.backend import Backend
from tasks.render.readout import Field, sensor_field
from tasks.render.road_edit import RoadRelief
from tasks.render.sensor import apply_sensor
from tasks.render.sight import take_drawn_frame, take_frame_through_sensor
from tasks.render.weather.attribution import paper_picture
from tasks.render.weather.falling.particles import Shutter
from tasks.render.weather.layers import ClearScene, ClipConditions, apply_weather, weather_scene
from tasks.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class RigMotion:
    """Motion of the rig and of road users during a clip.

    Parameters
    ----------
    T_world_rig : float64 [F, 4, 4] rig poses with heave and pitch, one a frame [m]
    frame_rate_hz : frames per second [Hz]
    rig_at : rig poses about each frame; a camera that `moves` during a frame needs them
    bodies : road users; during a frame they stand still, as in its middle
    first_frame : number of the first frame, from which particles and noise count [1]
    shown : places of the frames that are rendered, with the bytes that they have among all; with labels, which follow
        from two frames, None. None renders all
    """

    T_world_rig: NDArray[np.float64]
    frame_rate_hz: float
    rig_at: RigAt | None = None
    bodies: Sequence[MovingBody] = ()
    first_frame: int = 0
    shown: range | None = None


def render_clip(
    scene: Scene,
    camera: Camera,
    motion: RigMotion,
    conditions: ClipConditions,
    backend: Backend,
    *,
    relief: RoadRelief | None = None,
    labels: bool = False,
    composition: Literal["linear", "paper"] = "linear",
) -> dict[str, NDArray[np.generic]]:
    """Render the frames of a clip.

    Parameters
    ----------
    scene : the street with the clip's road edit in it; along its route wheels have left tracks in the snow
    camera : intrinsics, mount, lens and shutter
    motion : rig poses
    conditions : weather and its appearance
    backend : the rasteriser
    relief : the road feature, which shapes light, water and labels; None for a flat road
    labels : the clip gets the labels of `tasks.render.labels` too
    composition : ``paper`` finishes pictures as `paper_picture` does, without lens, shutter and sensor

    Returns
    -------
    ``rgb`` uint8 [F, H, W, 3] sRGB, ``depth`` float32 [F, H, W] camera z [m] (NaN where nothing is seen),
    ``class`` uint8 [F, H, W] `SemanticClass`; with bodies ``instance`` uint16 [F, H, W], the number of the body that a
    pixel shows or 0; with labels ``normal``, ``road``, ``marks`` and ``flow``

    Raises
    ------
    InputError
        The camera moves during a frame, and ``motion`` has no poses between frames.
    """
    field = sensor_field(camera)
    T_world_camera = motion.T_world_rig @ camera.T_rig_camera
    T_world_rows = pose_rows(camera, T_world_camera, motion.rig_at)
    weathered, weather = weather_scene(
        ClearScene(
            gaussians=scene.gaussians,
            environment=scene.environment,
            route=scene.route,
            lanes=scene.lanes,
            relief=relief,
            to_sun=scene.to_sun,
            daylight=scene.daylight,
        ),
        conditions,
        float(camera.K[0, 0]),
    )
    moving = BodiesInClip(motion.bodies, scene, weathered, weather, backend, T_world_camera)
    prepared = backend.prepare_gaussians(weathered)
    route, environment, daylight = scene.route, scene.environment, scene.daylight
    display_encoded = scene.gaussians.display_encoded
    del scene, weathered  # frames need none of their Gaussians
    _return_freed_memory()
    velocity = np.gradient(T_world_camera[:, :3, 3], 1 / motion.frame_rate_hz, axis=0)
    shows_sky = display_encoded or not weather.replaces_sky
    # labels, the paper's composition and its film, a lens, a shutter and a sensor's noise are the processor's
    stays = camera.plain and not labels and composition == "linear"
    stays = stays and not conditions.refracts and camera.sensor.full_well is None
    black = np.zeros((field.height, field.width, 3), np.float32)
    if stays:
        environment, black = backend.keep(environment), backend.keep(black)
        if weather.outside is not None:
            own = replace(weather.outside, environment=backend.keep(weather.outside.environment))
            weather = replace(weather, outside=own)

    def render_frame(frame: int) -> dict[str, NDArray[np.generic]]:
        pose = T_world_camera[frame]
        view = world_to_camera(pose)
        gbuffer = backend.rasterise_view(
            prepared, view, field.K, field.width, field.height,
            normals=labels or weather.reads_normals,
            bodies=moving.place(frame), shade=moving.shade(frame),
        )  # fmt: skip
        if not stays:
            gbuffer = gbuffer.on_host()
        if daylight is not None:
            gbuffer = add_grain(gbuffer, pose, field.K)
        shutter = Shutter(
            T_world_camera=pose,
            K=field.K,
            width=field.width,
            height=field.height,
            velocity=velocity[frame],
            time_s=(motion.first_frame + frame) / motion.frame_rate_hz,
            exposure_s=camera.exposure_s,
        )
        clear = gbuffer.rgb
        if labels or shows_sky:
            sky = environment_view(environment, view, field.K, field.width, field.height)
            clear = compose_over_sky(gbuffer, sky, display_encoded)
        before = (clear, sky) if shows_sky else (gbuffer.rgb, black)
        finished = replace(
            apply_weather(weather, *before, gbuffer, shutter, particles=camera.plain), base=clear
        )
        drawn = (weather, finished, gbuffer, shutter)
        if T_world_rows is None:
            seen = take_drawn_frame(*drawn, labels)
        else:
            seen = take_frame_through_sensor(*drawn, camera, field, T_world_rows[frame], labels)
        developed = (
            paper_picture(finished)
            if composition == "paper"
            else encode_picture(
                apply_sensor(seen.picture, camera.sensor, conditions.seed, motion.first_frame + frame)
            )
        )
        buffers: dict[str, NDArray[np.generic]] = {
            "rgb": developed,
            "depth": round_depth(seen.depth),
            "class": seen.class_id,
        }
        if motion.bodies:
            buffers["instance"] = seen.object_id
        if seen.points is not None and seen.changes is not None:
            elevation = None if relief is None else relief.elevation
            buffers |= label_frame(seen.normal, seen.class_id, seen.points, seen.changes, route, elevation)
        return buffers

    clip: dict[str, NDArray[Any]] = {}
    chosen = range(len(T_world_camera)) if motion.shown is None else motion.shown
    for place, frame in enumerate(chosen):
        for name, drawn in render_frame(frame).items():
            values = bring_to_host(drawn)
            if not place:
                clip[name] = np.empty((len(chosen), *values.shape), values.dtype)
            clip[name][place] = values
    if labels:
        clip["flow"], occluded = _label_flow(clip, motion.bodies, camera, field, T_world_camera, T_world_rows)
        clip["marks"] |= occluded
    return clip


def _return_freed_memory() -> None:
    """Give the system what arrays that are gone have held: glibc keeps it, other libraries have no such call."""
    with suppress(AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def _label_flow(
    clip: Mapping[str, NDArray[Any]],
    bodies: Sequence[MovingBody],
    camera: Camera,
    field: Field,
    T_world_camera: NDArray[np.float64],
    T_world_rows: list[NDArray[np.float64]] | None,
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return flow and occlusion marks as `compute_clip_flow` does, for either kind of shutter."""

    depth = clip["depth"]

    def flow_from(k: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        pair = depth[k], depth[k + 1]
        moved = [
            MovedPixels(
                shown=clip["instance"][k] == body.number,
                T_later_earlier=body.T_world_body[k + 1] @ np.linalg.inv(body.T_world_body[k]),
            )
            for body in bodies
        ]
        if T_world_rows is None:
            return compute_flow(*pair, camera.K, T_world_camera[k], T_world_camera[k + 1], moved)
        rows = T_world_rows[k][1], T_world_rows[k + 1][1]
        return compute_row_flow(*pair, field.directions, camera, *rows, moved)

    return compute_clip_flow(depth, flow_from)


def pose_rows(
    camera: Camera, T_world_camera: NDArray[np.float64], rig_at: RigAt | None
) -> list[NDArray[np.float64]] | None:
    """Return camera poses [3, H, 4, 4] of each frame at its rows' times; None where one pose serves all rows."""
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
