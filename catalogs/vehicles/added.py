"""Additions of a vehicle file to the plain model: numbers of effects, and forms that no effect of the library has."""

from collections.abc import Mapping
from itertools import pairwise

from pydantic import model_validator

from catalogs.quantities import CatalogueEntry, Scalar, Table, Text
from catalogs.vehicles.frozen import Limits
from tasks.vehicle.effects.forms import SHAPES, Form, count_coefficients
from tasks.vehicle.effects.ports import PORT_UNITS, PORTS, VARIABLE_UNITS, VARIABLES
from tasks.vehicle.effects.table import EFFECT_UNITS, PARAMETERS


class FormEntry(CatalogueEntry):
    """Content of a form; `Form` gives the meanings. ``range``: start and end of the identified interval."""

    port: Text
    variable: Text
    shape: Text
    coefficients: Table
    scale: Scalar
    range: Table

    @model_validator(mode="after")
    def _names_units_and_ranges_fit(self) -> "FormEntry":
        problems = [
            f"{key} {value} does not exist; there are: {', '.join(known)}"
            for key, value, known in (
                ("port", self.port, PORTS),
                ("variable", self.variable, VARIABLES),
                ("shape", self.shape, tuple(SHAPES)),
            )
            if value not in known
        ]
        if problems:
            raise ValueError("; ".join(problems))
        of_port, of_variable = PORT_UNITS[self.port], VARIABLE_UNITS[self.variable]
        problems += [
            f"unit of {key} must be {unit}; it is {entry.unit}"
            for key, entry, unit in (
                ("coefficients", self.coefficients, of_port),
                ("scale", self.scale, of_variable),
                ("range", self.range, of_variable),
            )
            if entry.unit != unit
        ]
        if len(self.coefficients.value) != count_coefficients(self.shape):
            count = count_coefficients(self.shape)
            problems.append(
                f"the shape {self.shape} has {count} coefficient(s); there are {len(self.coefficients.value)}"
            )
        if self.scale.value <= 0:
            problems.append(f"scale must be above 0; it is {self.scale.value:g}")
        if len(self.range.value) != 2 or any(low >= high for low, high in pairwise(self.range.value)):
            problems.append(f"range must be two ascending values; it is {list(self.range.value)}")
        if problems:
            raise ValueError("; ".join(problems))
        return self

    @property
    def form(self) -> Form:
        """Return the form itself."""
        low, high = self.range.value
        return Form(
            port=self.port, variable=self.variable, shape=self.shape, coefficients=self.coefficients.value,
            scale=self.scale.value, low=low, high=high,
        )  # fmt: skip


def find_effect_problems(effects: Mapping[str, Scalar], bounds: Mapping[str, Limits]) -> list[str]:
    """Every rule that numbers of effects break: they exist, have their unit and lie within their bounds.

    Parameters
    ----------
    effects : numbers of a vehicle file
    bounds : of the procedure that found them; the table's hold for any other, and 0 is always allowed
    """
    known = ", ".join(EFFECT_UNITS)
    problems = [
        f"effects: no effect has the number {name}; there are: {known}"
        for name in effects
        if name not in EFFECT_UNITS
    ]
    for name, number in effects.items():
        if name in EFFECT_UNITS and number.unit != EFFECT_UNITS[name]:
            problems.append(f"effects.{name}: unit must be {EFFECT_UNITS[name]}; it is {number.unit}")
        if name not in EFFECT_UNITS or number.value == 0.0:
            continue
        limits = bounds.get(name) or PARAMETERS[name]
        low, high = limits.lower, limits.upper
        if not low <= number.value <= high:
            problems.append(f"effects.{name} must lie within {low:g} to {high:g}; it is {number.value:g}")
    return problems
