"""Finish of road features, paint, patch and joints: how it is laid out, and how it reflects."""

from typing import Annotated

from pydantic import AfterValidator

from catalogs.quantities import CatalogueEntry, Scalar, Table, require_quantity
from tasks.render.road_paint import HazardMarking, WarningSign


def _check_colour(table: Table) -> Table:
    if len(table.value) != 3:
        raise ValueError(f"must be red, green and blue; it has {len(table.value)} values")
    return table


Reflectance = Annotated[Table, require_quantity("1", minimum=0, maximum=1), AfterValidator(_check_colour)]


class SignEntry(CatalogueEntry):
    """Content of a marking's sign; `WarningSign` gives the meanings."""

    side: Annotated[Scalar, require_quantity("m", above=0)]
    foot: Annotated[Scalar, require_quantity("m", above=0)]
    offset: Annotated[Scalar, require_quantity("m", minimum=0)]
    before: Annotated[Scalar, require_quantity("m", minimum=0)]
    border: Reflectance
    field: Reflectance
    symbol: Reflectance
    metal: Reflectance

    def build(self) -> WarningSign:
        """The sign itself."""
        return WarningSign(**self.numbers())


class MarkingEntry(CatalogueEntry):
    """Content of a marking's file; `HazardMarking` gives the meanings."""

    stripe_width: Annotated[Scalar, require_quantity("m", above=0)]
    paint: Reflectance
    gap: Reflectance
    patch: Reflectance | None = None
    patch_margin: Annotated[Scalar, require_quantity("m", minimum=0)] | None = None
    joint: Reflectance | None = None
    joint_width: Annotated[Scalar, require_quantity("m", above=0)] | None = None
    sign: SignEntry | None = None

    def build(self) -> HazardMarking:
        """The marking itself."""
        return HazardMarking(**self.numbers(), sign=None if self.sign is None else self.sign.build())
