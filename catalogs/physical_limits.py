"""Physical limits that no scenario and no clip may exceed."""

from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, require_quantity

Speed = Annotated[Scalar, require_quantity("km h-1", above=0)]
Seconds = Annotated[Scalar, require_quantity("s", above=0)]
Metres = Annotated[Scalar, require_quantity("m", above=0)]
Degrees = Annotated[Scalar, require_quantity("deg", above=0)]
Rate = Annotated[Scalar, require_quantity("mm h-1", above=0)]


class PhysicalLimits(CatalogueEntry):
    """The largest value of each quantity, and of some also the smallest.

    ``position`` is along the route, ``brake_time`` any time of a brake, ``hazard_slope`` of a feature's steepest flank,
    ``road_grade`` of a scene's steepest road.
    """

    rain_rate: Rate
    snow_rate: Rate
    snow_accumulation: Annotated[Scalar, require_quantity("h", above=0)]
    snow_water_equivalent: Annotated[Scalar, require_quantity("mm", above=0)]
    initial_speed: Speed
    slowest_initial_speed: Speed
    peak_pressure: Annotated[Scalar, require_quantity("MPa", above=0)]
    brake_time: Seconds
    position: Metres
    hazard_length: Metres
    shortest_hazard: Metres
    hazard_height: Metres
    duration: Seconds
    hazard_slope: Annotated[Scalar, require_quantity("1", above=0)]
    strut_travel: Metres
    road_grade: Annotated[Scalar, require_quantity("1", above=0)]
    sun_azimuth: Degrees
    sun_elevation: Degrees
    lowest_sun_elevation: Degrees
    fog_visual_range: Metres
    densest_fog: Metres
    frame_rate: Annotated[Scalar, require_quantity("Hz", above=0)]
    frames: Annotated[Scalar, require_quantity("1", minimum=2)]


def find_limit_problem(name: str, value: float, limit: Scalar) -> str | None:
    """A sentence where a value exceeds its limit, else None.

    Parameters
    ----------
    name : what the value is called where it was given
    value : in the limit's unit
    limit : of the catalogue
    """
    if not value > limit.value:
        return None
    return f"{name} must be at most {_write_limit(limit)} ({limit.source}); it is {value:g}"


def find_least_problem(name: str, value: float, least: Scalar) -> str | None:
    """A sentence where a value falls short of the least that it may be, else None.

    Parameters
    ----------
    name, value, least : as of `find_limit_problem`
    """
    if not value < least.value:
        return None
    return f"{name} must be at least {_write_limit(least)} ({least.source}); it is {value:g}"


def _write_limit(limit: Scalar) -> str:
    return f"{limit.value:g}" if limit.unit == "1" else f"{limit.value:g} {limit.unit}"
