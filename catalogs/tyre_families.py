"""Tyre families as they stand in the files of vehicles and of kinds of weather."""

from itertools import pairwise
from typing import Annotated

from pydantic import model_validator

from catalogs.quantities import CatalogueEntry, Table, require_quantity
from tasks.vehicle.parameters import TyreFamily
from tasks.vehicle.tyres.burckhardt import BurckhardtCurve

Scales = Annotated[Table, require_quantity("1", above=0)]
Durations = Annotated[Table, require_quantity("s", above=0)]
KNOT_TABLES = ("efficiency", "slip_stiffness", "pitch_scale", "hold_s", "release_s")


class FamilyEntry(CatalogueEntry):
    """Content of a tyre family; `TyreFamily` gives the meanings."""

    burckhardt: Annotated[Table, require_quantity("1", above=0)]
    surface_friction: Scales
    efficiency: Scales
    slip_stiffness: Scales
    pitch_scale: Scales
    hold_s: Durations
    release_s: Durations

    @model_validator(mode="after")
    def _tables_match_their_knots(self) -> "FamilyEntry":
        knots = self.surface_friction.value
        problems = [
            f"{name} must have one value per surface_friction knot ({len(knots)}); it has {count}"
            for name in KNOT_TABLES
            if (count := len(getattr(self, name).value)) != len(knots)
        ]
        if any(low >= high for low, high in pairwise(knots)):
            problems.append(f"surface_friction knots must ascend; they are {list(knots)}")
        if len(self.burckhardt.value) != 3:
            problems.append(f"burckhardt must be c1, c2, c3; it has {len(self.burckhardt.value)} values")
        elif (c := self.burckhardt.value)[0] * c[1] <= c[2]:
            problems.append(f"burckhardt must rise from zero slip: c1 c2 above c3; it is {list(c)}")
        if problems:
            raise ValueError("; ".join(problems))
        return self

    @property
    def family(self) -> TyreFamily:
        """The family's numbers."""
        values = self.numbers()
        return TyreFamily(**{**values, "burckhardt": BurckhardtCurve(*values["burckhardt"])})
