"""Light, air and falling particles of a clip, as its sky and the paper's two appearance controls have them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.render.composition import LUMINANCE
from tasks.render.weather.atmosphere import Air, precipitating_air
from tasks.render.weather.clouds import draw_closed_sky, draw_sunny_sky
from tasks.render.weather.controls import AirControls, RoadControls, air_controls, road_controls
from tasks.render.weather.falling.precipitation import Population
from tasks.render.weather.parameters import KindLook, WeatherParameters
from tasks.render.weather.random_streams import unit_number
from tasks.render.weather.skies import Daylight
from tasks.render.weather.sky import (
    SkyLight,
    draw_camera_colours,
    expose_light,
    replace_sky,
    row_elevations,
    see_in_colours,
    sky_light,
    sunny_light,
)
from tasks.render.weather.snow.field import SnowField
from tasks.surface.state import SurfaceState


@dataclass(frozen=True, kw_only=True)
class Outside:
    """Light, air and falling particles of a clip.

    Parameters
    ----------
    look : appearance of its kind of weather
    road : the paper's control of the road's look, xi_road
    atmosphere : the paper's control of the air's look, xi_atm
    air : extinction and veil
    sky : light of the sky
    environment : float32 [h, w, 3] environment under that sky [1]
    snow : coverage field of the scene; None where no snow lies
    daylight : sky and sun over a scene that knows its light; None for closed cloud over any other
    """

    look: KindLook
    road: RoadControls
    atmosphere: AirControls
    air: Air
    sky: SkyLight
    environment: NDArray[np.float32]
    snow: SnowField | None
    daylight: Daylight | None

    @property
    def population(self) -> Population | None:
        """Falling particles; None without precipitation."""
        return self.atmosphere.population

    @property
    def to_sun(self) -> NDArray[np.float64] | None:
        """Unit vector [3] to the sun that casts shadows, world frame [1]; None where none does."""
        return self.daylight.to_sun if self.daylight is not None and self.daylight.has_sun else None


@dataclass(frozen=True, kw_only=True)
class LitScene:
    """What the light of a scene is read from.

    Parameters
    ----------
    environment : float32 [h, w, 3] its own environment [1]
    white : float64 [3] radiance of a white surface on open ground, as its colours have it [1]
    daylight : sky and sun that were put on it; None for closed cloud over a scene that does not know its light
    strength : light on its road by that of its own light; without daylight it follows from the cloud [1]
    """

    environment: NDArray[np.float32]
    white: NDArray[np.float64]
    daylight: Daylight | None = None
    strength: float = 1.0


def make_outside(
    look: KindLook,
    state: SurfaceState,
    parameters: WeatherParameters,
    seed: int,
    scene: LitScene,
    snow: SnowField | None,
    focal_px: float,
) -> Outside:
    """Return the light, air and particles that the sky and the controls of a weather give.

    Parameters
    ----------
    look : how the kind of weather looks
    state : what falls, and what lies on the road
    parameters : numbers of the catalogue
    seed : visual seed of the clip [1]
    scene : its light
    snow : coverage field of the scene; None where no snow lies
    focal_px : focal length of the camera [px]
    """
    daylight, environment, white = scene.daylight, scene.environment, scene.white
    p = parameters
    haze = p.air.haze_visual_range_m if daylight is None else daylight.kind.visual_range_m
    visual_range = min(state.visual_range_m, haze)
    xi_road = road_controls(state, look)
    xi_atm = air_controls(state.kind, state.precipitation_mm_h, p, visual_range)
    covered, ground = xi_road.snow_coverage, p.sky.asphalt_albedo
    brightest = ground
    if look.snow_cover is not None:
        brightest = float(np.mean(look.snow_cover.albedo))
        ground = (1 - covered) * ground + covered * brightest
    elevation = row_elevations(len(environment))
    above = elevation[elevation > 0], environment.shape[1]
    strength = xi_atm.transmittance if daylight is None else scene.strength
    opened = expose_light(strength, brightest * strength * float(LUMINANCE @ white), p.sky, seed)
    if daylight is not None and daylight.has_sun:
        rows = np.float32(opened) * draw_sunny_sky(daylight, p.sky.clouds, seed, *above)
        sky = sunny_light(white, strength * opened, rows, ground)
    else:
        rise = p.sky.zenith_gradient * (1 + p.sky.gradient_spread * (2 * unit_number(seed, "gradient") - 1))
        true = daylight is not None
        sky = sky_light(
            white,
            strength * opened,
            xi_atm.extinction,
            ground,
            p.sky,
            true_colours=true,
            zenith_gradient=rise,
        )
        fade = xi_atm.extinction * p.sky.cloud_base_m
        rows = draw_closed_sky(sky.airlight, sky.gradient, fade, p.sky.clouds, seed, *above)
    colours = draw_camera_colours(p.sky, seed)
    sky = see_in_colours(sky, colours)
    seen = [sum(np.float32(row[c]) * rows[..., c] for c in range(3)) for row in colours]
    rows = np.maximum(np.stack(seen, axis=-1), np.float32(0))
    return Outside(
        look=look,
        road=xi_road,
        atmosphere=xi_atm,
        air=precipitating_air(xi_atm.population, p.air.near, focal_px, visual_range),
        sky=sky,
        environment=replace_sky(environment, rows, sky, xi_atm.extinction, p.sky, covered),
        snow=snow,
        daylight=daylight,
    )
