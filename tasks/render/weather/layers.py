"""Weather over a clear clip. Call order, once for the clip and then for every frame:

1. ``gaussians, weather = weather_scene(clear_scene, conditions, focal_px)``, where the Gaussians have the clip's
   road edit; rasterise the returned Gaussians;
2. ``picture = compose(gbuffer, clear sky)``: the clear linear picture, sky included, as in dry weather;
3. ``frame = apply_weather(weather, picture, clear_sky, gbuffer, shutter)``, then encode ``frame.picture``.

From the scene to the lens the layers are: light (cloud in place of the sun), wet (water on the road), air (veil
over distance), particles (drops and flakes near the camera). Snow on the ground is part of the scene. In dry
weather the scene and the picture are returned unchanged.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.render.camera import world_to_camera
from tasks.render.environment import environment_view
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.road_edit import RoadRelief, measure_road_lift
from tasks.render.weather.atmosphere import air_layer, light_layer
from tasks.render.weather.controls import road_controls
from tasks.render.weather.daylight import relight_street
from tasks.render.weather.falling.particles import Shutter, visible_streaks
from tasks.render.weather.falling.precipitation import Population
from tasks.render.weather.falling.streaks import draw_streaks
from tasks.render.weather.layer import Layer, recompose_layers
from tasks.render.weather.named_sky import ANY_SKY, OVERCAST, NamedSky
from tasks.render.weather.outside import LitScene, Outside, make_outside
from tasks.render.weather.parameters import WeatherParameters
from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.relief import clear_light, light_outside, relight_gaussians
from tasks.render.weather.scene_light import ground_light, without_sun
from tasks.render.weather.skies import Daylight, draw_sky_kind, draw_sun, light_of_sky
from tasks.render.weather.sky import SkyLight, cloud_transmittance, light_from
from tasks.render.weather.snow.field import LyingSnow, snow_field
from tasks.render.weather.snow.layer import snow_layer, snowed_over, whiten_gaussians
from tasks.render.weather.wet.soaked import soak_gaussians
from tasks.render.weather.wet.wet_road import LightOnRoad, RoadFilm, wet_layer
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route
from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.surface.weather import find_weather, has_closed_cloud


@dataclass(frozen=True, kw_only=True)
class ClearScene:
    """A clip's scene before its weather.

    Parameters
    ----------
    gaussians : the clear scene with the clip's road edit
    environment : float32 [h, w, 3] its clear environment, as in `Scene.environment` [1]
    route : path of the wheels that left tracks in the snow; None for snow without tracks
    lanes : lateral positions of the lanes that are driven [m]
    relief : road feature of the clip, which is relit by the weather's light; None for a flat road
    to_sun : [3] unit vector to the clear sky's sun, as in `Scene.to_sun` [1]
    daylight : colours of its light, as in `Scene.daylight` [1]; None where they are not known
    """

    gaussians: Gaussians
    environment: NDArray[np.float32]
    route: Route | None = None
    lanes: tuple[float, ...] = (0.0,)
    relief: RoadRelief | None = None
    to_sun: NDArray[np.float64] | None = None
    daylight: tuple[tuple[float, float, float], ...] | None = None


@dataclass(frozen=True, kw_only=True)
class ClipConditions:
    """The weather of a clip and its appearance.

    Parameters
    ----------
    state : what falls, and what lies on the road
    pavement : the road itself, from whose numbers the state follows
    parameters : optical parameters of the weather, of the catalogue
    seed : visual seed; it moves particles and snow, and nothing else [1]
    sky : what the scenario says of the sky; what it leaves open, the seed draws
    anchors : states of the two anchors that the paper's composition blends; none for a picture of its own rate
    refracts : whether films on the road refract, as in the paper's composition
    """

    state: SurfaceState
    pavement: SurfaceParameters
    parameters: WeatherParameters
    seed: int
    sky: NamedSky = ANY_SKY
    anchors: tuple[SurfaceState, ...] = ()
    refracts: bool = False


@dataclass(frozen=True, kw_only=True)
class ClipWeather:
    """Weather of a clip that all its frames share.

    Parameters
    ----------
    state : surface state
    pavement : the road itself
    parameters : numbers of the catalogue
    seed : visual seed of the clip [1]
    outside : None where a scene keeps the light it was made in
    anchors : weathers of the two anchors, in one scene and of one seed, that the paper's composition blends
    refracts : whether the film on the road refracts
    """

    state: SurfaceState
    pavement: SurfaceParameters
    parameters: WeatherParameters
    seed: int
    outside: Outside | None
    anchors: "tuple[ClipWeather, ...]" = ()
    refracts: bool = False

    @property
    def replaces_sky(self) -> bool:
        """Whether `apply_weather` puts a sky of its own in place of that of the scene."""
        return self.outside is not None

    @property
    def reads_normals(self) -> bool:
        """Whether `apply_weather` reads the normals of a rasterisation: only a film on the road mirrors."""
        return self.outside is not None and self.outside.look.film is not None


@dataclass(frozen=True, kw_only=True)
class WeatherFrame:
    """One frame and its parts: ``picture`` is ``recompose_layers(base, layers)``, bit for bit.

    Parameters
    ----------
    base : float32 [H, W, 3] the clear linear picture [1]
    layers : from the scene to the lens
    picture : float32 [H, W, 3] the linear picture in its weather [1]
    blend : the two anchors that the paper's composition blends; None where the frame is its own anchor
    """

    base: NDArray[np.float32]
    layers: tuple[Layer, ...]
    picture: NDArray[np.float32]
    blend: "AnchorBlend | None" = None


@dataclass(frozen=True, kw_only=True)
class AnchorBlend:
    """Two frames of one pose at the rates about that of the clip (paper, Appendix A.4).

    Parameters
    ----------
    low, high : frames at the lower and at the higher rate
    still : weight of the higher one's still picture, linear in the rate [1]
    falling : weight of its particles, linear in their number [1]
    """

    low: WeatherFrame
    high: WeatherFrame
    still: float
    falling: float


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
        If there is no such kind of weather, or the scene has no road.
    """
    gaussians, environment, relief = clear.gaussians, clear.environment, clear.relief
    state, p, seed = conditions.state, conditions.parameters, conditions.seed
    look = p.find_look(state.kind)
    light = choose_light(clear, conditions)
    if light is None and not find_weather(state.kind).overcast:
        dry = ClipWeather(state=state, pavement=conditions.pavement, parameters=p, seed=seed, outside=None)
        if relief is None:
            return gaussians, dry
        return relight_gaussians(
            gaussians, relief, clear_light(gaussians, environment, p.sky, clear.to_sun)
        ), dry
    if light is None or gaussians.light is None:
        incident = ground_light(gaussians, SemanticClass.ROAD).lit / p.sky.asphalt_albedo
        scene, lit = (
            without_sun(gaussians, p.sky.shadow_kept),
            LitScene(environment=environment, white=incident),
        )
    else:
        before, own_sun = np.array(clear.daylight), np.asarray(clear.to_sun)
        scene, incident, strength = relight_street(gaussians, gaussians.light, before, own_sun, light)
        white = (light.to_sun[2] * light.colours[0] + light.colours[1]) / strength
        lit = LitScene(environment=environment, white=white, daylight=light, strength=strength)
    if look.film is not None and look.walls is not None and state.film_depth_mm > 0:
        mirrors = 0.0 if gaussians.light is None else gaussians.light[:, 3]
        scene = soak_gaussians(scene, mirrors, incident, look.film, look.walls, seed)
    field = None
    if (cover := look.snow_cover) is not None:
        field = snow_field(
            gaussians,
            cover.patches,
            cover.stretch,
            cover.tracks,
            cover.anchors,
            clear.route,
            seed,
            clear.lanes,
        )
        xi_road = road_controls(state, look)
        amount = LyingSnow(
            coverage=xi_road.snow_coverage,
            depth_mm=xi_road.snow_depth_mm,
            full_cover_mm=conditions.pavement.full_cover_depth_mm,
        )
        lift = None if relief is None else measure_road_lift(scene, relief)
        snow = snow_layer(scene, field, incident, amount, cover, lift)
        scene = snowed_over(whiten_gaussians(scene, field, incident, amount, cover), snow)
    own, *anchors = (
        ClipWeather(
            state=one,
            pavement=conditions.pavement,
            parameters=p,
            seed=seed,
            outside=make_outside(look, one, p, seed, lit, field, focal_px),
            refracts=conditions.refracts,
        )
        for one in (state, *conditions.anchors)
    )
    if relief is not None and own.outside is not None:
        scene = relight_gaussians(
            scene,
            relief,
            light_outside(scene, own.outside.environment, own.outside.sky, p.sky, own.outside.to_sun),
        )
    return scene, replace(own, anchors=tuple(anchors))


def choose_light(clear: ClearScene, conditions: ClipConditions) -> Daylight | None:
    """Return sky and sun of a clip; None over a scene that does not know its own light.

    Parameters
    ----------
    clear : the scene
    conditions : the weather; under no closed cloud the visual seed draws a sky that is not named
    """
    if clear.gaussians.light is None or clear.daylight is None or clear.to_sun is None:
        return None
    p, seed, named = conditions.parameters.sky, conditions.seed, conditions.sky
    drawn = OVERCAST if has_closed_cloud(conditions.state) else draw_sky_kind(p.skies, seed)
    name = named.kind or drawn
    kind = getattr(p.skies, name)
    through = cloud_transmittance(conditions.state.precipitation_mm_h, p)
    own = np.array(clear.daylight)
    return light_of_sky(name, kind, draw_sun(kind, seed, named), own, clear.to_sun, p.sun, through)


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
    picture : float32 [H, W, 3] linear picture of its scene before the clear environment, or before black if this
        weather replaces it, see `ClipWeather.replaces_sky` [1]
    clear_sky : float32 [H, W, 3] the clear environment in the same view, see `environment_view`, or black [1]
    gbuffer : the rasterisation it was made from
    shutter : pose, motion, time and exposure of the frame
    particles : False if `particle_layer` draws them afterwards, for a sensor with a lens or a rolling shutter, whose
        streaks are drawn with the motion that this sensor sees during the exposure

    Returns
    -------
    WeatherFrame
    """
    outside = weather.outside
    if outside is None:
        return WeatherFrame(base=picture, layers=(), picture=picture)
    sky, air, film = outside.sky, outside.air, outside.look.film
    rays = pixel_rays(shutter)
    view = world_to_camera(shutter.T_world_camera)
    cloudy = environment_view(outside.environment, view, shutter.K, shutter.width, shutter.height)
    layers = [light_layer(picture, gbuffer, clear_sky, cloudy, sky)]
    dry = recompose_layers(picture, layers)
    if film is not None:
        state = weather.state
        on_road = RoadFilm(
            depth_mm=state.film_depth_mm,
            texture_depth_mm=weather.pavement.texture_depth_mm,
            parameters=film,
            seed=weather.seed,
            rate_mm_h=state.precipitation_mm_h,
            falling=outside.population,
            refracts=weather.refracts,
        )
        light = LightOnRoad(environment=outside.environment, sky=sky, extinction=air.extinction)
        layers.append(wet_layer(dry, gbuffer, shutter, rays, on_road, light))
    layers.append(air_layer(gbuffer, cloudy, air, sky, rays))
    if particles and outside.population is not None:
        layers.append(particle_layer(weather, outside.population, outside.sky, gbuffer.depth, shutter))
    return WeatherFrame(
        base=picture,
        layers=tuple(layers),
        picture=recompose_layers(dry, layers[1:]),
        blend=_blend_anchors(weather, outside, (picture, clear_sky, gbuffer, shutter)),
    )


def _blend_anchors(weather: ClipWeather, outside: Outside, view: Any) -> AnchorBlend | None:
    """The frames of the anchors in a view, and how much the higher one weighs."""
    if not weather.anchors:
        return None
    low, high = weather.anchors
    rates, counts = [], []
    for one in (low, weather, high):
        air = outside.atmosphere if one.outside is None else one.outside.atmosphere
        rates.append(one.state.precipitation_mm_h)
        counts.append(air.particles_m3)
    still, falling = ((own - least) / (most - least) for least, own, most in (rates, counts))
    return AnchorBlend(
        low=apply_weather(low, *view), high=apply_weather(high, *view), still=still, falling=falling
    )


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
