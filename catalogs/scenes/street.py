"""The built-in streets' dimensions and light, from the catalogue."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, create_model

from catalogs.quantities import CatalogueEntry, Scalar, Table, read_entry, require_quantity
from tasks.scene.street.layout import MAY_BE_NONE, StreetLayout
from tasks.scene.street.noise import named_generator

STREET_FILE = Path(__file__).parent / "street.yaml"
CHANGES = {"street": (), "hill": (STREET_FILE.with_name("hill.yaml"),)}
"""Built-in streets by name, and the file of what each has otherwise than `STREET_FILE`."""


def _choose_type(name: str) -> Any:
    """The type of one entry: colours, shares and numbers of things have no unit, and angles may be negative."""
    if name == "grade":
        return Annotated[Scalar, require_quantity("1", above=-1.0, below=1.0)]
    if name.endswith("_rgb"):
        return Annotated[Table, require_quantity("1", minimum=0.0)]
    if name.endswith("_deg"):
        return Annotated[Scalar, require_quantity("deg")]
    if name.endswith("_share"):
        return Annotated[Scalar, require_quantity("1", minimum=0.0, maximum=1.0)]
    if name.endswith(("_storeys", "_bays", "_scale")):
        return Annotated[Scalar, require_quantity("1", above=0.0)]
    if name in MAY_BE_NONE:
        return Annotated[Scalar, require_quantity("m", minimum=0.0)]
    return Annotated[Scalar, require_quantity("m", above=0.0)]


def _allow_range(name: str) -> Any:
    """The type of one entry of a file of changes, where a number may be a range of two."""
    rule = _choose_type(name)
    drawn = Annotated[Table, *rule.__metadata__, AfterValidator(_require_range)]
    return rule if name.endswith("_rgb") else rule | drawn


def _require_range(entry: Table) -> Table:
    if len(entry.value) != 2 or not entry.value[0] < entry.value[1]:
        raise ValueError(f"must be one number, or a range of two that ascend; it is {list(entry.value)}")
    return entry


def _draw_value(entry: Scalar | Table, name: str, seed: int) -> Any:
    """The value of an entry: of a range, a number that the seed draws."""
    if isinstance(entry, Scalar) or name.endswith("_rgb"):
        return entry.value
    low, high = entry.value
    return float(named_generator(seed, f"layout {name}").uniform(low, high))


_FIELDS: dict[str, Any] = {field.name: (_choose_type(field.name), ...) for field in fields(StreetLayout)}

StreetEntry = create_model("StreetEntry", __base__=CatalogueEntry, **_FIELDS)
"""Content of the street's file: every field of `StreetLayout`."""
_CHANGED: dict[str, Any] = {name: (_allow_range(name) | None, None) for name in _FIELDS}

StreetChanges = create_model("StreetChanges", __base__=CatalogueEntry, **_CHANGED)
"""Content of the file of another street: the fields that differ."""


def load_street_layout(path: Path = STREET_FILE, *changes: Path, seed: int = 0) -> StreetLayout:
    """Read a street's layout.

    Parameters
    ----------
    path : a YAML file with value, unit and source of every field of `StreetLayout`
    changes : files with the fields that a street has otherwise; of a range, the seed draws one number
    seed : of the street [1]

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    entry = read_entry(StreetEntry, path, "street")
    layout = StreetLayout(**{name: getattr(entry, name).value for name in StreetEntry.model_fields})
    for change in changes:
        other = read_entry(StreetChanges, change, "street")
        layout = replace(
            layout, **{name: _draw_value(getattr(other, name), name, seed) for name in other.model_fields_set}
        )
    return layout
