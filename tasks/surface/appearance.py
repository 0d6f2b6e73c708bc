"""Surface state and weather to what the renderer needs: the wet or white road, and how far one sees.

Physical quantities only; how they become colours is the renderer's business.
"""

from dataclasses import dataclass
from math import log

from tasks.surface.state import SurfaceState, Weather

CLEAR_AIR_RANGE_KM = 23.0
"""Meteorological range of the clear rural atmosphere (Shettle & Fenn 1979, AFGL-TR-79-0214) [km]."""

CONTRAST_THRESHOLD = 0.02
"""Contrast at which a dark object vanishes (Koschmieder 1924) [1]."""

PRECIPITATION_EXTINCTION = {"dry": (0.0, 1.0), "rain": (0.365, 0.63), "snow": (3.826, 0.7776)}
"""Coefficient and exponent of extinction [km-1] against rate [mm/h].

Rain: LOWTRAN 7 (Shettle 1989, AGARD-CP-454). Snow: 10.36 C^0.7776 of the mass C [g/m3] of snow in the air
(Stoelinga & Warner 1999, doi:10.1175/1520-0450(1999)038<0385:NMMSOC>2.0.CO;2), where C = rate / 3.6 for
aggregates that fall at 1 m/s (Locatelli & Hobbs 1974, doi:10.1029/JC079i015p02185).
"""


@dataclass(frozen=True, kw_only=True)
class RoadAppearance:
    """What the road looks like, xi_road (paper, Eq. condition_controls).

    Parameters
    ----------
    film_depth_mm : water above the bottom of the texture [mm]
    free_film_mm : water above the texture peaks, which mirrors [mm]
    wetness : share of the uncovered pavement that is under water or soaked [1]
    snow_coverage : share of the pavement under snow [1]
    snow_depth_mm : depth of that snow [mm]
    """

    film_depth_mm: float
    free_film_mm: float
    wetness: float
    snow_coverage: float
    snow_depth_mm: float


@dataclass(frozen=True, kw_only=True)
class AtmosphereAppearance:
    """What the air looks like, xi_atm (paper, Eq. condition_controls).

    Parameters
    ----------
    precipitation_mm_h : rate of the precipitation in the air, water equivalent [mm/h]
    extinction_per_km : visible extinction of air and precipitation together [km-1]
    visibility_m : meteorological range, where contrast falls to 0.02 [m]
    """

    precipitation_mm_h: float
    extinction_per_km: float
    visibility_m: float


def road_appearance(weather: Weather, state: SurfaceState) -> RoadAppearance:
    """Appearance controls of the road, psi_road; each rises with the rate.

    In rain the wet share is how far the water fills the texture. In snow the pavement between the flakes is
    bare and wet: that is the anchor mu_bw which the friction mapping gives it.

    Parameters
    ----------
    weather : kind of weather
    state : its surface state
    """
    return RoadAppearance(
        film_depth_mm=state.film_depth_mm,
        free_film_mm=state.free_film_mm,
        wetness=1.0 if weather.kind == "snow" else state.texture_fill,
        snow_coverage=state.snow_coverage,
        snow_depth_mm=state.snow_depth_mm,
    )


def atmosphere_appearance(weather: Weather) -> AtmosphereAppearance:
    """Appearance controls of the air, psi_atm: extinction by clear air plus precipitation, and its range.

    Parameters
    ----------
    weather : kind and rate
    """
    rate = 0.0 if weather.kind == "dry" else weather.precipitation_mm_h
    coefficient, exponent = PRECIPITATION_EXTINCTION[weather.kind]
    optical_range = -log(CONTRAST_THRESHOLD)
    extinction = optical_range / CLEAR_AIR_RANGE_KM + coefficient * rate**exponent
    return AtmosphereAppearance(
        precipitation_mm_h=rate,
        extinction_per_km=extinction,
        visibility_m=1000 * optical_range / extinction,
    )
