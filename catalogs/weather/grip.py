"""What the entries of the kinds of weather bring to road and tyre: numbers of the surface, and a tyre family."""

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from pydantic import ConfigDict, Field

from catalogs.quantities import Bounded, CatalogueEntry, read_entry
from catalogs.tyre_families import FamilyEntry
from tasks.surface.weather import WEATHERS
from tasks.vehicle.parameters import TyreFamily

FOLDER = Path(__file__).parent
"""Entries that ship: one YAML file for each kind of weather, beside those of the air and the sky."""


class GripEntry(CatalogueEntry):
    """Part of a kind's file; the rest says how it looks.

    Parameters
    ----------
    surface : numbers of ``SurfaceParameters`` that this kind has on any pavement
    tyre : family of vehicles that have none of their own for this kind
    """

    model_config = ConfigDict(extra="ignore")

    surface: dict[str, Bounded] = Field(default_factory=dict)
    tyre: FamilyEntry | None = None


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
    return {kind: entry.tyre.family for kind, entry in _entries(folder) if entry.tyre is not None}


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
    return {name: number for _, entry in _entries(folder) for name, number in entry.surface.items()}


def _entries(folder: Path) -> Iterator[tuple[str, GripEntry]]:
    for kind in WEATHERS:
        path = folder / f"{kind}.yaml"
        if path.is_file():
            status = path.stat()
            yield kind, _entry(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=64)
def _entry(path: Path, changed_ns: int, size: int) -> GripEntry:
    return read_entry(GripEntry, path, "weather catalogue's file")
