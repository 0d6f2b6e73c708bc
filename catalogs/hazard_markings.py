"""Finish of road features, paint, patch and joints: how it is laid out, and how it reflects."""

from typing import Annotated

from pydantic import AfterValidator

from catalogs.quantities import CatalogueEntry, Scalar, Table, require_quantity
from tasks.render.road_paint import HazardMarking


def _check_colour(table: Table) -> Table:
    if len(table.value) != 3:
        raise ValueError(f"must be red, green and blue; it has {len(table.value)} values")
    return table


Reflectance = Annotated[Table, require_quantity("1", minimum=0, maximum=1), AfterValidator(_check_colour)]


class MarkingEntry(CatalogueEntry):
    """Content of a marking's file; `HazardMarking` gives the meanings."""

    stripe_width: Annotated[Scalar, require_quantity("m", above=0)]
    paint: Reflectance
    gap: Reflectance
    patch: Reflectance | None = None
    patch_margin: Annotated[Scalar, require_quantity("m", minimum=0)] | None = None
    joint: Reflectance | None = None
    joint_width: Annotated[Scalar, require_quantity("m", above=0)] | None = None

    def build(self) -> HazardMarking:
        """The marking itself."""
        return HazardMarking(
            stripe_width=self.stripe_width.value,
            paint=_as_colour(self.paint),
            gap=_as_colour(self.gap),
            patch=self.patch and _as_colour(self.patch),
            patch_margin=self.patch_margin.value if self.patch_margin else 0.0,
            joint=self.joint and _as_colour(self.joint),
            joint_width=self.joint_width.value if self.joint_width else 0.0,
        )


def _as_colour(table: Table) -> tuple[float, float, float]:
    red, green, blue = table.value
    return red, green, blue
