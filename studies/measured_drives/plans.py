"""Plans of the studies, as YAML files: protocols, buses, and which runs and windows a stop or bump study takes."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from catalogs.quantities import CatalogueEntry, Number, Scalar, Text, require_quantity
from studies import plans
from studies.measured_drives.bus_file import BusEntry
from studies.measured_drives.protocol_file import ProtocolEntry
from studies.measured_drives.stop_ladder import Rung
from tasks.vehicle.effects.table import PARAMETERS

FOLDER = Path(__file__).parent


class BumpWindow(CatalogueEntry):
    """A stretch of the run with one road feature [s]."""

    name: Text
    from_s: Number
    to_s: Number

    @model_validator(mode="after")
    def _is_an_interval(self) -> "BumpWindow":
        if self.from_s + 1.0 > self.to_s:
            raise ValueError(
                f"window {self.name} must last 1 s or more; it goes from {self.from_s:g} to {self.to_s:g}"
            )
        return self


class BumpStudy(CatalogueEntry):
    """Content of a study file; the first window calibrates the car."""

    run: Text
    windows: Annotated[tuple[BumpWindow, ...], Field(min_length=1)]


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


PLANS: dict[str, type[CatalogueEntry]] = {
    "bump study": BumpStudy,
    "bus": BusEntry,
    "protocol": ProtocolEntry,
    "stop study": StopStudy,
}


def load_plan(kind: str, name_or_path: str | Path) -> Any:
    """Return a plan of `PLANS` by its name or its file, as `studies.plans.load_plan` does."""
    return plans.load_plan(PLANS[kind], FOLDER, name_or_path, kind)
