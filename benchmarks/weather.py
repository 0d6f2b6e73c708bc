"""Cost that weather adds to a frame, stage by stage, beside the clear frame of the same run."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from benchmarks.side_by_side import least_cpu_s, make_row, print_rows
from catalogs.entries import load
from catalogs.scenes import load_scene
from catalogs.weather.look import load_weather
from tasks.render.camera import world_to_camera
from tasks.render.composition import compose_over_sky
from tasks.render.environment import environment_view
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.weather.atmosphere import air_layer, light_layer
from tasks.render.weather.falling.particles import Shutter
from tasks.render.weather.layer import recompose_layers
from tasks.render.weather.layers import (
    ClearScene,
    ClipConditions,
    ClipWeather,
    apply_weather,
    particle_layer,
    weather_scene,
)
from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.wet.wet_road import LightOnRoad, RoadFilm, wet_layer
from tasks.surface.state import SurfaceState

STATES = {
    "rain 10": SurfaceState(kind="rain", precipitation_mm_h=10, film_depth_mm=0.489),
    "rain 50": SurfaceState(kind="rain", precipitation_mm_h=50, film_depth_mm=1.263),
    "snow 1": SurfaceState(kind="snow", precipitation_mm_h=1, snow_depth_mm=10, snow_coverage=0.5),
    "snow 3": SurfaceState(kind="snow", precipitation_mm_h=3, snow_depth_mm=30, snow_coverage=1.0),
}
LIMIT = {"rain": 1.2, "snow": 0.6}
"""Time that a weather may add, as a share of the clear frame's CPU time."""

SPEED = 16.0
STATION = 40


def measure_rows(scene_name: str = "street", camera_name: str = "dashcam-480x320") -> list[dict[str, Any]]:
    """Measure a clear frame and the same frame in four weathers.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer). A weather's
    row "added" counts its Gaussians in the rasteriser too, and its ratio is the share of the clear frame.
    """
    scene, camera, parameters = load_scene(scene_name), load("camera", camera_name), load_weather()
    pavement = load("surface", "dense-asphalt")
    pose = scene.route.T_world_rig[STATION] @ camera.T_rig_camera
    K = np.asarray(camera.K, dtype=np.float64)
    view = world_to_camera(pose)
    size = (camera.width, camera.height)
    shutter = Shutter(
        T_world_camera=pose, K=K, width=camera.width, height=camera.height, velocity=SPEED * pose[:3, 2],
        time_s=2.0, exposure_s=camera.exposure_s,
    )  # fmt: skip
    clear_cloud = prepare_gaussians(scene.gaussians)
    clear_sky = environment_view(scene.environment, view, K, *size)

    def clear() -> None:
        compose_over_sky(
            rasterise_view(clear_cloud, view, K, *size), clear_sky, scene.gaussians.display_encoded
        )

    clear_ms = 1e3 * least_cpu_s(clear)
    beside_clear = ("CPU-ms", "clear frame", clear_ms)
    found = [make_row("clear frame", clear_ms, "CPU-ms")]
    for name, state in STATES.items():
        started = time.process_time()
        gaussians, weather = weather_scene(
            ClearScene(
                gaussians=scene.gaussians,
                environment=scene.environment,
                route=scene.route,
                to_sun=scene.to_sun,
                daylight=scene.daylight,
            ),
            ClipConditions(state=state, pavement=pavement, parameters=parameters, seed=1),
            float(K[0, 0]),
        )
        once_s = time.process_time() - started
        cloud = prepare_gaussians(gaussians)
        gbuffer = rasterise_view(cloud, view, K, *size)
        picture = compose_over_sky(gbuffer, clear_sky, gaussians.display_encoded)
        draw = partial(rasterise_view, viewmat=view, K=K, width=size[0], height=size[1])
        raster_ms = 1e3 * least_cpu_s(partial(draw, cloud))
        bare_ms = 1e3 * least_cpu_s(partial(draw, clear_cloud))
        stages = _list_stages(weather, picture, clear_sky, gbuffer, shutter)
        whole_ms = 1e3 * least_cpu_s(partial(apply_weather, weather, picture, clear_sky, gbuffer, shutter))
        added = whole_ms + max(raster_ms - bare_ms, 0)
        for stage, call in stages.items():
            found.append(make_row(f"{name}: {stage}", 1e3 * least_cpu_s(call), *beside_clear))
        found.append(
            make_row(f"{name}: snow layer in the rasteriser", max(raster_ms - bare_ms, 0), *beside_clear)
        )
        found.append(make_row(f"{name}: added", added, *beside_clear) | {"limit": LIMIT[state.kind]})
        found.append(make_row(f"{name}: once a clip", once_s, "CPU-s"))
    return found


def _list_stages(
    weather: ClipWeather, picture: np.ndarray, clear_sky: np.ndarray, gbuffer: GBuffer, shutter: Shutter
) -> dict[str, Callable[[], object]]:
    """The layers of one frame, each to be called alone."""
    outside = weather.outside
    assert outside is not None and outside.population is not None
    film, falling = outside.look.film, outside.population
    rays = pixel_rays(shutter)
    sky, air, view = outside.sky, outside.air, world_to_camera(shutter.T_world_camera)

    def see_clouds() -> np.ndarray:
        return environment_view(outside.environment, view, shutter.K, shutter.width, shutter.height)

    cloudy = see_clouds()
    lit = recompose_layers(picture, [light_layer(picture, gbuffer, clear_sky, cloudy, sky)])
    stages: dict[str, Callable[[], object]] = {
        "clouds": see_clouds,
        "light": lambda: light_layer(picture, gbuffer, clear_sky, cloudy, sky),
        "air": lambda: air_layer(gbuffer, cloudy, air, sky, rays),
        "particles": lambda: particle_layer(weather, falling, sky, gbuffer.depth, shutter),
    }
    if film is not None:
        on_road = RoadFilm(
            depth_mm=weather.state.film_depth_mm,
            texture_depth_mm=weather.pavement.texture_depth_mm,
            parameters=film,
            seed=weather.seed,
        )
        light = LightOnRoad(environment=outside.environment, sky=sky, extinction=air.extinction)
        stages["wet road with reflection"] = lambda: wet_layer(lit, gbuffer, shutter, rays, on_road, light)
    return stages


if __name__ == "__main__":
    print_rows(measure_rows())
