"""The built-in street's dimensions and light, from the catalogue."""

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

from pydantic import create_model

from catalogs.quantities import CatalogueEntry, Scalar, Table, read_entry, require_quantity
from tasks.scene.street.layout import StreetLayout

STREET_FILE = Path(__file__).parent / "street.yaml"


def _choose_type(name: str) -> Any:
    """The type of one entry: colours have no unit, angles may be negative, every length is positive."""
    if name.endswith("_rgb"):
        return Annotated[Table, require_quantity("1", minimum=0.0)]
    if name.endswith("_deg"):
        return Annotated[Scalar, require_quantity("deg")]
    return Annotated[Scalar, require_quantity("m", above=0.0)]


_FIELDS: dict[str, Any] = {field.name: (_choose_type(field.name), ...) for field in fields(StreetLayout)}

StreetEntry = create_model("StreetEntry", __base__=CatalogueEntry, **_FIELDS)
"""Content of the street's file: every field of `StreetLayout`."""


def load_street_layout(path: Path = STREET_FILE) -> StreetLayout:
    """Read the street's layout.

    Parameters
    ----------
    path : a YAML file with value, unit and source of every field of `StreetLayout`

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    entry = read_entry(StreetEntry, path, "street")
    return StreetLayout(**{name: getattr(entry, name).value for name in StreetEntry.model_fields})
