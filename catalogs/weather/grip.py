"""Numbers of the surface, and tyre families, that the entries of the kinds of weather give."""

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from pydantic import ConfigDict, Field, field_validator

from catalogs.documents import LARGEST_YAML, read_content
from catalogs.quantities import Bounded, CatalogueEntry, parse_entry, require_quantity
from catalogs.sentences import shorten
from catalogs.tyre_families import FamilyEntry
from tasks.surface.weather import WEATHERS
from tasks.vehicle.parameters import TyreFamily

FOLDER = Path(__file__).parent
"""Entries that ship: one YAML file for each kind of weather, beside those of the air and the sky."""
KIND_OF_FILE = "weather catalogue's file"
"""Name of such a file in sentences."""


class GripEntry(CatalogueEntry):
    """Part of a kind's file; the rest says how it looks.

    Parameters
    ----------
    surface : numbers of ``SurfaceParameters`` that this kind has on any pavement; above 0, and in mm where the name
        says so, else without a unit
    tyre : family of vehicles that have none of their own for this kind
    """

    model_config = ConfigDict(extra="ignore")

    surface: dict[str, Bounded] = Field(default_factory=dict)
    tyre: FamilyEntry | None = None

    @field_validator("surface")
    @classmethod
    def _numbers_keep_their_rules(cls, surface: dict[str, Bounded]) -> dict[str, Bounded]:
        problems = []
        for name, number in surface.items():
            try:
                require_quantity("mm" if name.endswith("_mm") else "1", above=0).func(number)  # type: ignore[call-arg]
            except ValueError as error:
                problems.append(f"{shorten(name, 60)}: {error}")
        if problems:
            raise ValueError("; ".join(problems))
        return surface


GRIP_SECTIONS = tuple(GripEntry.model_fields)


def shared_families(folder: Path) -> dict[str, TyreFamily]:
    """Tyre families that the kinds of weather bring, by kind.

    Parameters
    ----------
    folder : of the weather catalogue

    Raises
    ------
    InputError
        Listing every problem of a file.
    """
    return {kind: entry.tyre.family for kind, entry in _load_entries(folder) if entry.tyre is not None}


def weather_numbers(folder: Path) -> dict[str, Bounded]:
    """Numbers of ``SurfaceParameters`` that the kinds of weather bring, by field.

    Parameters
    ----------
    folder : of the weather catalogue

    Raises
    ------
    InputError
        Listing every problem of a file.
    """
    return {name: number for _, entry in _load_entries(folder) for name, number in entry.surface.items()}


def _load_entries(folder: Path) -> Iterator[tuple[str, GripEntry]]:
    for kind in WEATHERS:
        path = folder / f"{kind}.yaml"
        if path.is_file():
            yield kind, _parse_entry(read_content(path, KIND_OF_FILE, LARGEST_YAML), path)


@lru_cache(maxsize=64)
def _parse_entry(content: bytes, path: Path) -> GripEntry:
    return parse_entry(GripEntry, content, path, KIND_OF_FILE)
