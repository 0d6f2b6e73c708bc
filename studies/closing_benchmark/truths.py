"""Known truths that close-loop is tried on: library effects at sizes that matter, and forms outside any library."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator, model_validator

from catalogs.entries import load
from catalogs.quantities import CatalogueEntry, Number
from catalogs.sentences import shorten_value
from studies.plans import load_plan
from tasks.vehicle.effects.ports import PORTS, VARIABLES
from tasks.vehicle.effects.slots import Slot


@dataclass(frozen=True, kw_only=True)
class Truth:
    """Effect that a synthetic car has.

    Parameters
    ----------
    name : of the library effect, or of a form outside it
    values : effect parameters by name, in the units of the library
    slots : forms at ports
    left_out : library effects that the tool may not use on it
    """

    name: str
    values: dict[str, float]
    slots: tuple[Slot, ...]
    left_out: tuple[str, ...]

    @property
    def in_library(self) -> bool:
        """Whether the tool can name it."""
        return not self.slots

    @property
    def form(self) -> tuple[str, str] | None:
        """Port and variable of a form outside the library."""
        return (self.slots[0].port, self.slots[0].variable) if self.slots else None


class OutsideEntry(CatalogueEntry):
    """A form outside the library: values of a port at equally spaced values of a variable."""

    port: str
    variable: str
    at: Annotated[tuple[Number, ...], Field(min_length=2)]
    value: tuple[Number, ...]
    left_out: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _is_a_table(self) -> "OutsideEntry":
        problems = []
        if self.port not in PORTS or self.variable not in VARIABLES:
            problems.append(
                f"port must be of {', '.join(PORTS)} and variable of {', '.join(VARIABLES)}; they are"
                f" {shorten_value(self.port)} and {shorten_value(self.variable)}"
            )
        steps = np.diff(self.at)
        if not (steps > 0).all() or not np.allclose(steps, steps[0]):
            problems.append(f"at must ascend in equal steps; it is {shorten_value(self.at)}")
        if len(self.value) != len(self.at):
            problems.append(f"value must have one number for each of at; there are {len(self.value)}")
        if problems:
            raise ValueError("; ".join(problems))
        return self


@cache
def _library_names() -> dict[str, set[str]]:
    return {effect.name: {p.name for p in effect.parameters} for effect in load("library of effects")}


class TruthFile(CatalogueEntry):
    """Content of the file."""

    library: dict[str, Annotated[dict[str, Number], Field(min_length=1)]]
    outside: dict[str, OutsideEntry]
    sizes: dict[str, Annotated[dict[str, tuple[Number, ...]], Field(min_length=1, max_length=1)]]

    @field_validator("library", "sizes")
    @classmethod
    def _effects_exist(cls, named: dict[str, dict[str, object]]) -> dict[str, dict[str, object]]:
        effects = _library_names()
        problems = []
        for name, values in named.items():
            if name not in effects:
                problems.append(f"{name}: the library has no such effect; there are: {', '.join(effects)}")
            elif not set(values) <= effects[name]:
                known, given = ", ".join(sorted(effects[name])), ", ".join(values)
                problems.append(f"{name}: parameters must be of {known}; they are {given}")
        if problems:
            raise ValueError("; ".join(problems))
        return named

    def build(self) -> tuple[Truth, ...]:
        """Return the truths, in the order of the file."""
        library = [
            Truth(name=name, values=values, slots=(), left_out=()) for name, values in self.library.items()
        ]
        outside = [
            Truth(name=name, values={}, slots=(_make_slot(form),), left_out=form.left_out)
            for name, form in self.outside.items()
        ]
        return (*library, *outside)


class SizeFile(TruthFile):
    """The same file, for the effects at several sizes each: power against size."""

    def build(self) -> tuple[Truth, ...]:
        """Return one truth for each size."""
        return tuple(
            Truth(name=name, values={parameter: value}, slots=(), left_out=())
            for name, parameters in self.sizes.items()
            for parameter, values in parameters.items()
            for value in values
        )


def load_truths(name_or_path: str | Path = "truths") -> tuple[Truth, ...]:
    """Return the truths of `truths.yaml`, or of a file like it."""
    truths: tuple[Truth, ...] = load_plan(TruthFile, Path(__file__).parent, name_or_path, "list of truths")
    return truths


def load_sizes(name_or_path: str | Path = "truths") -> tuple[Truth, ...]:
    """Return the truths of several sizes of `truths.yaml`, or of a file like it."""
    sizes: tuple[Truth, ...] = load_plan(SizeFile, Path(__file__).parent, name_or_path, "list of sizes")
    return sizes


def _make_slot(form: OutsideEntry) -> Slot:
    return Slot(
        port=form.port,
        variable=form.variable,
        origin=form.at[0],
        spacing=form.at[1] - form.at[0],
        values=np.array(form.value, dtype=np.float64),
    )
