"""Weather over a clear clip. Call order, once for the clip and then for every frame:

1. ``gaussians, weather = weather_scene(gaussians, environment, state, parameters, focal_px, seed, route,
   relief, to_sun)`` with the clip's road edit already in the Gaussians' shape; rasterise the Gaussians that come back;
2. ``picture = compose(gbuffer, clear sky)``: the clear linear picture, sky included, as in dry weather;
3. ``frame = apply_weather(weather, picture, gbuffer, shutter)``, then encode ``frame.picture``.

From the scene to the lens the layers are: light (cloud in place of the sun), wet (water on the road), air (veil
over distance), particles (drops and flakes near the camera). Snow on the ground is part of the scene. In dry
weather the scene and the picture come back as they are.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.road_edit import RoadRelief, measure_road_lift
from tasks.render.weather.atmosphere import Air, air_layer, light_layer, precipitating_air
from tasks.render.weather.falling.particles import Shutter, visible_streaks
from tasks.render.weather.falling.precipitation import Population, population
from tasks.render.weather.falling.streaks import draw_streaks
from tasks.render.weather.layer import Layer, recompose
from tasks.render.weather.parameters import WeatherParameters, WeatherState
from tasks.render.weather.relief import clear_light, overcast_light, relit
from tasks.render.weather.scene_light import ground_light, without_sun
from tasks.render.weather.sky import (
    SkyLight,
    cloud_transmittance,
    light_from,
    overcast_environment,
    sky_light,
)
from tasks.render.weather.snow.field import SnowField, snow_field
from tasks.render.weather.snow.layer import snow_layer, snowed_over, whitened
from tasks.render.weather.wet.wet_road import wet_layer
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route


@dataclass(frozen=True, kw_only=True)
class Falling:
    """What a clip with precipitation has beyond its state.

    Parameters
    ----------
    population : what falls
    air : what it does to the light on its way
    sky : the light
    environment : float32 [h, w, 3] environment under cloud [1]
    snow : coverage field of the scene; None when it rains
    """

    population: Population
    air: Air
    sky: SkyLight
    environment: NDArray[np.float32]
    snow: SnowField | None


@dataclass(frozen=True, kw_only=True)
class ClipWeather:
    """Everything about a clip's weather that its frames share.

    Parameters
    ----------
    state : the weather
    parameters : the catalogue
    seed : visual seed of the clip [1]
    clear_environment : float32 [h, w, 3] environment in clear weather [1]
    falling : None in dry weather
    """

    state: WeatherState
    parameters: WeatherParameters
    seed: int
    clear_environment: NDArray[np.float32]
    falling: Falling | None


@dataclass(frozen=True, kw_only=True)
class WeatherFrame:
    """One frame and what it is made of: ``picture`` is ``recompose(base, layers)``, bit for bit.

    Parameters
    ----------
    base : float32 [H, W, 3] the clear linear picture [1]
    layers : from the scene to the lens
    picture : float32 [H, W, 3] the linear picture in its weather [1]
    """

    base: NDArray[np.float32]
    layers: tuple[Layer, ...]
    picture: NDArray[np.float32]


def state_problems(state: WeatherState) -> list[str]:
    """Every rule that a weather state breaks, each as one sentence; empty when it is sound."""
    problems = []
    if state.kind not in ("dry", "rain", "snow"):
        problems.append(f"weather: kind must be dry, rain or snow; it is {state.kind!r}")
    for name in ("precipitation_mm_h", "film_depth_mm", "snow_depth_mm", "snow_coverage"):
        value = getattr(state, name)
        if not (np.isfinite(value) and value >= 0):
            problems.append(f"weather: {name} must be a number of 0 or more; it is {value:g}")
    if state.snow_coverage > 1:
        problems.append(f"weather: snow_coverage must not exceed 1; it is {state.snow_coverage:g}")
    if state.kind != "dry" and state.precipitation_mm_h == 0:
        problems.append(f"weather: {state.kind} needs precipitation_mm_h above 0; it is 0: use dry")
    return problems


def weather_scene(
    gaussians: Gaussians,
    environment: NDArray[np.float32],
    state: WeatherState,
    parameters: WeatherParameters,
    focal_px: float,
    seed: int,
    route: Route | None = None,
    relief: RoadRelief | None = None,
    to_sun: NDArray[np.floating] | None = None,
) -> tuple[Gaussians, ClipWeather]:
    """Bring a clip's weather into its scene: softened shadows, snow where it lies, the light on a road feature.

    Parameters
    ----------
    gaussians : the clear scene with the clip's road edit
    environment : float32 [h, w, 3] its clear environment, as in `Scene.environment` [1]
    state : the weather
    parameters : the catalogue
    focal_px : focal length of the camera [px]
    seed : visual seed of the clip [1]
    route : where wheels have left tracks in the snow; None leaves it untouched
    relief : the clip's road feature, lit by the weather's light as it is turned to it; None for a flat road
    to_sun : [3] unit vector to the clear sky's sun, as in `Scene.to_sun` [1]

    Returns
    -------
    gaussians : the scene to rasterise; the appended snow layer, if any, comes last
    weather : for `apply_weather`

    Raises
    ------
    InputError
        The state is unsound, or the scene has no road.
    """
    problems = state_problems(state)
    if problems:
        raise InputError(problems)
    if state.kind == "dry":
        dry = ClipWeather(
            state=state, parameters=parameters, seed=seed, clear_environment=environment, falling=None
        )
        if relief is None:
            return gaussians, dry
        return relit(gaussians, relief, clear_light(gaussians, environment, parameters.sky, to_sun)), dry
    p = parameters
    falls = population(p.rain if state.kind == "rain" else p.snowfall, state.precipitation_mm_h)
    air = precipitating_air(falls, p.air.near, focal_px, p.air.haze_visual_range_m)
    white = ground_light(gaussians, SemanticClass.ROAD).lit / p.sky.asphalt_albedo
    covered = state.snow_coverage if state.kind == "snow" else 0.0
    ground = (1 - covered) * p.sky.asphalt_albedo + covered * float(np.mean(p.snow_cover.albedo))
    opened = p.sky.exposure_ev_snow if state.kind == "snow" else p.sky.exposure_ev_rain
    level = cloud_transmittance(state.precipitation_mm_h, p.sky) * 2**opened
    sky = sky_light(white, level, air.extinction, ground, p.sky)
    scene = without_sun(gaussians, p.sky.shadow_kept)
    field = None
    if state.kind == "snow":
        c = p.snow_cover
        field = snow_field(gaussians, c.patches, c.tracks, c.anchors, route, seed)
        amount = (state.snow_coverage, state.snow_depth_mm, p.snow_cover)
        lift = None if relief is None else measure_road_lift(scene, relief)
        snow = snow_layer(scene, field, white, *amount, lift)
        scene = snowed_over(whitened(scene, field, white, *amount), snow)
    falling = Falling(
        population=falls,
        air=air,
        sky=sky,
        environment=overcast_environment(environment, sky, air.extinction, p.sky, seed, covered),
        snow=field,
    )
    if relief is not None:
        scene = relit(scene, relief, overcast_light(falling.environment, sky))
    return scene, ClipWeather(
        state=state, parameters=p, seed=seed, clear_environment=environment, falling=falling
    )


def apply_weather(
    weather: ClipWeather,
    picture: NDArray[np.float32],
    gbuffer: GBuffer,
    shutter: Shutter,
    *,
    particles: bool = True,
) -> WeatherFrame:
    """The picture of one frame in its weather.

    Parameters
    ----------
    weather : from `weather_scene`
    picture : float32 [H, W, 3] linear picture of its scene before the clear environment [1]
    gbuffer : the rasterisation it was made from
    shutter : pose, motion, time and exposure of the frame
    particles : False leaves them to `particle_layer`, for a sensor that sees the rest of the scene through a lens
        or row by row: streaks are drawn as it sees them, with their own way during the exposure

    Returns
    -------
    WeatherFrame
    """
    falling = weather.falling
    if falling is None:
        return WeatherFrame(base=picture, layers=(), picture=picture)
    p, sky, air = weather.parameters, falling.sky, falling.air
    rays = pixel_rays(shutter)
    layers = [light_layer(picture, gbuffer, weather.clear_environment, falling.environment, sky, rays)]
    if weather.state.kind == "rain":
        dry = recompose(picture, layers)
        layers.append(
            wet_layer(
                dry, gbuffer, falling.environment, sky, air.extinction, rays, shutter.T_world_camera, shutter.K,
                weather.state.film_depth_mm, p.wet_road, weather.seed,
            )
        )  # fmt: skip
    layers.append(air_layer(gbuffer, falling.environment, air, sky, rays))
    if particles:
        layers.append(particle_layer(weather, falling, gbuffer.depth, shutter))
    return WeatherFrame(base=picture, layers=tuple(layers), picture=recompose(picture, layers))


def particle_layer(
    weather: ClipWeather, falling: Falling, depth: NDArray[np.float32], shutter: Shutter
) -> Layer:
    """The drops or flakes near the camera, lit by the sky and the ground about them.

    Parameters
    ----------
    weather, falling : from `weather_scene`
    depth : float32 [H, W] camera z of the scene; NaN where there is none [m]
    shutter : pose, motion, time and exposure of the frame

    Returns
    -------
    Layer
    """
    p = weather.parameters
    kind = falling.population.parameters
    wind = np.array(p.air.wind_m_s)
    streaks = visible_streaks(falling.population, p.air.near, shutter, wind, weather.seed)
    up = streaks["direction"][:, 2]
    beyond, before = light_from(falling.sky, up, p.sky), light_from(falling.sky, -up, p.sky)
    light = kind.scattering * (kind.backlit_share * beyond + (1 - kind.backlit_share) * before)
    drawn = draw_streaks(streaks, light, depth, shutter.K, 1e-3 * p.air.near.aperture_mm)
    return Layer(name="particles", gain=(1 - drawn.alpha)[..., None], add=drawn.rgb)


def pixel_rays(shutter: Shutter) -> NDArray[np.float32]:
    """World directions through the pixels' centres, of camera z 1.

    Parameters
    ----------
    shutter : pose and intrinsics

    Returns
    -------
    float32 [H, W, 3] directions [1]
    """
    K = shutter.K
    u = ((np.arange(shutter.width) + 0.5 - K[0, 2]) / K[0, 0]).astype(np.float32)
    v = ((np.arange(shutter.height) + 0.5 - K[1, 2]) / K[1, 1]).astype(np.float32)
    R = shutter.T_world_camera[:3, :3].astype(np.float32)
    return u[None, :, None] * R[:, 0] + v[:, None, None] * R[:, 1] + R[:, 2]
