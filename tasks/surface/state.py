"""Weather to the state of the road surface: water film, snow depth and snow coverage."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

WeatherKind = Literal["dry", "rain", "snow"]


@dataclass(frozen=True, kw_only=True)
class Weather:
    """The precipitation that falls on the road (paper, Eq. surface_state: w, r, tau_s).

    Parameters
    ----------
    kind : dry, rain or snow; also the name of the tyre family
    precipitation_mm_h : rain rate, or water-equivalent snow rate [mm/h]
    snow_accumulation_h : time over which the snow has fallen [h]
    """

    kind: WeatherKind
    precipitation_mm_h: float = 0.0
    snow_accumulation_h: float = 0.0


@dataclass(frozen=True, kw_only=True)
class SurfaceParameters:
    """A pavement and its friction anchors (paper, Appendix E, Table surface_parameter_sources).

    Parameters
    ----------
    dry_friction : friction of the dry pavement, mu_dry [1]
    flooded_friction : friction under a deep film, mu_flooded [1]
    film_decay_mm : film depth over which wet friction decays, h_c [mm]
    texture_depth_mm : mean texture depth, MTD [mm]
    drainage_length : drainage path length, L_d [m]
    crossfall : S [m/m]
    film_coefficient, film_texture_exponent, film_length_exponent, film_rate_exponent,
    film_crossfall_exponent : the Gallaway relation for MTD [mm], L_d [m], rain [mm/h] and S [m/m] [1]
    bare_wet_friction : friction where snow has not yet covered, mu_bw [1]
    snow_friction : friction of the covered pavement, mu_snow [1]
    fresh_snow_density : rho_s [kg/m3]
    water_density : rho_w [kg/m3]
    full_cover_depth_mm : snow depth that covers the whole pavement, h_cover [mm]
    bounds : declared range of each parameter that the sensitivity study varies, by field name
    """

    dry_friction: float
    flooded_friction: float
    film_decay_mm: float
    texture_depth_mm: float
    drainage_length: float
    crossfall: float
    film_coefficient: float
    film_texture_exponent: float
    film_length_exponent: float
    film_rate_exponent: float
    film_crossfall_exponent: float
    bare_wet_friction: float
    snow_friction: float
    fresh_snow_density: float
    water_density: float
    full_cover_depth_mm: float
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict, compare=False)


@dataclass(frozen=True, kw_only=True)
class SurfaceState:
    """What lies on the road (paper, Eq. surface_state: h_t, h_s, c_s); zero outside its weather.

    Parameters
    ----------
    film_depth_mm : total water depth from the bottom of the texture, h_t [mm]
    free_film_mm : water above the texture peaks, h_f, a diagnostic [mm]
    texture_fill : share of the texture depth that the water fills, a diagnostic [1]
    snow_depth_mm : h_s [mm]
    snow_coverage : share of the tyre contact on snow, c_s [1]
    """

    film_depth_mm: float
    free_film_mm: float
    texture_fill: float
    snow_depth_mm: float
    snow_coverage: float


def film_depth(precipitation_mm_h: float, parameters: SurfaceParameters) -> float:
    """Steady water depth on a draining pavement [mm], by the metric Gallaway relation.

    Parameters
    ----------
    precipitation_mm_h : rain rate, not negative [mm/h]
    parameters : the pavement

    References
    ----------
    Paper, Appendix E; Gallaway et al. 1979, FHWA-RD-79-31.
    """
    p = parameters
    return (
        p.film_coefficient
        * p.texture_depth_mm**p.film_texture_exponent
        * p.drainage_length**p.film_length_exponent
        * precipitation_mm_h**p.film_rate_exponent
        * p.crossfall**p.film_crossfall_exponent
    )


def snow_depth(precipitation_mm_h: float, accumulation_h: float, parameters: SurfaceParameters) -> float:
    """Fresh snow on the ground [mm] (paper, Eq. surface_evolution).

    Parameters
    ----------
    precipitation_mm_h : water-equivalent snow rate [mm/h]
    accumulation_h : how long it has fallen [h]
    parameters : holds the densities of water and fresh snow
    """
    return precipitation_mm_h * accumulation_h * parameters.water_density / parameters.fresh_snow_density


def surface_state(weather: Weather, parameters: SurfaceParameters) -> SurfaceState:
    """What the weather leaves on the pavement, Phi_surf (paper, Eqs. surface_state and surface_evolution).

    Parameters
    ----------
    weather : kind, rate and accumulation time
    parameters : the pavement

    Returns
    -------
    SurfaceState
        Quantities of another kind of weather are zero.
    """
    h_t = film_depth(weather.precipitation_mm_h, parameters) if weather.kind == "rain" else 0.0
    h_s = 0.0
    if weather.kind == "snow":
        h_s = snow_depth(weather.precipitation_mm_h, weather.snow_accumulation_h, parameters)
    return SurfaceState(
        film_depth_mm=h_t,
        free_film_mm=max(0.0, h_t - parameters.texture_depth_mm),
        texture_fill=min(1.0, h_t / parameters.texture_depth_mm),
        snow_depth_mm=h_s,
        snow_coverage=min(1.0, h_s / parameters.full_cover_depth_mm),
    )
