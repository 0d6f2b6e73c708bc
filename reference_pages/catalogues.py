"""Pages of the catalogues: every entry with value, unit and source, as its file has them."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from catalogs.entries import CATALOGUE, entry_names, find_entry, load
from catalogs.vehicles import open_vehicle
from reference_pages.markdown import format_cell, format_table, format_value
from tasks.conventions import CHANNELS_BY_NAME

RULES = (
    ("gates", "A clip's pose check"),
    ("foreign_gates", "A foreign video's claim"),
    ("physical_limits", "Limits of a scenario"),
    ("calibrated_range", "Calibrated range"),
    ("plausible_vehicle", "Plausible vehicles"),
)
"""Files of the catalogue's own folder, with their headings."""
TABLED = ("camera", "surface", "calibration procedure", "hazard marking")
"""Kinds of few files, whose numbers have value, unit and source."""
LISTED = ("tyre", "channel map")
"""Kinds of which the files are named with their first comment; other pages say what they hold."""

REFERENCE = "paper-reference"
"""Vehicle that stands first beside others."""


def write_weather_page() -> str:
    """Return the page of weather kinds: the numbers of each kind, of the air and of the sky."""
    page = (
        "# Kinds of weather\n\nEach file of `catalogs/weather/` holds the numbers of a kind, and `air.yaml` and"
        " `sky.yaml` those of all kinds. [Weather in the picture](../../explanation/weather.md) says what they do,"
        " [add a kind of weather](../../how-to/add-a-weather-kind.md) how there come to be more.\n\n"
    )
    return page + "\n".join(_describe_file(path, path.stem) for path in _yaml_files("weather"))


def write_vehicles_page() -> str:
    """Return the page of vehicles: their numbers side by side, then each with its sources."""
    names = sorted(entry_names("vehicle"), key=lambda name: (name != REFERENCE, name))
    files = {name: open_vehicle(name) for name in names}
    numbers = {name: file.numbers for name, file in files.items()}
    keys = list(dict.fromkeys(key for name in names for key in numbers[name]))
    unit_of = {key: number.unit for name in names for key, number in numbers[name].items()}
    rows = [
        (
            f"`{key}`",
            unit_of[key],
            *(format_value(numbers[n][key].value) if key in numbers[n] else "" for n in names),
        )
        for key in keys
    ]
    page = (
        "# Vehicles\n\nThe files of `catalogs/vehicles/`. Values of an axle are of both sides."
        " [Describe your car](../../how-to/describe-your-car.md) says how to write one.\n\n## Side by side\n\n"
        + format_table(("number", "unit", *(f"`{name}`" for name in names)), rows)
    )
    for name in names:
        page += _describe_content(name, files[name].source, yaml.safe_load(files[name].content))
    return page


def write_grids_page() -> str:
    """Return the page of grids: what each makes, and its controls with their units."""
    page = (
        "# Grids\n\nThe files of `catalogs/grids/`: `musync generate NAME --out DIR` makes one."
        " [Write a grid](../../how-to/write-a-grid.md) says how to write your own.\n\n"
    )
    for name in entry_names("grid"):
        grid = load("grid", name)
        settings = grid.settings
        drawn = (
            f"{settings.frames} frames at {settings.frame_rate_hz:g} Hz"
            if settings.pictures
            else "no pictures"
        )
        page += (
            f"\n## {name}\n\n{format_cell(_read_comment(find_entry('grid', name)))}\n\n{len(grid.scenarios)} clips of"
            f" {(settings.frames - 1) / settings.frame_rate_hz:g} s, {drawn}, vehicle `{settings.vehicle}`.\n\n"
        )
        scenarios = [{k: v for k, v in s.as_row().items() if v is not None} for _, s in grid.scenarios]
        fields = [
            f for f in CHANNELS_BY_NAME if any(f in s for s in scenarios) and f not in {"label", "clip_id"}
        ]
        rows = []
        for field in fields:
            levels = list(dict.fromkeys(format_value(s.get(field)) for s in scenarios))
            channel = CHANNELS_BY_NAME[field]
            if levels not in ([""], ["0"], ["no"]):
                rows.append(
                    (f"`{field}`", ", ".join(filter(None, levels)), channel.unit, channel.description)
                )
        page += format_table(("control", "levels", "unit", "meaning"), rows)
    return page


def write_other_kinds_page() -> str:
    """Return the page of cameras, surfaces and all other kinds of entry that have no page of their own."""
    page = "# Cameras, surfaces, procedures\n\nKinds of entry with few files, each under its folder in `catalogs/`.\n\n"
    for kind in TABLED:
        page += f"\n## {kind.capitalize()}\n\n"
        for name in entry_names(kind):
            page += _describe_file(find_entry(kind, name), name, level=3)
    page += "\n## Tyres, channel maps, studies\n\n"
    rows = [
        (kind, f"`{name}`", _read_comment(find_entry(kind, name)))
        for kind in LISTED
        for name in entry_names(kind)
    ]
    return page + format_table(("kind", "name", "its file says"), rows)


def write_rules_page() -> str:
    """Return the page of limits and rules: gates, plausible ranges, and rules of decision."""
    page = (
        "# Limits and rules\n\nNumbers by which muSync refuses, warns or decides, from the files of `catalogs/`."
        " [Rules of a verdict](../verdict-rules.md) has those by which `close-loop` decides.\n\n"
    )
    return page + "\n".join(_describe_file(CATALOGUE / f"{name}.yaml", heading) for name, heading in RULES)


def list_quantities(content: object, name: str = "") -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the entries of a file that have a source, with their keys joined by dots.

    Parameters
    ----------
    content : of a YAML file
    name : keys above it
    """
    if isinstance(content, list):
        for number, part in enumerate(content):
            yield from list_quantities(part, f"{name}[{number}]")
    if not isinstance(content, Mapping):
        return
    if "source" in content:
        yield name, content
        return
    for key, part in content.items():
        yield from list_quantities(part, f"{name}.{key}" if name else str(key))


def _describe_file(path: Path, heading: str, level: int = 2) -> str:
    return _describe_content(heading, path, yaml.safe_load(path.read_text(encoding="utf-8")), level)


def _describe_content(heading: str, path: Path, content: object, level: int = 2) -> str:
    """Return a section: the file's own comment, and a row for each entry that has a source."""
    rows = []
    for key, entry in list_quantities(content):
        value = entry.get("value", entry.get("levels", ""))
        rest = {k: v for k, v in entry.items() if k not in {"value", "levels", "unit", "source"}}
        further = "; ".join(f"{k} {format_value(v)}" for k, v in rest.items())
        rows.append((f"`{key}`", value, entry.get("unit", ""), further, entry["source"]))
    table = format_table(("entry", "value", "unit", "further", "source"), rows)
    shown = path.relative_to(CATALOGUE.parent).as_posix()
    comment = format_cell(_read_comment(path))
    return f"\n{'#' * level} {heading}\n\n`{shown}`{': ' + comment if comment else ''}\n\n{table}\n"


def _read_comment(path: Path) -> str:
    """Return the comment with which a file begins, on one line."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith(("#", "$")):
            break
        lines.append(line.lstrip("#$ "))
    return " ".join(lines)


def _yaml_files(folder: str) -> list[Path]:
    return sorted((CATALOGUE / folder).glob("*.yaml"))


WRITERS = {
    "reference/catalogues/weather.md": write_weather_page,
    "reference/catalogues/vehicles.md": write_vehicles_page,
    "reference/catalogues/grids.md": write_grids_page,
    "reference/catalogues/others.md": write_other_kinds_page,
    "reference/catalogues/rules.md": write_rules_page,
}
"""Function that writes each page, by its path below ``docs/``."""
