"""The library of effects that a vehicle model may lack."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, TypeAdapter, model_validator

from catalogs.quantities import CatalogueEntry, Number, Text, read_entries
from tasks.vehicle.effects.library import PARAMETER_INDEX, Effect, EffectClass, EffectParameter

Unit = Literal[
    "1", "1/(100 K)", "1/(100 kJ)", "1/MPa", "MPa", "N", "N m", "N m s/rad", "N m s^2/m^2", "N s^2/m^2", "N/m",
    "N/m^3", "N/mm", "kg m^2", "m", "m/s", "m^2", "rad", "s", "s/m",
]  # fmt: skip
"""Units that the ports take."""
LIBRARY_FILE = Path(__file__).with_name("library.yaml")


class ParameterEntry(CatalogueEntry):
    """One number of an effect; the meanings are given by ``EffectParameter``."""

    unit: Unit
    lower: Number
    upper: Number
    step: Number
    start: Number

    @model_validator(mode="after")
    def _bounds_leave_room(self) -> "ParameterEntry":
        if not (self.lower <= self.start <= self.upper and 0 < self.step < self.upper - self.lower):
            raise ValueError(
                "lower <= start <= upper must hold, and a step above 0 and below the distance of the bounds; they are"
                f" {self.lower:g}, {self.start:g}, {self.upper:g} and {self.step:g}"
            )
        return self


class EffectEntry(CatalogueEntry):
    """One effect; the meanings are given by ``Effect``."""

    name: Text
    effect_class: EffectClass = Field(alias="class")
    port: Text
    variable: Text
    enters: Text
    source: Text
    parameters: Annotated[dict[str, ParameterEntry], Field(min_length=1, max_length=2)]

    @model_validator(mode="after")
    def _ports_know_the_parameters(self) -> "EffectEntry":
        unknown = [name for name in self.parameters if name not in PARAMETER_INDEX]
        if unknown:
            raise ValueError(
                f"no port knows the parameter {', '.join(unknown)}; there are: {', '.join(PARAMETER_INDEX)}"
            )
        return self


def _check_names(entries: list[EffectEntry]) -> list[EffectEntry]:
    names = [entry.name for entry in entries]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"an effect must stand once; twice stand {', '.join(twice)}")
    return entries


LIBRARY = TypeAdapter(Annotated[list[EffectEntry], AfterValidator(_check_names)])
"""Content of the file."""


def load_effects(path: str | Path = LIBRARY_FILE) -> tuple[Effect, ...]:
    """Effects of a library file, in its order.

    Parameters
    ----------
    path : YAML list of effects

    Raises
    ------
    InputError
        With every rule the file breaks.
    """
    return tuple(_make_effect(entry) for entry in read_entries(LIBRARY, Path(path), "library of effects"))


def _make_effect(entry: EffectEntry) -> Effect:
    return Effect(
        name=entry.name,
        effect_class=entry.effect_class,
        port=entry.port,
        variable=entry.variable,
        enters=entry.enters,
        source=entry.source,
        parameters=tuple(
            EffectParameter(name=name, **parameter.model_dump())
            for name, parameter in entry.parameters.items()
        ),
    )
