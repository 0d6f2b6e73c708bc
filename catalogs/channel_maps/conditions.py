"""The weather and the road of a measured run, which its logger does not know."""

from collections.abc import Mapping
from typing import Any, Literal

from catalogs.names import WeatherName
from catalogs.quantities import CatalogueEntry, Number
from catalogs.scenario import SCENARIO_FIELDS, Scenario, find_scenario_problems
from tasks.surface.weather import DRY


class Conditions(CatalogueEntry):
    """Facts of a run that the logger does not know; the columns of runs.csv."""

    weather: WeatherName = DRY
    precipitation_mm_h: Number = 0.0
    snow_accumulation_h: Number = 0.0
    direction: Literal[1, -1] = 1
    disc_temperature_above_ambient_c: Number = 0.0
    hazard_center_m: Number = 0.0
    hazard_length_m: Number = 0.0
    hazard_height_m: Number = 0.0


def find_condition_problems(facts: Mapping[str, Any]) -> list[str]:
    """Rules of a scenario that a run's weather and road break; other facts are left out.

    Parameters
    ----------
    facts : weather and numbers by the names of `Scenario`
    """
    return find_scenario_problems(
        Scenario(**{name: facts[name] for name in SCENARIO_FIELDS if name in facts})
    )
