"""Pavements: what lies on a road in a given weather, and how it grips."""

from dataclasses import fields
from typing import Annotated

from pydantic import model_validator

from catalogs.quantities import Bounded, CatalogueEntry, Scalar, require_quantity
from catalogs.sentences import shorten
from catalogs.weather.grip import WEATHER, WeatherFolder
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

    def build(self, weather: WeatherFolder = WEATHER) -> SurfaceParameters:
        """The surface with the numbers that kinds of weather have on any pavement."""
        brought = weather.surface_numbers
        known = (
            {field.name for field in fields(SurfaceParameters)} - set(SurfaceEntry.model_fields) - {"bounds"}
        )
        if unknown := sorted(set(brought) - known):
            raise InputError(
                f"{shorten(weather.folder)}: surface: {', '.join(unknown)}: no numbers that a kind of weather brings;"
                f" there are {', '.join(sorted(known)) or 'none'}"
            )
        numbers = {name: getattr(self, name) for name in SurfaceEntry.model_fields} | brought
        bounds = {name: number.bounds for name, number in numbers.items() if isinstance(number, Bounded)}
        return SurfaceParameters(**{name: number.value for name, number in numbers.items()}, bounds=bounds)
