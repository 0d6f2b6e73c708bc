"""Calibration procedures: stages, bounds and scales, as YAML."""

from functools import cache
from math import inf, radians
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from catalogs.quantities import CatalogueEntry, Number, Scalar, Text, require_quantity
from catalogs.vehicles import vehicle_units
from tasks.identification.calibration.procedure import Bounds, Procedure, Stage
from tasks.identification.calibration.residual import Phase, Response, Yardstick
from tasks.identification.calibration.scalars import KNOT_GROUPS
from tasks.vehicle.effects.table import EFFECT_UNITS

Count = Annotated[Scalar, require_quantity("1", minimum=1)]


class ScalesEntry(CatalogueEntry):
    """Size of one unit of each response; the meanings are given by ``Yardstick``."""

    speed: Annotated[Scalar, require_quantity("m s-1", above=0)]
    speed_drop: Annotated[Scalar, require_quantity("m s-1", above=0)]
    pitch: Annotated[Scalar, require_quantity("deg", above=0)]
    slip: Annotated[Scalar, require_quantity("1", above=0)]
    wheel_load: Annotated[Scalar, require_quantity("N", above=0)]
    stop: Annotated[Scalar, require_quantity("m", above=0)]


class BoundsEntry(CatalogueEntry):
    """Limits and difference step of a group; the meanings are given by ``Bounds``."""

    unit: Text
    lower: Number
    upper: Number
    step: Number
    source: Text
    smooth: Annotated[float, Field(strict=True, gt=0)] | None = None
    start: Number | None = None

    @model_validator(mode="after")
    def _limits_leave_room(self) -> "BoundsEntry":
        if not (self.lower < self.upper and 0 < self.step < (self.upper - self.lower) / 2):
            raise ValueError(
                "lower must be below upper, and step above 0 and below half their distance; they are"
                f" {self.lower:g}, {self.upper:g} and {self.step:g}"
            )
        return self


class StageEntry(CatalogueEntry):
    """One stage; the meanings are given by ``Stage``."""

    name: Text
    groups: tuple[Text, ...]
    responses: tuple[Response, ...]
    kinds: tuple[Literal["flat", "hump", "depression"], ...]
    phase: Phase


@cache
def _group_units() -> dict[str, str]:
    """Unit of each group, as vehicle files write it."""
    knots = {group: "s" if group.endswith("_s") else "1" for group in KNOT_GROUPS}
    return {**vehicle_units(), **knots, **EFFECT_UNITS}


class ProcedureEntry(CatalogueEntry):
    """A whole procedure; the meanings are given by ``Procedure``."""

    mode: Literal["paper", "coupled"]
    passes: Count
    evaluations: Count
    tolerance: Annotated[Scalar, require_quantity("1", above=0)] | None = None
    start: Annotated[Scalar, require_quantity("s", above=0)]
    settle: Annotated[Scalar, require_quantity("s", minimum=0)]
    tail_speed: Annotated[Scalar, require_quantity("m s-1", above=0)]
    slip_speed: Annotated[Scalar, require_quantity("m s-1", minimum=0)]
    interval: Annotated[Scalar, require_quantity("s", above=0)]
    margin: Annotated[Scalar, require_quantity("s", above=0)]
    scales: ScalesEntry
    bounds: dict[Text, BoundsEntry]
    stages: tuple[StageEntry, ...]

    @field_validator("bounds")
    @classmethod
    def _units_are_those_of_the_groups(cls, bounds: dict[str, BoundsEntry]) -> dict[str, BoundsEntry]:
        units = _group_units()
        problems = [
            f"unit of {group} must be {units[group]}; it is {entry.unit}"
            for group, entry in bounds.items()
            if entry.unit != units.get(group, entry.unit)
        ]
        if problems:
            raise ValueError("; ".join(problems))
        return bounds

    @model_validator(mode="after")
    def _every_group_has_bounds(self) -> "ProcedureEntry":
        wanted = {group for stage in self.stages for group in stage.groups}
        if missing := sorted(wanted - set(self.bounds)):
            raise ValueError(f"every group of a stage needs bounds; {', '.join(missing)} has none")
        return self

    def build(self) -> tuple[Procedure, float]:
        """Return the procedure, and the spacing of the samples that count [s]."""
        procedure = Procedure(
            mode=self.mode,
            stages=tuple(Stage(**dict(stage)) for stage in self.stages),
            passes=int(self.passes.value),
            evaluations=int(self.evaluations.value),
            tolerance=self.tolerance.value if self.tolerance else None,
            bounds={group: _convert_bounds(bounds) for group, bounds in self.bounds.items()},
            yardstick=Yardstick(
                scales=self.scales.numbers(),
                start_s=self.start.value,
                settle_s=self.settle.value,
                tail_speed=self.tail_speed.value,
                slip_speed=self.slip_speed.value,
                margin_s=self.margin.value,
            ),
        )
        return procedure, self.interval.value


def _convert_bounds(entry: BoundsEntry) -> Bounds:
    """SI inside: an angle comes in degrees and is handed on in radians."""
    unit, factor = ("rad", radians(1.0)) if entry.unit == "deg" else (entry.unit, 1.0)
    return Bounds(
        unit=unit,
        lower=entry.lower * factor,
        upper=entry.upper * factor,
        step=entry.step * factor,
        smooth=inf if entry.smooth is None else entry.smooth * factor,
        start=None if entry.start is None else entry.start * factor,
    )
