"""How weather looks: values with unit and source, and their typed loader."""

from collections.abc import Mapping
from dataclasses import is_dataclass
from math import isfinite
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_type_hints

from catalogs.documents import read_yaml
from catalogs.sentences import cap_problems, shorten, shorten_value
from catalogs.weather.grip import FOLDER, GRIP_SECTIONS, KIND_OF_FILE
from tasks.errors import InputError
from tasks.render.weather.parameters import KindLook, WeatherParameters
from tasks.surface.weather import WEATHERS

OF_THE_PAVEMENT = ("full_cover_mm", "texture_depth_mm")
"""Values that datasets made before keep here too, and that are now read from the surface's entry alone."""
MOST_STEPS = 100
"""Size classes, or octaves of noise [1]: five times what ships; each one costs time in every frame."""


def load_weather(folder: Path = FOLDER) -> WeatherParameters:
    """Read how the weathers look.

    Parameters
    ----------
    folder : holds air.yaml and sky.yaml, and a file for each kind of weather under cloud that is asked for

    Returns
    -------
    WeatherParameters

    Raises
    ------
    InputError
        A file is missing, no YAML or of no kind of weather, or a value is missing, unknown, without unit or source, or
        no finite number.
    """
    problems: list[str] = []
    hints = get_type_hints(WeatherParameters)
    shared = {name: _read_files(hints[name], folder, name, problems) for name in ("air", "sky")}
    overcast = [name for name, kind in WEATHERS.items() if kind.overcast]
    found = sorted(path.stem for path in folder.glob("*.yaml") if path.stem not in shared)
    problems += [
        f"{shorten(folder / name)}.yaml: must be of a kind of weather, which are {', '.join(overcast)};"
        f" {shorten(name, 60)} is none"
        for name in found
        if name not in overcast
    ]
    kinds = {name: _read_files(KindLook, folder, name, problems) for name in overcast if name in found}
    if problems:
        raise InputError(cap_problems(problems))
    return WeatherParameters(kinds=kinds, **shared)


def _read_files(form: Any, folder: Path, name: str, problems: list[str]) -> Any:
    """One file in its form; None, and a problem, where that fails."""
    path = folder / f"{name}.yaml"
    if not path.is_file():
        problems.append(f"{shorten(path)}: the weather catalogue needs this file; it is not there")
        return None
    try:
        document = read_yaml(path, KIND_OF_FILE, finite=False)
    except InputError as error:
        problems += error.problems
        return None
    looks = {key: value for key, value in document.items() if key not in GRIP_SECTIONS}
    return _build_parameters(form, looks, f"{shorten(folder / name)}.yaml", problems)


def _build_parameters(kind: Any, entries: object, place: str, problems: list[str]) -> Any:
    """Build a parameter class from a mapping of its fields; None, and a problem, where that fails."""
    if not isinstance(entries, Mapping):
        problems.append(f"{place}: must map names to values; it holds {shorten_value(entries)}")
        return None
    hints = get_type_hints(kind)
    optional = {name for name, hint in hints.items() if NoneType in get_args(hint)}
    for name in sorted(set(entries) - set(hints) - set(OF_THE_PAVEMENT)):
        problems.append(f"{place}: {shorten(name, 60)} is not a known value; known are {', '.join(hints)}")
    for name in sorted(set(hints) - set(entries) - optional):
        problems.append(f"{place}: {name} is missing; give it value, unit and source")
    built: dict[str, Any] = {}
    before = len(problems)
    for name, hint in hints.items():
        if name not in entries:
            continue
        where = f"{place}: {name}"
        form = next(one for one in get_args(hint) if one is not NoneType) if name in optional else hint
        read = _build_parameters if is_dataclass(form) else _read_value
        built[name] = read(form, entries[name], where, problems)
    return kind(**built) if built.keys() >= hints.keys() - optional and len(problems) == before else None


def _read_value(hint: Any, entry: object, where: str, problems: list[str]) -> Any:
    """One value; a problem where it lacks unit or source, or is not of the field's type."""
    if not isinstance(entry, Mapping) or set(entry) != {"value", "unit", "source"}:
        problems.append(
            f"{where} must have value, unit and source, and nothing else; it is {shorten_value(entry)}"
        )
        return None
    for name in ("unit", "source"):
        if not (isinstance(entry[name], str) and entry[name]):
            problems.append(f"{where}: {name} must be a word; it is {shorten_value(entry[name])}")
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
