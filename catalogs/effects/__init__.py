"""The library of effects that a vehicle model may lack."""

from string import Formatter
from typing import Annotated, Self

from pydantic import AfterValidator, Field, field_validator, model_validator

from catalogs.quantities import CatalogueEntry, CatalogueList, Text
from tasks.vehicle.effects.library import Effect, EffectClass
from tasks.vehicle.effects.table import PARAMETERS


class EffectEntry(CatalogueEntry):
    """One effect; the meanings are given by ``Effect``."""

    name: Text
    effect_class: EffectClass = Field(alias="class")
    variable: Text
    enters: Text
    says: Text
    parameters: Annotated[tuple[Text, ...], Field(min_length=1, max_length=2)]
    matters: Annotated[float, Field(gt=0)]
    because: Text

    @field_validator("parameters")
    @classmethod
    def _the_table_has_them(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        if unknown := [name for name in names if name not in PARAMETERS]:
            raise ValueError(
                f"the table of effects has no parameter {', '.join(unknown)}; there are: {', '.join(PARAMETERS)}"
            )
        return names

    @model_validator(mode="after")
    def _every_number_is_said(self) -> Self:
        said = {field for _, field, _, _ in Formatter().parse(self.says) if field is not None}
        if said != set(self.parameters):
            raise ValueError(
                f"says of {self.name} must hold {', '.join(self.parameters)} in braces, and no other"
            )
        return self


def _check_names(entries: list[EffectEntry]) -> list[EffectEntry]:
    names = [entry.name for entry in entries]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"an effect must stand once; twice stand {', '.join(twice)}")
    return entries


class EffectLibrary(CatalogueList[Annotated[list[EffectEntry], AfterValidator(_check_names)]]):
    """Content of the file."""

    def build(self) -> tuple[Effect, ...]:
        """Return the effects, in the order of the file."""
        return tuple(_make_effect(entry) for entry in self.root)


def _make_effect(entry: EffectEntry) -> Effect:
    return Effect(
        name=entry.name, effect_class=entry.effect_class, variable=entry.variable, enters=entry.enters,
        says=entry.says, parameters=tuple(PARAMETERS[name] for name in entry.parameters),
        matters=entry.matters,
    )  # fmt: skip
