"""Declared numbers of the car, the designs and the effects, read from YAML as plain data."""

from functools import cache
from pathlib import Path
from typing import Any

import yaml

HERE = Path(__file__).parent
VEHICLES = HERE.parents[1] / "catalogs" / "vehicles"
"""Catalogue of vehicles; it is read as data, for nothing of its loaders may be shared."""


@cache
def read_declared(name: str) -> dict[str, Any]:
    """Content of car.yaml, designs.yaml or effects.yaml.

    Parameters
    ----------
    name : of the file, without its suffix
    """
    content: dict[str, Any] = yaml.safe_load((HERE / f"{name}.yaml").read_text(encoding="utf-8"))
    return content


def read_vehicle(name: str) -> dict[str, float]:
    """Numbers of a vehicle of the catalogue, by name.

    Parameters
    ----------
    name : of the entry
    """
    entry = yaml.safe_load((VEHICLES / f"{name}.yaml").read_text(encoding="utf-8"))
    return {
        key: float(value["value"])
        for key, value in entry.items()
        if "value" in value and not isinstance(value["value"], list)
    }


def values_of(group: dict[str, Any]) -> dict[str, float]:
    """Numbers of one group of a declared file, by name.

    Parameters
    ----------
    group : entries with value, unit and source; other entries are left out
    """
    return {
        key: float(entry["value"])
        for key, entry in group.items()
        if isinstance(entry, dict) and "value" in entry
    }


def find_surface(weather: str, rate: float) -> dict[str, Any]:
    """Tyre curve and snow depth of a weather.

    Parameters
    ----------
    weather : name of the kind
    rate : of rain or snow [mm/h]

    Raises
    ------
    ValueError
        If the table has no such row.
    """
    rows: list[dict[str, Any]] = read_declared("car")["surfaces"]["rows"]
    for row in rows:
        if row["weather"] == weather and row["rate"] == rate:
            return row
    known = ", ".join(f"{row['weather']} {row['rate']}" for row in rows)
    raise ValueError(f"car.yaml has no surface for {weather} of {rate} mm/h; it has {known}")


def find_effect(name: str) -> dict[str, Any]:
    """Entry of an effect or form, with its group.

    Parameters
    ----------
    name : in effects.yaml

    Raises
    ------
    ValueError
        If there is no such effect, naming those that there are.
    """
    effects = read_declared("effects")
    for group in ("standard", "further", "forms"):
        if name in effects[group]:
            return {**effects[group][name], "group": group}
    known = ", ".join(name for group in ("standard", "further", "forms") for name in effects[group])
    raise ValueError(f"effects.yaml has no effect {name}; it has {known}")
