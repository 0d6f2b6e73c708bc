"""How weather looks: values with unit and source, and their typed loader."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from math import isfinite
from pathlib import Path
from typing import Any, get_type_hints

from catalogs.documents import read_yaml
from catalogs.sentences import cap_problems, shorten, shorten_value
from tasks.errors import InputError
from tasks.render.weather.parameters import WeatherParameters

FOLDER = Path(__file__).parent
MOST_STEPS = 100
"""Size classes, or octaves of noise [1]: five times what ships; each one costs time in every frame."""


def load_weather(folder: Path = FOLDER) -> WeatherParameters:
    """Read the weather catalogue.

    Parameters
    ----------
    folder : holds one YAML file for each member of `WeatherParameters`

    Returns
    -------
    WeatherParameters

    Raises
    ------
    InputError
        A file is missing or no YAML, a value is missing, unknown, without unit or source, or no finite number.
    """
    problems: list[str] = []
    documents: dict[str, Any] = {}
    for member in fields(WeatherParameters):
        path = folder / f"{member.name}.yaml"
        if not path.is_file():
            problems.append(f"{shorten(path)}: the weather catalogue needs this file; it is not there")
            continue
        try:
            documents[member.name] = read_yaml(path, "weather catalogue's file", finite=False)
        except InputError as error:
            problems += error.problems
    values: dict[str, Any] = {
        name: _build_parameters(kind, documents[name], f"{shorten(folder / name)}.yaml", problems)
        for name, kind in get_type_hints(WeatherParameters).items()
        if name in documents
    }
    if problems:
        raise InputError(cap_problems(problems))
    return WeatherParameters(**values)


def _build_parameters(kind: Any, entries: object, place: str, problems: list[str]) -> Any:
    """Build a parameter class from a mapping of its fields; None, and a problem, where that fails."""
    if not isinstance(entries, Mapping):
        problems.append(f"{place}: must map names to values; it holds {shorten_value(entries)}")
        return None
    hints = get_type_hints(kind)
    for name in sorted(set(entries) - set(hints)):
        problems.append(f"{place}: {shorten(name, 60)} is not a known value; known are {', '.join(hints)}")
    for name in sorted(set(hints) - set(entries)):
        problems.append(f"{place}: {name} is missing; give it value, unit and source")
    built: dict[str, Any] = {}
    before = len(problems)
    for name, hint in hints.items():
        if name not in entries:
            continue
        where = f"{place}: {name}"
        read = _build_parameters if is_dataclass(hint) else _read_value
        built[name] = read(hint, entries[name], where, problems)
    return kind(**built) if len(built) == len(hints) and len(problems) == before else None


def _read_value(hint: Any, entry: object, where: str, problems: list[str]) -> Any:
    """One value; a problem where it lacks unit or source, or is not of the field's type."""
    if not isinstance(entry, Mapping) or set(entry) != {"value", "unit", "source"}:
        problems.append(
            f"{where} must have value, unit and source, and nothing else; it is {shorten_value(entry)}"
        )
        return None
    value = entry["value"]
    if hint is str:
        if not isinstance(value, str):
            problems.append(f"{where} must be a word; it is {shorten_value(value)}")
        return value
    single = hint in (int, float)
    numbers = [value] if single else value if isinstance(value, list) else []
    sound = [_is_sound(n, hint is int) for n in numbers]
    if not (sound and all(sound)):
        rule = (
            f"a whole number from 1 to {MOST_STEPS}"
            if hint is int
            else "a finite number"
            if single
            else "a list of finite numbers"
        )
        problems.append(f"{where} must be {rule}; it is {shorten_value(value)}")
        return None
    return hint(value) if single else tuple(float(n) for n in numbers)


def _is_sound(number: object, is_count: bool) -> bool:
    if is_count:
        return type(number) is int and 1 <= number <= MOST_STEPS
    return type(number) in (int, float) and isfinite(number)  # type: ignore[arg-type]
