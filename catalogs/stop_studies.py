"""Studies of one stop predicted from another: which runs, and what is added to the model in which order."""

from typing import Annotated

from pydantic import Field, field_validator

from catalogs.quantities import CatalogueEntry, Scalar, Text, require_quantity
from tasks.studies.stop_study import Rung
from tasks.vehicle.effects.table import PARAMETERS


class RungEntry(CatalogueEntry):
    """One step of the ladder; the meanings are given by ``Rung``."""

    name: Text
    adds: Text
    engine_torque: bool = False
    fixed: dict[str, Scalar] = Field(default_factory=dict)
    longitudinal: Annotated[tuple[str, ...], Field(min_length=1)]
    swing: bool = False

    @field_validator("fixed", "longitudinal")
    @classmethod
    def _are_parameters(
        cls, names: dict[str, Scalar] | tuple[str, ...]
    ) -> dict[str, Scalar] | tuple[str, ...]:
        unknown = [name for name in names if name not in PARAMETERS]
        if unknown:
            raise ValueError(
                f"the table of effects has no {', '.join(unknown)}; there are: {', '.join(PARAMETERS)}"
            )
        return names

    @field_validator("fixed")
    @classmethod
    def _units_are_those_of_the_table(cls, fixed: dict[str, Scalar]) -> dict[str, Scalar]:
        problems = [
            f"unit of {name} must be {PARAMETERS[name].unit}; it is {entry.unit}"
            for name, entry in fixed.items()
            if name in PARAMETERS and entry.unit != PARAMETERS[name].unit
        ]
        if problems:
            raise ValueError("; ".join(problems))
        return fixed


class StopStudy(CatalogueEntry):
    """Content of a study file."""

    train: Text
    held_out: Text
    lead_s: Annotated[Scalar, require_quantity("s", above=0)]
    rungs: Annotated[tuple[RungEntry, ...], Field(min_length=1)]

    @property
    def ladder(self) -> tuple[Rung, ...]:
        """The rungs for the science floor."""
        return tuple(
            Rung(
                name=rung.name,
                adds=rung.adds,
                engine_torque=rung.engine_torque,
                fixed={name: entry.value for name, entry in rung.fixed.items()},
                longitudinal=rung.longitudinal,
                swing=rung.swing,
            )
            for rung in self.rungs
        )
