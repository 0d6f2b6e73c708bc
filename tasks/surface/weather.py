"""The one table of weathers: what a kind of weather leaves on the road, and how the road then grips.

A row says what a scenario of its kind gives and which laws follow. Its numbers stand in the pavement's entry and, under
its own name, in ``catalogs/weather/``: particles with their extinction, film or snow cover, exposure, and a tyre family
for vehicles that have none of their own. To add a kind is one row here, one entry there, and one closed form in
``studies.physics_judge.laws``, where the judge has a table of its own.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, inf

from tasks.errors import InputError
from tasks.surface.state import Derivation, SurfaceParameters, SurfaceState
from tasks.surface.wet_friction import ANY_SPEED, WetGrip, make_wet_grip


@dataclass(frozen=True, kw_only=True)
class Weather:
    """The weather of a scenario (paper, Eq. surface_state: w, r, tau_s).

    Parameters
    ----------
    kind : name of a row of ``WEATHERS``; also the name of the telemetry's family and of the tyre family
    precipitation_mm_h : rain rate, or water-equivalent snow rate [mm/h]
    snow_accumulation_h : time over which the snow has fallen [h]
    falling : whether it still falls; where it has just ended, the road is as it left it
    visual_range_m : meteorological optical range of fog; infinite without fog [m]

    Raises
    ------
    InputError
        If there is no such kind.
    """

    kind: str
    precipitation_mm_h: float = 0.0
    snow_accumulation_h: float = 0.0
    falling: bool = True
    visual_range_m: float = inf

    def __post_init__(self) -> None:
        find_weather(self.kind)


Law = Callable[[Weather, SurfaceParameters], float]


def film_depth(weather: Weather, parameters: SurfaceParameters) -> float:
    """Steady water depth on a draining pavement, h_t [mm], by the metric Gallaway relation.

    Parameters
    ----------
    weather : its rate is not negative
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
        * weather.precipitation_mm_h**p.film_rate_exponent
        * p.crossfall**p.film_crossfall_exponent
    )


def snow_depth(weather: Weather, parameters: SurfaceParameters) -> float:
    """Depth of the fresh snow on the ground, h_s [mm] (paper, Eq. surface_evolution).

    Parameters
    ----------
    weather : rate and accumulation time
    parameters : holds the densities of water and fresh snow
    """
    p = parameters
    return weather.precipitation_mm_h * weather.snow_accumulation_h * p.water_density / p.fresh_snow_density


def glaze_depth(weather: Weather, parameters: SurfaceParameters) -> float:
    """Depth of the clear ice that freezing rain has left, from the bottom of the texture [mm]; nothing falls any more.

    Parameters
    ----------
    weather : not used
    parameters : holds the glaze
    """
    return parameters.glaze_mm


def dry_friction(film_mm: float, coverage: float, parameters: SurfaceParameters) -> float:
    """Friction of the dry pavement, mu_dry [1] (paper, Eq. surface_friction_mapping)."""
    return parameters.dry_friction


def wet_friction(film_mm: float, coverage: float, parameters: SurfaceParameters) -> float:
    """Friction under a film of water, from dry_friction down to flooded_friction, or that at the reference speed [1].

    Parameters
    ----------
    film_mm : film depth h_t [mm]
    coverage : not used
    parameters : the friction anchors

    References
    ----------
    Paper, Eq. surface_friction_mapping; `tasks.surface.wet_friction` where the pavement grips by speed.
    """
    p = parameters
    if p.grips_by_speed:
        return p.wet_friction * find_wet_grip(film_mm, p).reference
    r_f = p.flooded_friction / p.dry_friction
    return p.dry_friction * (r_f + (1 - r_f) * exp(-film_mm / p.film_decay_mm))


def find_wet_grip(film_mm: float, parameters: SurfaceParameters) -> WetGrip:
    """Return how friction under a film depends on speed, on a pavement that grips by speed.

    Parameters
    ----------
    film_mm : film depth h_t [mm]
    parameters : the pavement
    """
    p = parameters
    return make_wet_grip(
        film_mm - p.texture_depth_mm, p.wet_friction, p.wet_decay_speed, p.wet_planing_film_mm,
        p.wet_planing_exponent, p.wet_tyre_pressure_kpa, p.wet_planing_friction, p.wet_reference_speed,
    )  # fmt: skip


def snow_friction(film_mm: float, coverage: float, parameters: SurfaceParameters) -> float:
    """Friction of a road that snow covers in part, from bare_wet_friction down to snow_friction [1].

    At no snow it is not dry_friction: between dry and the lightest snow there is a jump, as in the paper.

    Parameters
    ----------
    film_mm : not used
    coverage : share of the road that snow covers, c_s, taken for that of the contact [1]
    parameters : the friction anchors

    References
    ----------
    Paper, Eq. surface_friction_mapping.
    """
    p = parameters
    return p.bare_wet_friction - (p.bare_wet_friction - p.snow_friction) * coverage


def ice_friction(film_mm: float, coverage: float, parameters: SurfaceParameters) -> float:
    """Friction of black ice, whatever the pavement below [1] (Wallman & Astrom 2001, VTI meddelande 911A).

    Parameters
    ----------
    film_mm, coverage : not used
    parameters : the friction anchors
    """
    return parameters.ice_friction


def derive_dry(weather: Weather, state: SurfaceState, p: SurfaceParameters) -> tuple[Derivation, ...]:
    """Derivation of a dry road's friction."""
    return (_friction_derivation("5", f"dry pavement: {p.dry_friction:g}"),)


def derive_rain(weather: Weather, state: SurfaceState, p: SurfaceParameters) -> tuple[Derivation, ...]:
    """Derivations of film and friction in rain."""
    r_f = p.flooded_friction / p.dry_friction
    decay = f"exp(-{state.film_depth_mm:.4g} / {p.film_decay_mm:g})"
    friction = _friction_derivation("5, S22", f"{p.dry_friction:g} * ({r_f:.4g} + (1 - {r_f:.4g}) * {decay})")
    if p.grips_by_speed:
        speed = p.wet_reference_speed
        friction = _friction_derivation(
            "none",
            f"at {3.6 * speed:.3g} km/h: {p.wet_friction:g} * exp(-{speed:.4g} / {p.wet_decay_speed:.4g})"
            f" * (1 - {state.grip.carried:.4g} * min({speed:.4g} / {state.grip.onset:.4g}, 1)^2)",
        )
    return (
        Derivation(
            field="film_depth_mm", quantity="water film", symbol="h_t", equation="3, S21",
            formula=f"{p.film_coefficient:g} * {p.texture_depth_mm:g}^{p.film_texture_exponent:g}"
            f" * {p.drainage_length:g}^{p.film_length_exponent:g}"
            f" * {weather.precipitation_mm_h:g}^{p.film_rate_exponent:g}"
            f" * {p.crossfall:g}^{p.film_crossfall_exponent:g}",
        ),
        friction,
    )  # fmt: skip


def derive_snow(weather: Weather, state: SurfaceState, p: SurfaceParameters) -> tuple[Derivation, ...]:
    """Derivations of depth, coverage and friction in snow."""
    lost = f"({p.bare_wet_friction:g} - {p.snow_friction:g})"
    return (
        Derivation(
            field="snow_depth_mm", quantity="snow depth", symbol="h_s", equation="3, S23",
            formula=f"{weather.precipitation_mm_h:g} * {weather.snow_accumulation_h:g}"
            f" * {p.water_density:g} / {p.fresh_snow_density:g}",
        ),
        Derivation(
            field="snow_coverage", quantity="snow coverage", symbol="c_s", equation="3, S23",
            formula=f"min(1, {state.snow_depth_mm:.4g} / {p.full_cover_depth_mm:g})",
        ),
        _friction_derivation("5, S23", f"{p.bare_wet_friction:g} - {lost} * {state.snow_coverage:.4g}"),
    )  # fmt: skip


def derive_ice(weather: Weather, state: SurfaceState, p: SurfaceParameters) -> tuple[Derivation, ...]:
    """Derivations of the glaze and its friction, of which the paper has none."""
    return (
        Derivation(
            field="film_depth_mm", quantity="ice film", symbol="h_t", equation="none",
            formula=f"glaze: {p.glaze_mm:g}",
        ),
        _friction_derivation("none", f"black ice: {p.ice_friction:g}"),
    )  # fmt: skip


def _friction_derivation(equation: str, formula: str) -> Derivation:
    return Derivation(
        field="friction", quantity="surface friction", symbol="mu_c", equation=equation, formula=formula
    )


@dataclass(frozen=True, kw_only=True)
class WeatherKind:
    """One row of the table.

    Parameters
    ----------
    name : what scenarios, telemetry, tyre families and the entry in ``catalogs/weather/`` call it
    code : its number where a number stands for it, as in an FMU; never that of another kind, never changed [1]
    film : depth of the film on the road; None where it leaves none [mm]
    snow : depth of the snow on it; None where it leaves none [mm]
    friction : film depth [mm], snow coverage [1] and pavement to mu_c [1]
    derive : how those follow, for people
    rate_limit : name of the physical limit of its precipitation rate; None where nothing falls
    accumulates : it lies as deep as the hours make it
    overcast : it comes with closed cloud, and if it does not obscure has an entry in ``catalogs/weather/`` that says
        how it looks
    wet : liquid water lies under the wheels
    obscures : all of it is air that hides what is far, by the visual range of the scenario
    grips_as : kind whose tyre family it takes; None has a family of its own
    """

    name: str
    code: int
    film: Law | None = None
    snow: Law | None = None
    friction: Callable[[float, float, SurfaceParameters], float]
    derive: Callable[[Weather, SurfaceState, SurfaceParameters], tuple[Derivation, ...]]
    rate_limit: str | None = None
    accumulates: bool = False
    overcast: bool = True
    wet: bool = False
    obscures: bool = False
    grips_as: str | None = None

    @property
    def tyre_family(self) -> str:
        """The kind of weather whose tyre family it takes."""
        return self.grips_as or self.name


DRY = "dry"
"""The kind that every other is held against."""

WEATHERS: Mapping[str, WeatherKind] = {
    row.name: row
    for row in (
        WeatherKind(name=DRY, code=1, friction=dry_friction, derive=derive_dry, overcast=False),
        WeatherKind(
            name="rain", code=2, film=film_depth, friction=wet_friction, derive=derive_rain, rate_limit="rain_rate",
            wet=True,
        ),
        WeatherKind(
            name="snow", code=3, snow=snow_depth, friction=snow_friction, derive=derive_snow, rate_limit="snow_rate",
            accumulates=True,
        ),
        WeatherKind(name="ice", code=4, film=glaze_depth, friction=ice_friction, derive=derive_ice),
        WeatherKind(name="fog", code=5, friction=dry_friction, derive=derive_dry, obscures=True, grips_as=DRY),
    )
}  # fmt: skip
"""Every kind of weather there is, by its name."""


def list_by_code() -> tuple[str, ...]:
    """Return the name of the kind of each code, from 1 on; empty where no kind has the code."""
    names = {row.code: row.name for row in WEATHERS.values()}
    return tuple(names.get(code, "") for code in range(1, max(names) + 1))


def find_weather_problem(name: str) -> str | None:
    """The rest of a sentence on a name that is no kind of weather; None where it is one."""
    if name in WEATHERS:
        return None
    *others, last = WEATHERS
    return f"must be {', '.join(others)} or {last}; it is {str(name)[:60]!r}"


def has_closed_cloud(state: SurfaceState) -> bool:
    """Whether cloud closes the sky over a road: as long as it falls, and over what never falls, such as ice.

    Parameters
    ----------
    state : of the road
    """
    kind = find_weather(state.kind)
    return kind.overcast and (kind.rate_limit is None or state.precipitation_mm_h > 0)


def find_weather(name: str) -> WeatherKind:
    """The row of a kind of weather.

    Parameters
    ----------
    name : of the kind

    Raises
    ------
    InputError
        If there is no such kind; the sentence lists those that exist.
    """
    if problem := find_weather_problem(name):
        raise InputError(f"weather {problem}")
    return WEATHERS[name]


def surface_state(weather: Weather, parameters: SurfaceParameters) -> SurfaceState:
    """The state in which the weather leaves the pavement, Phi_surf, and its friction.

    Parameters
    ----------
    weather : kind, rate and accumulation time
    parameters : the pavement

    Returns
    -------
    SurfaceState
        What the kind does not leave on the road is 0.

    References
    ----------
    Paper, Eqs. surface_state, surface_evolution and surface_friction_mapping.
    """
    kind = find_weather(weather.kind)
    film, snow = (law(weather, parameters) if law else 0.0 for law in (kind.film, kind.snow))
    coverage = min(1.0, snow / parameters.full_cover_depth_mm)
    return SurfaceState(
        kind=kind.name,
        precipitation_mm_h=weather.precipitation_mm_h if kind.rate_limit and weather.falling else 0.0,
        film_depth_mm=film,
        snow_depth_mm=snow,
        snow_coverage=coverage,
        friction=kind.friction(film, coverage, parameters),
        visual_range_m=weather.visual_range_m if kind.obscures else inf,
        grip=find_wet_grip(film, parameters) if kind.wet and parameters.grips_by_speed else ANY_SPEED,
    )
