"""All that the weather's look is made from, and the weather of one clip."""

from dataclasses import dataclass
from typing import Literal

from tasks.render.weather.falling.precipitation import NearField, ParticleParameters
from tasks.render.weather.sky import SkyParameters
from tasks.render.weather.snow.layer import SnowCoverParameters
from tasks.render.weather.wet.wet_road import WetRoadParameters


@dataclass(frozen=True, kw_only=True)
class AirParameters:
    """The air but for its precipitation.

    Parameters
    ----------
    haze_visual_range_m : meteorological optical range of the moist air between the drops or flakes [m]
    wind_m_s : velocity of the air in the world, x, y, z [m s-1]
    near : where particles are drawn one by one
    """

    haze_visual_range_m: float
    wind_m_s: tuple[float, float, float]
    near: NearField


@dataclass(frozen=True, kw_only=True)
class WeatherParameters:
    """The catalogue's values, one member for each file.

    Parameters
    ----------
    rain, snowfall : what falls
    air : what it falls through
    sky : the light
    wet_road : water on the road
    snow_cover : snow on the road
    """

    rain: ParticleParameters
    snowfall: ParticleParameters
    air: AirParameters
    sky: SkyParameters
    wet_road: WetRoadParameters
    snow_cover: SnowCoverParameters


@dataclass(frozen=True, kw_only=True)
class WeatherState:
    """The weather of one clip, as the surface model gives it.

    Parameters
    ----------
    kind : dry, rain or snow
    precipitation_mm_h : rain rate, or water-equivalent snow rate; 0 when dry [mm/h]
    film_depth_mm : water film h_t [mm]
    snow_depth_mm : snow depth h_s [mm]
    snow_coverage : c_s [1]
    """

    kind: Literal["dry", "rain", "snow"]
    precipitation_mm_h: float = 0.0
    film_depth_mm: float = 0.0
    snow_depth_mm: float = 0.0
    snow_coverage: float = 0.0
