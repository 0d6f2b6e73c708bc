"""Light, air and falling particles of a clip under cloud, as the paper's two appearance controls have them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.atmosphere import Air, precipitating_air
from tasks.render.weather.controls import AirControls, RoadControls, air_controls, road_controls
from tasks.render.weather.falling.precipitation import Population
from tasks.render.weather.parameters import KindLook, WeatherParameters
from tasks.render.weather.sky import SkyLight, overcast_environment, sky_light
from tasks.render.weather.snow.field import SnowField
from tasks.surface.state import SurfaceState


@dataclass(frozen=True, kw_only=True)
class Overcast:
    """Light, air and falling particles of a clip under cloud.

    Parameters
    ----------
    look : appearance of its kind of weather
    road : the paper's control of the road's look, xi_road
    atmosphere : the paper's control of the air's look, xi_atm
    air : extinction and veil
    sky : light of the sky
    environment : float32 [h, w, 3] environment under cloud [1]
    snow : coverage field of the scene; None where no snow lies
    """

    look: KindLook
    road: RoadControls
    atmosphere: AirControls
    air: Air
    sky: SkyLight
    environment: NDArray[np.float32]
    snow: SnowField | None

    @property
    def population(self) -> Population | None:
        """Falling particles; None without precipitation."""
        return self.atmosphere.population


def make_overcast(
    look: KindLook,
    state: SurfaceState,
    parameters: WeatherParameters,
    seed: int,
    environment: NDArray[np.float32],
    white: NDArray[np.float64],
    snow: SnowField | None,
    focal_px: float,
) -> Overcast:
    """Return the light, air and particles that the controls of a weather give.

    Parameters
    ----------
    look : how the kind of weather looks
    state : what falls, and what lies on the road
    parameters : numbers of the catalogue
    seed : visual seed of the clip [1]
    environment : float32 [h, w, 3] the clear environment [1]
    white : [3] radiance, in clear weather, of a white surface lying on the road [1]
    snow : coverage field of the scene; None where no snow lies
    focal_px : focal length of the camera [px]

    Raises
    ------
    InputError
        The weather has precipitation without a rate.
    """
    p = parameters
    xi_road, xi_atm = road_controls(state, look), air_controls(state.kind, state.precipitation_mm_h, p)
    covered, ground = xi_road.snow_coverage, p.sky.asphalt_albedo
    if look.snow_cover is not None:
        ground = (1 - covered) * ground + covered * float(np.mean(look.snow_cover.albedo))
    sky = sky_light(white, xi_atm.transmittance * 2**look.exposure_ev, xi_atm.extinction, ground, p.sky)
    return Overcast(
        look=look,
        road=xi_road,
        atmosphere=xi_atm,
        air=precipitating_air(xi_atm.population, p.air.near, focal_px, p.air.haze_visual_range_m),
        sky=sky,
        environment=overcast_environment(environment, sky, xi_atm.extinction, p.sky, seed, covered),
        snow=snow,
    )
