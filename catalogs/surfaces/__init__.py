"""Pavements: what lies on a road in a given weather, and how it grips."""

from dataclasses import fields
from pathlib import Path
from typing import Annotated

from pydantic import model_validator

from catalogs.entries import find_entry
from catalogs.quantities import Bounded, CatalogueEntry, Scalar, read_entry, require_quantity
from catalogs.sentences import shorten
from catalogs.weather.grip import FOLDER as WEATHER
from catalogs.weather.grip import weather_numbers
from tasks.errors import InputError
from tasks.surface.state import SurfaceParameters

Friction = Annotated[Bounded, require_quantity("1", above=0, maximum=2)]
Depth = Annotated[Bounded, require_quantity("mm", above=0)]
Exponent = Annotated[Scalar, require_quantity("1")]


class SurfaceEntry(CatalogueEntry):
    """Content of a surface file; `SurfaceParameters` gives the meanings."""

    dry_friction: Friction
    flooded_friction: Friction
    film_decay_mm: Depth
    texture_depth_mm: Depth
    drainage_length: Annotated[Bounded, require_quantity("m", above=0)]
    crossfall: Annotated[Bounded, require_quantity("m m-1", above=0)]
    film_coefficient: Annotated[Scalar, require_quantity("1", above=0)]
    film_texture_exponent: Exponent
    film_length_exponent: Exponent
    film_rate_exponent: Annotated[Scalar, require_quantity("1", above=0)]
    film_crossfall_exponent: Exponent
    bare_wet_friction: Friction
    snow_friction: Friction
    fresh_snow_density: Annotated[Bounded, require_quantity("kg m-3", above=0)]
    water_density: Annotated[Scalar, require_quantity("kg m-3", above=0)]
    full_cover_depth_mm: Depth

    @model_validator(mode="after")
    def _weather_lowers_friction(self) -> "SurfaceEntry":
        problems = [
            f"{lower} must not exceed {higher}; they are {a:g} and {b:g}"
            for lower, higher in (
                ("flooded_friction", "dry_friction"),
                ("snow_friction", "bare_wet_friction"),
            )
            if (a := getattr(self, lower).value) > (b := getattr(self, higher).value)
        ]
        if problems:
            raise ValueError("; ".join(problems))
        return self


def load_surface(name_or_path: str | Path, weather: Path = WEATHER) -> SurfaceParameters:
    """Read a surface by its name in the catalogue or from a YAML file.

    Parameters
    ----------
    name_or_path : name, or path ending in .yaml
    weather : folder of the weather catalogue, whose kinds bring numbers that they have on any pavement

    Raises
    ------
    InputError
        Listing every problem of the files, or the names that exist.
    """
    entry = read_entry(SurfaceEntry, find_entry("surface", name_or_path), "surface")
    brought = weather_numbers(weather)
    known = {field.name for field in fields(SurfaceParameters)} - set(SurfaceEntry.model_fields) - {"bounds"}
    if unknown := sorted(set(brought) - known):
        raise InputError(
            f"{shorten(weather)}: surface: {', '.join(unknown)}: no numbers that a kind of weather brings;"
            f" there are {', '.join(sorted(known)) or 'none'}"
        )
    numbers = {name: getattr(entry, name) for name in SurfaceEntry.model_fields} | brought
    bounds = {name: number.bounds for name, number in numbers.items() if isinstance(number, Bounded)}
    return SurfaceParameters(**{name: number.value for name, number in numbers.items()}, bounds=bounds)
