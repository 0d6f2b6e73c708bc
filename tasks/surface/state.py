"""Numbers of the pavement, and what lies on it: the state that the vehicle and the renderer share."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite, nan

from tasks.errors import InputError
from tasks.surface.wet_friction import ANY_SPEED, WetGrip


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
    glaze_mm : clear ice after freezing rain, from the bottom of the texture; NaN where no entry of ice was read [mm]
    ice_friction : friction of that ice, mu_ice; NaN where no entry of ice was read [1]
    wet_friction : friction on wet texture at rest; this and what follows is NaN under the paper's law, which knows no
        speed [1]
    wet_decay_speed : speed over which it falls to 1/e [m/s]
    wet_planing_film_mm : film above the texture that carries 1 - 1/e of the load from the onset of hydroplaning on [mm]
    wet_planing_exponent : of that film [1]
    wet_tyre_pressure_kpa : inflation pressure, from which that onset follows [kPa]
    wet_planing_friction : friction that is left where water carries the tyre [1]
    wet_reference_speed : speed at which the friction of the surface state holds [m/s]
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
    glaze_mm: float = nan
    ice_friction: float = nan
    wet_friction: float = nan
    wet_decay_speed: float = nan
    wet_planing_film_mm: float = nan
    wet_planing_exponent: float = nan
    wet_tyre_pressure_kpa: float = nan
    wet_planing_friction: float = nan
    wet_reference_speed: float = nan
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict, compare=False)

    @property
    def grips_by_speed(self) -> bool:
        """Whether wet friction depends on speed, beside the film."""
        return isfinite(self.wet_friction)


@dataclass(frozen=True, kw_only=True)
class SurfaceState:
    """State of the road: weather, film, snow and friction (paper, Eq. surface_state: w, r, h_t, h_s, c_s; mu_c).

    Parameters
    ----------
    kind : kind of weather, a row of ``tasks.surface.weather.WEATHERS``
    precipitation_mm_h : what falls, water equivalent; 0 where it has ended [mm/h]
    film_depth_mm : total depth of the film from the bottom of the texture, h_t [mm]
    snow_depth_mm : h_s [mm]
    snow_coverage : share of the road that snow covers, c_s; friction takes it for that of the tyres' contact [1]
    friction : reference surface coefficient, mu_c; NaN where only the picture is asked for [1]
    grip : how friction depends on speed; mu_c is that at the pavement's ``wet_reference_speed``
    visual_range_m : meteorological optical range of fog; infinite without fog [m]

    Raises
    ------
    InputError
        Listing every number that is out of its range.
    """

    kind: str
    precipitation_mm_h: float = 0.0
    film_depth_mm: float = 0.0
    snow_depth_mm: float = 0.0
    snow_coverage: float = 0.0
    friction: float = nan
    grip: WetGrip = ANY_SPEED
    visual_range_m: float = inf

    def __post_init__(self) -> None:
        problems = [
            f"weather: {name} must be a number of 0 or more; it is {value:g}"
            for name in ("precipitation_mm_h", "film_depth_mm", "snow_depth_mm", "snow_coverage")
            if not (isfinite(value := getattr(self, name)) and value >= 0)
        ]
        if not self.visual_range_m > 0:
            problems.append(f"weather: visual_range_m must be above 0; it is {self.visual_range_m:g}")
        if self.snow_coverage > 1:
            problems.append(f"weather: snow_coverage must not exceed 1; it is {self.snow_coverage:g}")
        if problems:
            raise InputError(problems)


@dataclass(frozen=True, kw_only=True)
class Derivation:
    """How one number of the surface state follows, with the values put in.

    Parameters
    ----------
    field : of ``SurfaceState``
    quantity : what it is
    symbol : the paper's
    equation : the paper's number; S counts the supplement's
    formula : for people
    """

    field: str
    quantity: str
    symbol: str
    equation: str
    formula: str
