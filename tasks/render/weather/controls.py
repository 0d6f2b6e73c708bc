"""The paper's appearance controls: xi_road of what lies on the road, xi_atm of what falls (Eq. condition_controls).

The paper names the two maps and prints no numbers of them. Here they are the physical quantities that the layers take:
the road's look follows from the surface state alone, and the air's from the kind of weather and its rate alone.
"""

from dataclasses import dataclass

from tasks.render.weather.atmosphere import extinction_of_visual_range
from tasks.render.weather.falling.precipitation import Population, make_population
from tasks.render.weather.parameters import KindLook, WeatherParameters
from tasks.render.weather.sky import cloud_transmittance
from tasks.render.weather.wet.puddles import compute_wetness
from tasks.surface.state import SurfaceState


@dataclass(frozen=True, kw_only=True)
class RoadControls:
    """Look of the road, xi_road.

    Parameters
    ----------
    film_depth_mm : film from the bottom of the texture, h_t; 0 on a kind of weather that shows no film [mm]
    wet_share : share of the road that it wets [1]
    snow_depth_mm : h_s; 0 on a kind of weather that shows no snow [mm]
    snow_coverage : c_s; share of the coverage field up to which the road is covered [1]
    """

    film_depth_mm: float
    wet_share: float
    snow_depth_mm: float
    snow_coverage: float


@dataclass(frozen=True, kw_only=True)
class AirControls:
    """Look of the air, xi_atm.

    Parameters
    ----------
    population : what falls, by size; None where nothing does
    extinction : extinction coefficient of precipitation and haze [m-1]
    transmittance : light under the cloud by light under a clear sky [1]
    """

    population: Population | None
    extinction: float
    transmittance: float

    @property
    def visual_range_m(self) -> float:
        """Meteorological optical range [m]."""
        return extinction_of_visual_range(1.0) / self.extinction

    @property
    def particles_m3(self) -> float:
        """Number of particles of drawn sizes in a cubic metre, which rises with rain and falls with snow [m-3]."""
        return 0.0 if self.population is None else float(self.population.density.sum())


def road_controls(state: SurfaceState, look: KindLook) -> RoadControls:
    """Return the look of the road, psi_road(w, z_surf).

    Parameters
    ----------
    state : surface state; its rate is not read
    look : how its kind of weather looks
    """
    film = 0.0 if look.film is None else state.film_depth_mm
    covers = look.snow_cover is not None
    return RoadControls(
        film_depth_mm=film,
        wet_share=0.0 if look.film is None else compute_wetness(film, look.film.water),
        snow_depth_mm=state.snow_depth_mm if covers else 0.0,
        snow_coverage=state.snow_coverage if covers else 0.0,
    )


def air_controls(
    kind: str, rate_mm_h: float, parameters: WeatherParameters, visual_range_m: float | None = None
) -> AirControls:
    """Return the look of the air, psi_atm(w, r).

    Parameters
    ----------
    kind : kind of weather
    rate_mm_h : precipitation rate, water equivalent; 0 where it has ended [mm/h]
    parameters : the catalogue's values
    visual_range_m : meteorological optical range of the air without precipitation; None for the catalogue's [m]

    Raises
    ------
    InputError
        The kind is unknown.
    """
    particles = parameters.find_look(kind).particles
    falls = None if particles is None or rate_mm_h == 0 else make_population(particles, rate_mm_h)
    haze = extinction_of_visual_range(visual_range_m or parameters.air.haze_visual_range_m)
    return AirControls(
        population=falls,
        extinction=haze if falls is None else falls.extinction + haze,
        transmittance=cloud_transmittance(rate_mm_h, parameters.sky),
    )
