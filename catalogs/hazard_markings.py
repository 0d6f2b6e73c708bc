"""Paint on raised road features: how it is laid out, and how it reflects."""

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

    def build(self) -> HazardMarking:
        """The marking itself."""
        red, green, blue = self.paint.value
        dark_red, dark_green, dark_blue = self.gap.value
        return HazardMarking(
            stripe_width=self.stripe_width.value,
            paint=(red, green, blue),
            gap=(dark_red, dark_green, dark_blue),
        )
