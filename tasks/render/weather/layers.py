"""Weather over a clear clip. Call order, once for the clip and then for every frame:

1. ``gaussians, weather = weather_scene(clear_scene, conditions, focal_px)``, where the Gaussians have the clip's
   road edit; rasterise the returned Gaussians;
2. ``picture = compose(gbuffer, clear sky)``: the clear linear picture, sky included, as in dry weather;
3. ``frame = apply_weather(weather, picture, clear_sky, gbuffer, shutter)``, then encode ``frame.picture``.

From the scene to the lens the layers are: light (cloud in place of the sun), wet (water on the road), air (veil
over distance), particles (drops and flakes near the camera). Snow on the ground is part of the scene. In dry
weather the scene and the picture are returned unchanged.
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.render.camera import world_to_camera
from tasks.render.environment import environment_view
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.road_edit import RoadRelief, measure_road_lift
from tasks.render.weather.atmosphere import Air, air_layer, light_layer, precipitating_air
from tasks.render.weather.falling.particles import Shutter, visible_streaks
from tasks.render.weather.falling.precipitation import Population, make_population
from tasks.render.weather.falling.streaks import draw_streaks
from tasks.render.weather.layer import Layer, recompose_layers
from tasks.render.weather.parameters import KindLook, WeatherParameters
from tasks.render.weather.relief import clear_light, overcast_light, relight_gaussians
from tasks.render.weather.scene_light import ground_light, without_sun
from tasks.render.weather.sky import (
    SkyLight,
    cloud_transmittance,
    light_from,
    overcast_environment,
    sky_light,
)
from tasks.render.weather.snow.field import SnowField, snow_field
from tasks.render.weather.snow.layer import snow_layer, snowed_over, whiten_gaussians
from tasks.render.weather.wet.wet_road import LightOnRoad, RoadFilm, wet_layer
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route
from tasks.surface.state import SurfaceState
from tasks.surface.weather import DRY


@dataclass(frozen=True, kw_only=True)
class ClearScene:
    """A clip's scene before its weather.

    Parameters
    ----------
    gaussians : the clear scene with the clip's road edit
    environment : float32 [h, w, 3] its clear environment, as in `Scene.environment` [1]
    route : path of the wheels that left tracks in the snow; None for snow without tracks
    relief : road feature of the clip, which is relit by the weather's light; None for a flat road
    to_sun : [3] unit vector to the clear sky's sun, as in `Scene.to_sun` [1]
    """

    gaussians: Gaussians
    environment: NDArray[np.float32]
    route: Route | None = None
    relief: RoadRelief | None = None
    to_sun: NDArray[np.floating] | None = None


@dataclass(frozen=True, kw_only=True)
class ClipConditions:
    """The weather of a clip and its appearance.

    Parameters
    ----------
    state : what falls, and what lies on the road
    parameters : optical parameters of the weather, of the catalogue
    seed : visual seed; it moves particles and snow, and nothing else [1]
    """

    state: SurfaceState
    parameters: WeatherParameters
    seed: int


@dataclass(frozen=True, kw_only=True)
class Overcast:
    """Light, air and falling particles of a clip under cloud.

    Parameters
    ----------
    look : appearance of its kind of weather
    population : falling particles; None without precipitation
    air : extinction and veil
    sky : light of the sky
    environment : float32 [h, w, 3] environment under cloud [1]
    snow : coverage field of the scene; None where no snow lies
    """

    look: KindLook
    population: Population | None
    air: Air
    sky: SkyLight
    environment: NDArray[np.float32]
    snow: SnowField | None


@dataclass(frozen=True, kw_only=True)
class ClipWeather:
    """Weather of a clip that all its frames share.

    Parameters
    ----------
    state : surface state
    parameters : numbers of the catalogue
    seed : visual seed of the clip [1]
    overcast : None under a clear sky
    """

    state: SurfaceState
    parameters: WeatherParameters
    seed: int
    overcast: Overcast | None

    @property
    def reads_normals(self) -> bool:
        """Whether `apply_weather` reads the normals of a rasterisation: only a film on the road mirrors."""
        return self.overcast is not None and self.overcast.look.film is not None


@dataclass(frozen=True, kw_only=True)
class WeatherFrame:
    """One frame and its parts: ``picture`` is ``recompose_layers(base, layers)``, bit for bit.

    Parameters
    ----------
    base : float32 [H, W, 3] the clear linear picture [1]
    layers : from the scene to the lens
    picture : float32 [H, W, 3] the linear picture in its weather [1]
    """

    base: NDArray[np.float32]
    layers: tuple[Layer, ...]
    picture: NDArray[np.float32]


def weather_scene(
    clear: ClearScene, conditions: ClipConditions, focal_px: float
) -> tuple[Gaussians, ClipWeather]:
    """Bring a clip's weather into its scene: softened shadows, snow where it lies, the light on a road feature.

    Parameters
    ----------
    clear : the scene without weather
    conditions : the weather
    focal_px : focal length of the camera [px]

    Returns
    -------
    gaussians : the scene to rasterise; the appended snow layer, if any, comes last
    weather : for `apply_weather`

    Raises
    ------
    InputError
        If there is no such kind of weather, it has precipitation without a rate, or the scene has no road.
    """
    gaussians, environment, relief = clear.gaussians, clear.environment, clear.relief
    state, p, seed = conditions.state, conditions.parameters, conditions.seed
    look = p.find_look(state.kind)
    if look is None:
        dry = ClipWeather(state=state, parameters=p, seed=seed, overcast=None)
        if relief is None:
            return gaussians, dry
        return relight_gaussians(
            gaussians, relief, clear_light(gaussians, environment, p.sky, clear.to_sun)
        ), dry
    if look.particles is not None and state.precipitation_mm_h == 0:
        raise InputError(f"weather: {state.kind} needs precipitation_mm_h above 0; it is 0: use {DRY}")
    falls = None if look.particles is None else make_population(look.particles, state.precipitation_mm_h)
    air = precipitating_air(falls, p.air.near, focal_px, p.air.haze_visual_range_m)
    white = ground_light(gaussians, SemanticClass.ROAD).lit / p.sky.asphalt_albedo
    cover = look.snow_cover
    covered = 0.0 if cover is None else state.snow_coverage
    ground = p.sky.asphalt_albedo
    if cover is not None:
        ground = (1 - covered) * ground + covered * float(np.mean(cover.albedo))
    level = cloud_transmittance(state.precipitation_mm_h, p.sky) * 2**look.exposure_ev
    sky = sky_light(white, level, air.extinction, ground, p.sky)
    scene = without_sun(gaussians, p.sky.shadow_kept)
    field = None
    if cover is not None:
        field = snow_field(gaussians, cover.patches, cover.tracks, cover.anchors, clear.route, seed)
        amount = (state.snow_coverage, state.snow_depth_mm, cover)
        lift = None if relief is None else measure_road_lift(scene, relief)
        snow = snow_layer(scene, field, white, *amount, lift)
        scene = snowed_over(whiten_gaussians(scene, field, white, *amount), snow)
    overcast = Overcast(
        look=look,
        population=falls,
        air=air,
        sky=sky,
        environment=overcast_environment(environment, sky, air.extinction, p.sky, seed, covered),
        snow=field,
    )
    if relief is not None:
        scene = relight_gaussians(scene, relief, overcast_light(overcast.environment, sky))
    return scene, ClipWeather(state=state, parameters=p, seed=seed, overcast=overcast)


def apply_weather(
    weather: ClipWeather,
    picture: NDArray[np.float32],
    clear_sky: NDArray[np.float32],
    gbuffer: GBuffer,
    shutter: Shutter,
    *,
    particles: bool = True,
) -> WeatherFrame:
    """Return the picture of one frame in its weather.

    Parameters
    ----------
    weather : from `weather_scene`
    picture : float32 [H, W, 3] linear picture of its scene before the clear environment [1]
    clear_sky : float32 [H, W, 3] the clear environment in the same view, see `environment_view` [1]
    gbuffer : the rasterisation it was made from
    shutter : pose, motion, time and exposure of the frame
    particles : False if `particle_layer` draws them afterwards, for a sensor with a lens or a rolling shutter, whose
        streaks are drawn with the motion that this sensor sees during the exposure

    Returns
    -------
    WeatherFrame
    """
    overcast = weather.overcast
    if overcast is None:
        return WeatherFrame(base=picture, layers=(), picture=picture)
    sky, air, film = overcast.sky, overcast.air, overcast.look.film
    rays = pixel_rays(shutter)
    view = world_to_camera(shutter.T_world_camera)
    cloudy = environment_view(overcast.environment, view, shutter.K, shutter.width, shutter.height)
    layers = [light_layer(picture, gbuffer, clear_sky, cloudy, sky)]
    if film is not None:
        state = weather.state
        on_road = RoadFilm(
            depth_mm=state.film_depth_mm,
            parameters=film,
            seed=weather.seed,
            rate_mm_h=state.precipitation_mm_h,
        )
        light = LightOnRoad(environment=overcast.environment, sky=sky, extinction=air.extinction)
        dry = recompose_layers(picture, layers)
        layers.append(wet_layer(dry, gbuffer, shutter, rays, on_road, light))
    layers.append(air_layer(gbuffer, cloudy, air, sky, rays))
    if particles and overcast.population is not None:
        layers.append(particle_layer(weather, overcast.population, overcast.sky, gbuffer.depth, shutter))
    return WeatherFrame(base=picture, layers=tuple(layers), picture=recompose_layers(picture, layers))


def particle_layer(
    weather: ClipWeather, falling: Population, sky: SkyLight, depth: NDArray[np.float32], shutter: Shutter
) -> Layer:
    """Return the layer of drops or flakes near the camera, lit by sky and ground.

    Parameters
    ----------
    weather : from `weather_scene`
    falling, sky : its population and its light
    depth : float32 [H, W] camera z of the scene; NaN where there is none [m]
    shutter : pose, motion, time and exposure of the frame

    Returns
    -------
    Layer
    """
    p = weather.parameters
    kind = falling.parameters
    wind = np.array(p.air.wind_m_s)
    streaks = visible_streaks(falling, p.air.near, shutter, wind, weather.seed)
    up = streaks["direction"][:, 2]
    beyond, before = light_from(sky, up, p.sky), light_from(sky, -up, p.sky)
    light = kind.scattering * (kind.backlit_share * beyond + (1 - kind.backlit_share) * before)
    drawn = draw_streaks(streaks, light, depth, shutter.K, 1e-3 * p.air.near.aperture_mm)
    return Layer(name="particles", gain=(1 - drawn.alpha)[..., None], add=drawn.rgb)


def pixel_rays(shutter: Shutter) -> NDArray[np.float32]:
    """Return world directions through the pixels' centres, of camera z 1.

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
    rays = np.empty((shutter.height, shutter.width, 3), dtype=np.float32)
    _fill_rays(u, v, shutter.T_world_camera[:3, :3].astype(np.float32), rays)
    return rays


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _fill_rays(u, v, R, rays):  # type: ignore[no-untyped-def]
    for i in range(len(v)):
        for j in range(len(u)):
            for c in range(3):
                rays[i, j, c] = u[j] * R[c, 0] + v[i] * R[c, 1] + R[c, 2]
