"""The built-in streets' dimensions and light, from the catalogue."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import create_model

from catalogs.quantities import CatalogueEntry, Scalar, Table, read_entry, require_quantity
from tasks.scene.street.layout import StreetLayout

STREET_FILE = Path(__file__).parent / "street.yaml"
CHANGES = {"street": (), "hill": (STREET_FILE.with_name("hill.yaml"),)}
"""Built-in streets by name, and the file of what each has otherwise than `STREET_FILE`."""


def _choose_type(name: str) -> Any:
    """The type of one entry: colours and the grade have no unit, angles may be negative, every length is positive."""
    if name == "grade":
        return Annotated[Scalar, require_quantity("1", above=-1.0, below=1.0)]
    if name.endswith("_rgb"):
        return Annotated[Table, require_quantity("1", minimum=0.0)]
    if name.endswith("_deg"):
        return Annotated[Scalar, require_quantity("deg")]
    return Annotated[Scalar, require_quantity("m", above=0.0)]


_FIELDS: dict[str, Any] = {field.name: (_choose_type(field.name), ...) for field in fields(StreetLayout)}

StreetEntry = create_model("StreetEntry", __base__=CatalogueEntry, **_FIELDS)
"""Content of the street's file: every field of `StreetLayout`."""
_CHANGED: dict[str, Any] = {name: (kind | None, None) for name, (kind, _) in _FIELDS.items()}

StreetChanges = create_model("StreetChanges", __base__=CatalogueEntry, **_CHANGED)
"""Content of the file of another street: the fields that differ."""


def load_street_layout(path: Path = STREET_FILE, *changes: Path) -> StreetLayout:
    """Read a street's layout.

    Parameters
    ----------
    path : a YAML file with value, unit and source of every field of `StreetLayout`
    changes : files with the fields that a street has otherwise

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    entry = read_entry(StreetEntry, path, "street")
    layout = StreetLayout(**{name: getattr(entry, name).value for name in StreetEntry.model_fields})
    for change in changes:
        other = read_entry(StreetChanges, change, "street")
        layout = replace(layout, **{name: getattr(other, name).value for name in other.model_fields_set})
    return layout
