"""One scenario: the weather q, the controls u and the road g that everything else follows from."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields
from math import isfinite, pi
from operator import attrgetter
from typing import Any

from catalogs.entries import load
from catalogs.names import SkyName, WeatherName
from catalogs.physical_limits import (
    PhysicalLimits,
    find_least_problem,
    find_limit_problem,
)
from catalogs.quantities import Scalar
from catalogs.road_users import RoadUser
from tasks.render.weather.named_sky import OVERCAST
from tasks.surface.weather import DRY, WEATHERS, find_weather


@dataclass(frozen=True, kw_only=True, slots=True)
class Scenario:
    """The controls of one clip (paper, Eq. overall_pipeline: q, u, g), flat as they stand in a Parquet row.

    Parameters
    ----------
    weather : name of the kind of weather
    precipitation_mm_h : rain rate, or water-equivalent snow rate [mm/h]
    snow_accumulation_h : time over which the snow has fallen [h]
    initial_speed_km_h : speed at the start of the clip [km/h]
    peak_pressure_mpa : brake pressure after the ramp; 0 coasts [MPa]
    ramp_s : rise time of the pressure [s]
    hold_s : time at the peak before the release; None holds to the end [s]
    release_s : fall time of the pressure after the hold [s]
    brake_onset_s, brake_onset_m : brake onset by time [s] or by route position [m]; one of them
    hold_speed : the speed is held until the brake onset, without one throughout; else the car coasts
    hazard_center_m, hazard_length_m : where on the route the road feature lies and how long it is [m]
    hazard_height_m : positive a hump, negative a depression, 0 a flat road [m]
    objects : road users beside the ego vehicle; in no row of a table, which has one value a column
    scene : that it drives in; None is the one scene of its grid
    falling : rain or snow falls in the picture; where it has ended, the road is as it left it
    sky : kind of sky; None is closed cloud where it falls, on ice and in fog, else what the visual seed draws
    sun_azimuth_deg, sun_elevation_deg : of the sun, from world +x towards +y and above the horizon; None is what the
        visual seed draws [deg]
    visual_range_m : meteorological optical range of fog; None without fog [m]
    """

    weather: WeatherName = DRY
    precipitation_mm_h: float = 0.0
    snow_accumulation_h: float = 0.0
    initial_speed_km_h: float = 60.0
    peak_pressure_mpa: float = 0.0
    ramp_s: float = 0.5
    hold_s: float | None = None
    release_s: float = 0.5
    brake_onset_s: float | None = None
    brake_onset_m: float | None = None
    hold_speed: bool = False
    hazard_center_m: float = 0.0
    hazard_length_m: float = 0.0
    hazard_height_m: float = 0.0
    scene: str | None = None
    falling: bool = True
    sky: SkyName | None = None
    sun_azimuth_deg: float | None = None
    sun_elevation_deg: float | None = None
    visual_range_m: float | None = None
    objects: tuple[RoadUser, ...] = ()

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> "Scenario":
        """Return the scenario of a record as of `as_record`."""
        users = tuple(RoadUser.model_validate(user) for user in record.get("objects", ()))
        return cls(**{**record, "objects": users})

    def as_row(self) -> dict[str, Any]:
        """The fields in order, for a row of a table."""
        row = dict(zip(SCENARIO_FIELDS, _read_fields(self), strict=True))
        return row | {
            name: value for name, usual in OPTIONAL_FIELDS.items() if (value := getattr(self, name)) != usual
        }

    def as_record(self) -> dict[str, Any]:
        """The row and the road users, if any, for a manifest or a content id."""
        users = [user.as_record() for user in self.objects]
        return self.as_row() | ({"objects": users} if users else {})


OPTIONAL_FIELDS = {
    name: Scenario.__dataclass_fields__[name].default
    for name in ("scene", "falling", "sky", "sun_azimuth_deg", "sun_elevation_deg", "visual_range_m")
}
"""Fields that stand in a row only where they have another value than this one."""
SCENARIO_FIELDS = tuple(
    field.name for field in fields(Scenario) if field.name not in {*OPTIONAL_FIELDS, "objects"}
)
"""Fields of every row; road users are a list."""
_read_fields = attrgetter(*SCENARIO_FIELDS)
SUN_ANGLES = ("sun_azimuth_deg", "sun_elevation_deg")
SWITCHES = ("hold_speed", "falling")
NUMBERS = (
    *(name for name in SCENARIO_FIELDS if name not in {"weather", "hold_speed"}), *SUN_ANGLES, "visual_range_m",
)  # fmt: skip
NOT_NEGATIVE = (
    "precipitation_mm_h", "snow_accumulation_h", "peak_pressure_mpa", "hazard_length_m", "ramp_s", "release_s",
    "brake_onset_s", "brake_onset_m", "hold_s", *SUN_ANGLES,
)  # fmt: skip
HIGHEST = {
    "precipitation_mm_h": "rain_rate",
    "hazard_height_m": "hazard_height",
    "snow_accumulation_h": "snow_accumulation",
    "initial_speed_km_h": "initial_speed",
    "peak_pressure_mpa": "peak_pressure",
    **dict.fromkeys(("ramp_s", "hold_s", "release_s", "brake_onset_s"), "brake_time"),
    **dict.fromkeys(("brake_onset_m", "hazard_center_m"), "position"),
    "hazard_length_m": "hazard_length",
    "sun_azimuth_deg": "sun_azimuth",
    "sun_elevation_deg": "sun_elevation",
    "visual_range_m": "fog_visual_range",
}
"""Physical limit of each number, of a height by its size; a kind of weather may have another one of its rate."""
LEAST = {
    "initial_speed_km_h": "slowest_initial_speed",
    "sun_elevation_deg": "lowest_sun_elevation",
    "visual_range_m": "densest_fog",
}
"""Physical limit of each number from below."""
UNKNOWN_WEATHER = "unknown"
"""Replaces a weather that could not be read, as NaN replaces a number: no rule applies to either."""


def find_scenario_problems(scenario: Scenario, unknown: Collection[str] = ()) -> list[str]:
    """Every rule the scenario breaks by itself, each as one sentence; empty when it is sound.

    Parameters
    ----------
    scenario : its controls
    unknown : numbers that could not be read and are NaN
    """
    s = scenario
    problems = [
        f"{name} must be a finite number; it is {value}"
        for name in NUMBERS
        if (value := getattr(s, name)) is not None and not isfinite(value) and name not in unknown
    ]
    problems += find_range_problems(s)
    problems += _find_weather_problems(s)
    if s.peak_pressure_mpa > 0 and (s.brake_onset_s is None) == (s.brake_onset_m is None):
        problems.append(
            "braking (peak_pressure_mpa above 0) needs exactly one of brake_onset_s and brake_onset_m"
        )
    if s.peak_pressure_mpa > 0 and s.hold_s == s.ramp_s == s.release_s == 0:
        problems.append(
            "braking needs ramp_s, hold_s or release_s above 0; all are 0, and the brake never acts"
        )
    if abs(s.hazard_height_m) > 0 and s.hazard_length_m == 0:
        problems.append(f"a hazard of height {s.hazard_height_m:g} m needs hazard_length_m above 0; it is 0")
    if abs(s.hazard_height_m) > 0 and s.hazard_length_m > 0:
        limits = load("table of physical limits")
        found = [find_least_problem("hazard_length_m", s.hazard_length_m, limits.shortest_hazard)]
        steepest = pi * abs(s.hazard_height_m) / s.hazard_length_m
        if found == [None] and find_limit_problem("", abs(s.hazard_height_m), limits.hazard_height) is None:
            found = [
                find_limit_problem("pi hazard_height_m / hazard_length_m", steepest, limits.hazard_slope)
            ]
        problems += filter(None, found)
    return problems


def _find_weather_problems(s: Scenario) -> list[str]:
    """Rules of the row of its kind of weather that the scenario breaks."""
    if s.weather == UNKNOWN_WEATHER:
        return []
    kind, problems = find_weather(s.weather), []
    if kind.rate_limit is None and s.precipitation_mm_h > 0:
        falling = " or ".join(name for name, row in WEATHERS.items() if row.rate_limit)
        problems.append(
            f"weather {s.weather} has no precipitation; precipitation_mm_h is {s.precipitation_mm_h:g}: name {falling}"
        )
    if kind.rate_limit and s.precipitation_mm_h == 0:
        problems.append(f"weather {s.weather} needs precipitation_mm_h above 0; it is 0")
    if kind.accumulates and s.snow_accumulation_h == 0:
        problems.append(
            f"weather {s.weather} needs an accumulation time; snow_accumulation_h is 0: give the hours of snowfall"
        )
    if not kind.accumulates and s.snow_accumulation_h > 0:
        lying = " or ".join(name for name, row in WEATHERS.items() if row.accumulates)
        problems.append(
            f"snow_accumulation_h belongs to {lying}; the weather is {s.weather} and it is {s.snow_accumulation_h:g}"
        )
    if not s.falling and kind.rate_limit is None:
        problems.append(f"falling: false belongs to weather that falls; the weather is {s.weather}")
    if kind.obscures and s.visual_range_m is None:
        problems.append(
            f"weather {s.weather} needs visual_range_m, its meteorological optical range in metres"
        )
    if not kind.obscures and s.visual_range_m is not None:
        hiding = " or ".join(name for name, row in WEATHERS.items() if row.obscures)
        problems.append(
            f"visual_range_m belongs to {hiding}; the weather is {s.weather} and it is {s.visual_range_m:g}"
        )
    if kind.obscures and s.sky not in (None, OVERCAST):
        problems.append(f"sky {s.sky}: {s.weather} closes the sky: name {OVERCAST}, or none")
    falls = s.falling and kind.rate_limit is not None
    if falls and s.sky not in (None, OVERCAST):
        problems.append(
            f"sky {s.sky}: {s.weather} falls from closed cloud: name {OVERCAST}, or falling: false where it has ended"
        )
    if any(getattr(s, name) is not None for name in SUN_ANGLES) and s.sky in (None, OVERCAST):
        problems.append("sun_azimuth_deg and sun_elevation_deg need a named sky with a sun")
    return problems


def find_range_problems(scenario: Scenario) -> list[str]:
    """Every number of the scenario that no scenario may have, whatever the others are, each as one sentence.

    Parameters
    ----------
    scenario : its controls
    """
    given = {name: value for name in NOT_NEGATIVE if (value := getattr(scenario, name)) is not None}
    problems = [f"{name} must not be negative; it is {value:g}" for name, value in given.items() if value < 0]
    limits = load("table of physical limits")
    found = [
        find_least_problem(name, value, getattr(limits, least))
        for name, least in LEAST.items()
        if (value := getattr(scenario, name)) is not None
    ]
    found += [find_limit_problem(*one) for one in _list_limits(scenario, limits)]
    return problems + [problem for problem in found if problem is not None]


def list_ranges() -> dict[str, tuple[float | None, float]]:
    """Return the least and the largest value of each number of a scenario; None where there is no least [its unit]."""
    limits = load("table of physical limits")
    least: dict[str, float] = dict.fromkeys(NOT_NEGATIVE, 0.0)
    least |= {name: getattr(limits, lowest).value for name, lowest in LEAST.items()}
    least["hazard_height_m"] = -limits.hazard_height.value
    return {name: (least.get(name), getattr(limits, highest).value) for name, highest in HIGHEST.items()}


def _list_limits(s: Scenario, limits: PhysicalLimits) -> list[tuple[str, float, Scalar]]:
    """Each number with its name and its limit."""
    kind = WEATHERS.get(s.weather)
    limited = []
    for name, highest in HIGHEST.items():
        value = getattr(s, name)
        if name == "precipitation_mm_h" and kind and kind.rate_limit:
            highest = kind.rate_limit
        if name == "hazard_height_m":
            name, value = f"the size of {name}", abs(value)
        if value is not None:
            limited.append((name, value, getattr(limits, highest)))
    if kind and kind.accumulates and not any(find_limit_problem(*one) for one in limited):
        fallen = s.precipitation_mm_h * s.snow_accumulation_h
        limited.append(("precipitation_mm_h times snow_accumulation_h", fallen, limits.snow_water_equivalent))
    return limited


def find_route_problems(scenario: Scenario, route_length_m: float, scene: str) -> list[str]:
    """Rules that tie the scenario to the route it drives on."""
    if scenario.hazard_height_m == 0:
        return []
    start = scenario.hazard_center_m - scenario.hazard_length_m / 2
    end = scenario.hazard_center_m + scenario.hazard_length_m / 2
    if start < 0 or end > route_length_m:
        return [
            f"the hazard must lie on the route of scene {scene} (0 to {route_length_m:.1f} m);"
            f" it reaches from {start:.2f} to {end:.2f} m: move hazard_center_m or shorten hazard_length_m"
        ]
    return []
