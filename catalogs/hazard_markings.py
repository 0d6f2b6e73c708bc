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
        return WarningSign(
            side=self.side.value,
            foot=self.foot.value,
            offset=self.offset.value,
            before=self.before.value,
            border=_as_colour(self.border),
            field=_as_colour(self.field),
            symbol=_as_colour(self.symbol),
            metal=_as_colour(self.metal),
        )


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
        return HazardMarking(
            stripe_width=self.stripe_width.value,
            paint=_as_colour(self.paint),
            gap=_as_colour(self.gap),
            patch=self.patch and _as_colour(self.patch),
            patch_margin=self.patch_margin.value if self.patch_margin else 0.0,
            joint=self.joint and _as_colour(self.joint),
            joint_width=self.joint_width.value if self.joint_width else 0.0,
            sign=self.sign and self.sign.build(),
        )


def _as_colour(table: Table) -> tuple[float, float, float]:
    red, green, blue = table.value
    return red, green, blue
