"""The streets' dimensions and light, from the catalogue."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, create_model

from catalogs.quantities import CatalogueEntry, Scalar, Table, read_entry, require_quantity
from tasks.scene.street.course import CourseRanges, Stretches, draw_stretches
from tasks.scene.street.layout import MAY_BE_NONE, StreetLayout
from tasks.scene.street.noise import named_generator
from tasks.scene.street.season import SeasonRanges, draw_season, light_of

STREET_FILE = Path(__file__).parent / "street.yaml"
CHANGES = {"street": (), "hill": (STREET_FILE.with_name("hill.yaml"),)}
"""Built-in streets by name, and the file of what each has otherwise than `STREET_FILE`."""


def _require_range(entry: Table) -> Table:
    if len(entry.value) != 2 or not entry.value[0] < entry.value[1]:
        raise ValueError(f"must be one number, or a range of two that ascend; it is {list(entry.value)}")
    return entry


Lengths = Annotated[Table, require_quantity("m", minimum=0.0)]
Span = Annotated[Table, require_quantity("m", above=0.0), AfterValidator(_require_range)]


class CourseEntry(CatalogueEntry):
    """A course as a file has it; `Stretches` gives the meanings."""

    length: Lengths
    curvature: Annotated[Table, require_quantity("m-1")]
    grade: Annotated[Table, require_quantity("1", above=-1.0, below=1.0)]
    transition: Lengths
    bloss_share: Annotated[Scalar, require_quantity("1", minimum=0.0, maximum=1.0)]


class CourseRangesEntry(CatalogueEntry):
    """Ranges of a course that is drawn; `CourseRanges` gives the meanings."""

    straight: Span
    bend: Span
    radius: Span
    transition: Span
    slope: Span
    grade: Annotated[Table, require_quantity("1", above=-1.0, below=1.0), AfterValidator(_require_range)]
    end_radius: Span


class SeasonRangesEntry(CatalogueEntry):
    """Ranges of sun and season; `SeasonRanges` gives the meanings."""

    latitude: Annotated[
        Table, require_quantity("deg", above=-66.0, below=66.0), AfterValidator(_require_range)
    ]
    day: Annotated[Table, require_quantity("d", minimum=0.0, maximum=730.0), AfterValidator(_require_range)]
    daylight: Annotated[
        Table, require_quantity("1", minimum=0.0, maximum=1.0), AfterValidator(_require_range)
    ]
    road_azimuth: Annotated[Table, require_quantity("deg"), AfterValidator(_require_range)]


def _choose_type(name: str) -> Any:
    """The type of one entry: colours, shares and numbers of things have no unit, and angles may be negative."""
    if name == "course":
        return CourseEntry
    if name.endswith("_rgb"):
        return Annotated[Table, require_quantity("1", minimum=0.0)]
    if name.endswith("_deg"):
        return Annotated[Scalar, require_quantity("deg")]
    if name.endswith("_share"):
        return Annotated[Scalar, require_quantity("1", minimum=0.0, maximum=1.0)]
    if name.endswith("_scale"):
        return Annotated[Scalar, require_quantity("1", minimum=0.0)]
    if name.endswith(("_storeys", "_bays")):
        return Annotated[Scalar, require_quantity("1", above=0.0)]
    if name in MAY_BE_NONE:
        return Annotated[Scalar, require_quantity("m", minimum=0.0)]
    return Annotated[Scalar, require_quantity("m", above=0.0)]


def _allow_range(name: str) -> Any:
    """The type of one entry of a file of changes, where a number may be a range of two."""
    rule = _choose_type(name)
    if name == "course":
        return CourseEntry | CourseRangesEntry
    drawn = Annotated[Table, *rule.__metadata__, AfterValidator(_require_range)]
    return rule if name.endswith("_rgb") else rule | drawn


_FIELDS: dict[str, Any] = {field.name: (_choose_type(field.name), ...) for field in fields(StreetLayout)}

StreetEntry = create_model("StreetEntry", __base__=CatalogueEntry, **_FIELDS)
"""Content of the street's file: every field of `StreetLayout`."""
_CHANGED: dict[str, Any] = {name: (_allow_range(name) | None, None) for name in _FIELDS}
_CHANGED["season"] = (SeasonRangesEntry | None, None)

StreetChanges = create_model("StreetChanges", __base__=CatalogueEntry, **_CHANGED)
"""Content of the file of another street: the fields that differ; ``season`` sets sun and foliage."""


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
    layout = StreetLayout(**{name: _read_value(getattr(entry, name)) for name in StreetEntry.model_fields})
    for change in changes:
        other = read_entry(StreetChanges, change, "street")
        asked = {name: getattr(other, name) for name in other.model_fields_set}
        course, season = asked.pop("course", None), asked.pop("season", None)
        layout = replace(layout, **{name: _draw_value(value, name, seed) for name, value in asked.items()})
        if isinstance(course, CourseRangesEntry):
            ranges = _read_ranges(CourseRanges, course)
            drawn = draw_stretches(ranges, layout.route_length, layout.beyond, seed)
            layout = replace(layout, course=drawn)
        elif course is not None:
            layout = replace(layout, course=_read_value(course))
        if season is not None:
            drawn_season: dict[str, Any] = draw_season(_read_ranges(SeasonRanges, season), seed)
            layout = replace(layout, **drawn_season)
            light = light_of(layout.sun_elevation_deg, layout.sun_rgb, layout.sky_rgb, layout.bounce_rgb)
            layout = replace(layout, sun_rgb=light[0], sky_rgb=light[1], bounce_rgb=light[2])
    return layout


def _read_value(entry: Any) -> Any:
    if isinstance(entry, CourseEntry):
        return Stretches(**{name: getattr(entry, name).value for name in CourseEntry.model_fields})
    return entry.value


def _read_ranges(kind: Any, entry: CatalogueEntry) -> Any:
    return kind(**{name: getattr(entry, name).value for name in type(entry).model_fields})


def _draw_value(entry: Scalar | Table, name: str, seed: int) -> Any:
    """The value of an entry: of a range, a number that the seed draws."""
    if isinstance(entry, Scalar) or name.endswith("_rgb"):
        return entry.value
    low, high = entry.value
    return float(named_generator(seed, f"layout {name}").uniform(low, high))
