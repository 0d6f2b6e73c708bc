"""Conditions on scenarios: which combinations a grid leaves out, and to which split a clip belongs."""

from collections.abc import Mapping
from math import isfinite
from typing import Annotated, Any

from pydantic import Field, RootModel, model_validator

from catalogs.calibrated_range import CALIBRATION_TAGS, calibration_tag
from catalogs.entries import load
from catalogs.grids.blocks import Number, Strict
from catalogs.scenario import NUMBERS, OPTIONAL_FIELDS, SCENARIO_FIELDS, SWITCHES, Scenario
from catalogs.sentences import shorten_value
from tasks.surface.weather import find_weather_problem

CALIBRATION = "calibration"
Value = bool | str | float


class Between(Strict):
    """A closed interval; an end that is left out is open."""

    min: Number | None = None
    max: Number | None = None

    @model_validator(mode="after")
    def _holds_something(self) -> "Between":
        if self.min is None and self.max is None:
            raise ValueError("an interval needs min, max or both; it has neither")
        return self

    def holds(self, value: Any) -> bool:
        return (
            isinstance(value, int | float)
            and (self.min is None or value >= self.min)
            and (self.max is None or value <= self.max)
        )


class Condition(RootModel[dict[str, Value | Annotated[list[Value], Field(min_length=1)] | Between]]):
    """Scenario fields, or ``calibration``, to a value, a list of values or an interval; all have to hold."""

    @model_validator(mode="after")
    def _names_are_known(self) -> "Condition":
        known = (*SCENARIO_FIELDS, *OPTIONAL_FIELDS, CALIBRATION)
        problems = [
            f"{name}: no such field; there are {', '.join(known)}" for name in self.root if name not in known
        ]
        asked = self.root.get(CALIBRATION, [])
        tags = asked if isinstance(asked, list) else [asked]
        problems += [
            f"{CALIBRATION}: must be of {', '.join(CALIBRATION_TAGS)}; it is {tag}"
            for tag in tags
            if tag not in CALIBRATION_TAGS
        ]
        if problems:
            raise ValueError("; ".join(problems))
        return self

    def holds(self, facts: Mapping[str, Any]) -> bool:
        """Whether the facts of a scenario keep every line."""
        return all(_meets(facts[name], wanted) for name, wanted in self.root.items())

    def list_impossible(self) -> list[str]:
        """A sentence for each value that its field never has: the condition would hold for no scenario."""
        return [
            f"{name}: {problem}"
            for name, wanted in self.root.items()
            for value in (wanted if isinstance(wanted, list) else [wanted])
            if (problem := _find_value_problem(name, value)) is not None
        ]


def facts_of(scenario: Scenario) -> dict[str, Any]:
    """Return the facts that conditions test: the scenario's fields and its place in the calibrated range."""
    optional = {name: getattr(scenario, name) for name in OPTIONAL_FIELDS}
    return scenario.as_row() | optional | {CALIBRATION: calibration_tag(scenario, load("calibrated range"))}


def split_of(facts: Mapping[str, Any], splits: Mapping[str, Condition]) -> str | None:
    """The first split whose condition holds; None if none does."""
    return next((name for name, condition in splits.items() if condition.holds(facts)), None)


def _find_value_problem(name: str, wanted: Any) -> str | None:
    if isinstance(wanted, Between):
        if name not in NUMBERS:
            return "an interval is of numbers, which this is not"
        falls = wanted.min is not None and wanted.max is not None and wanted.min > wanted.max
        return f"an interval must ascend; it is {wanted.min:g} to {wanted.max:g}" if falls else None
    if name in NUMBERS:
        right = isinstance(wanted, float) and isfinite(wanted)
        return None if right else f"must be a number or an interval; it is {shorten_value(wanted)}"
    if name == "weather":
        return find_weather_problem(wanted)
    if name in SWITCHES and not isinstance(wanted, bool):
        return f"must be true or false; it is {shorten_value(wanted)}"
    return None


def _meets(value: Any, wanted: Any) -> bool:
    if isinstance(wanted, Between):
        return wanted.holds(value)
    return value in wanted if isinstance(wanted, list) else value == wanted
