"""One frame of the sensor with the ground truth of its pixels, by a global or a rolling shutter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.render.camera import Camera, world_to_camera
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.readout import Field, read_out
from tasks.render.weather.attribution import attribute_pixels, mark_changed_pixels
from tasks.render.weather.falling.particles import Shutter
from tasks.render.weather.layer import recompose_layers
from tasks.render.weather.layers import ClipWeather, WeatherFrame, particle_layer
from tasks.render.weather.rays import pixel_rays


@dataclass(frozen=True, kw_only=True)
class SensorFrame:
    """Light and ground truth of a frame's pixels.

    Parameters
    ----------
    picture : float32 [H, W, 3] linear light [1]
    depth : float32 [H, W] z in the camera at the pixel's own time; NaN where nothing is seen [m]
    class_id : uint8 [H, W] `SemanticClass`
    object_id : uint16 [H, W] number of the moving body; 0 for none
    normal : float32 [H, W, 3] world normal [1]
    points : [H, W, 3] points that the pixels show, world frame; NaN where there are none. None without labels [m]
    changes : uint8 [H, W] bits of the layers that changed the pixel; None without labels
    """

    picture: NDArray[np.float32]
    depth: NDArray[np.float32]
    class_id: NDArray[np.uint8]
    object_id: NDArray[np.uint16]
    normal: NDArray[np.float32]
    points: NDArray[np.floating] | None
    changes: NDArray[np.uint8] | None


def take_drawn_frame(
    weather: ClipWeather, finished: WeatherFrame, gbuffer: GBuffer, shutter: Shutter, labelled: bool
) -> SensorFrame:
    """Return the frame of a pinhole whose rows are all exposed at once.

    Parameters
    ----------
    weather, finished, gbuffer, shutter : as `attribute_pixels` takes them
    labelled : with `points` and `changes`
    """
    eye = shutter.T_world_camera[:3, 3]
    return SensorFrame(
        picture=finished.picture,
        depth=gbuffer.depth,
        class_id=gbuffer.class_id,
        object_id=gbuffer.object_id,
        normal=gbuffer.normal,
        points=eye + gbuffer.depth[..., None] * pixel_rays(shutter) if labelled else None,
        changes=attribute_pixels(weather, finished, gbuffer, shutter) if labelled else None,
    )


def take_frame_through_sensor(
    weather: ClipWeather,
    still: WeatherFrame,
    gbuffer: GBuffer,
    wide: Shutter,
    camera: Camera,
    field: Field,
    T_world_rows: NDArray[np.float64],
    labelled: bool,
) -> SensorFrame:
    """Return the frame behind a lens, read out row by row and averaged over the exposure, as the camera defines.

    Parameters
    ----------
    weather, still, gbuffer, wide : the wide picture without its particles, as `attribute_pixels` takes them
    camera, field : the camera, and from `sensor_field`
    T_world_rows : float64 [3, H, 4, 4] camera poses at the beginning, the middle and the end of each row's
        exposure [m]
    labelled : with `points` and `changes`

    Returns
    -------
    Sight
        Labels are those of the middle of the exposure, each from one pixel of the wide picture.
    """
    seen = read_out(
        still.picture,
        gbuffer.depth,
        field,
        world_to_camera(wide.T_world_camera) @ T_world_rows,
        camera.motion_blur,
    )
    picture = seen.picture
    changes = attribute_pixels(weather, still, gbuffer, wide).ravel()[seen.source] if labelled else None
    if weather.outside is not None and weather.outside.population is not None:
        own = Shutter(
            T_world_camera=wide.T_world_camera, K=camera.K, width=camera.width, height=camera.height,
            velocity=wide.velocity, time_s=wide.time_s, exposure_s=wide.exposure_s, lens=camera.lens,
            line_delay_s=camera.line_delay_s,
        )  # fmt: skip
        layer = particle_layer(weather, weather.outside.population, weather.outside.sky, seen.depth, own)
        picture = recompose_layers(seen.picture, (layer,))
        if changes is not None:
            changes |= mark_changed_pixels(seen.picture, picture, layer)
    return SensorFrame(
        picture=picture,
        depth=seen.depth,
        class_id=gbuffer.class_id.ravel()[seen.source],
        object_id=gbuffer.object_id.ravel()[seen.source],
        normal=gbuffer.normal.reshape(-1, 3)[seen.source],
        points=row_points(field.directions, seen.depth, T_world_rows[1]) if labelled else None,
        changes=changes,
    )


def row_points(
    directions: NDArray[np.float64], depth: NDArray[np.float32], T_world_rows: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the world points that the pixels of a sensor show when it is read row by row.

    Parameters
    ----------
    directions : float64 [H, W, 2] right and down per forward [1]
    depth : float32 [H, W] z in the camera at the pixel's own time [m]
    T_world_rows : float64 [H, 4, 4] camera pose at each row's time [m]

    Returns
    -------
    float64 [H, W, 3] [m]
    """
    z = depth[..., None].astype(np.float64)
    rays = np.concatenate((directions, np.ones_like(z)), axis=-1) * z
    return rays @ T_world_rows[:, :3, :3].swapaxes(1, 2) + T_world_rows[:, None, :3, 3]
