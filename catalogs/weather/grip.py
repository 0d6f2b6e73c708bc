"""Numbers of the surface, and tyre families, that the entries of the kinds of weather give."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pydantic import ConfigDict, Field, field_validator

from catalogs.documents import LARGEST_YAML, read_content
from catalogs.quantities import Bounded, CatalogueEntry, parse_entry, require_quantity
from catalogs.sentences import shorten
from catalogs.tyre_families import FamilyEntry
from tasks.surface.weather import WEATHERS
from tasks.vehicle.parameters import TyreFamily

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


@dataclass(frozen=True)
class WeatherFolder:
    """A folder with a file for each kind of weather, and those of the air and the sky; each file is read once.

    Parameters
    ----------
    folder : of the files
    """

    folder: Path

    @cached_property
    def contents(self) -> dict[str, bytes]:
        """Content of each file, by its name without the suffix; raises `InputError` where one cannot be read."""
        files = sorted(self.folder.glob("*.yaml"))
        return {file.stem: read_content(file, KIND_OF_FILE, LARGEST_YAML) for file in files}

    @cached_property
    def grips(self) -> dict[str, GripEntry]:
        """How kinds of weather grip; raises `InputError` that lists every problem of a file."""
        return {
            kind: parse_entry(GripEntry, self.contents[kind], self.folder / f"{kind}.yaml", KIND_OF_FILE)
            for kind in WEATHERS
            if kind in self.contents
        }

    @property
    def families(self) -> dict[str, TyreFamily]:
        """Tyre families that the kinds of weather bring, by kind."""
        return {kind: entry.tyre.family for kind, entry in self.grips.items() if entry.tyre is not None}

    @property
    def surface_numbers(self) -> dict[str, Bounded]:
        """Numbers of ``SurfaceParameters`` that the kinds of weather bring, by field."""
        return {name: number for entry in self.grips.values() for name, number in entry.surface.items()}


WEATHER = WeatherFolder(Path(__file__).parent)
"""The kinds of weather that ship."""
