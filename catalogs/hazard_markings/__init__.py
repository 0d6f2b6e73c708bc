"""Paint on raised road features: how it is laid out, and how it reflects."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator

from catalogs.entries import find_entry
from catalogs.quantities import CatalogueEntry, Scalar, Table, read_entry, require_quantity
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


def load_marking(name_or_path: str | Path) -> HazardMarking:
    """Read a marking by its name in the catalogue or from a YAML file.

    Parameters
    ----------
    name_or_path : name, or path ending in .yaml

    Raises
    ------
    InputError
        Listing every problem of the file, or the names that exist.
    """
    entry = read_entry(MarkingEntry, find_entry("hazard marking", name_or_path), "hazard marking")
    red, green, blue = entry.paint.value
    dark_red, dark_green, dark_blue = entry.gap.value
    return HazardMarking(
        stripe_width=entry.stripe_width.value,
        paint=(red, green, blue),
        gap=(dark_red, dark_green, dark_blue),
    )
