"""All that the weather's look is made from."""

from collections.abc import Mapping
from dataclasses import dataclass

from tasks.errors import InputError
from tasks.render.weather.falling.precipitation import NearField, ParticleParameters
from tasks.render.weather.sky import SkyParameters
from tasks.render.weather.snow.layer import SnowCoverParameters
from tasks.render.weather.wet.soaked import SoakedWallParameters
from tasks.render.weather.wet.wet_road import RoadFilmParameters
from tasks.surface.weather import find_weather


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
class KindLook:
    """How one kind of weather looks; what it does not have is None.

    Parameters
    ----------
    particles : what falls, with its extinction
    film : the film on the road, of water or of ice
    walls : how rain wets what stands
    snow_cover : snow on the ground
    anchors_mm_h : rates, ascending, between which the paper's composition blends pictures [mm/h]
    """

    particles: ParticleParameters | None = None
    film: RoadFilmParameters | None = None
    walls: SoakedWallParameters | None = None
    snow_cover: SnowCoverParameters | None = None
    anchors_mm_h: tuple[float, ...] | None = None


@dataclass(frozen=True, kw_only=True)
class WeatherParameters:
    """The catalogue's values, one member for each file but for the kinds, which have a file each.

    Parameters
    ----------
    air : what precipitation falls through
    sky : the light
    kinds : how each kind of weather under cloud looks, by its name
    """

    air: AirParameters
    sky: SkyParameters
    kinds: Mapping[str, KindLook]

    def find_look(self, kind: str) -> KindLook:
        """How a kind of weather looks; in dry weather and in fog nothing falls and nothing lies.

        Parameters
        ----------
        kind : name of the kind

        Raises
        ------
        InputError
            If there is no such kind, or the catalogue has no entry of it.
        """
        row = find_weather(kind)
        if row.obscures or not row.overcast:
            return KindLook()
        if kind not in self.kinds:
            raise InputError(
                f"weather {kind}: the weather catalogue has no {kind}.yaml, which says how it looks"
            )
        return self.kinds[kind]
