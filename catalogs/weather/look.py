"""How weather looks: values with unit and source, and their typed loader."""

from dataclasses import is_dataclass
from functools import cache
from types import GenericAlias, NoneType
from typing import Annotated, Any, get_args, get_type_hints

from pydantic import Field, create_model

from catalogs.quantities import CatalogueEntry, Number, Text, parse_entry
from catalogs.sentences import cap_problems, shorten
from catalogs.weather.grip import GRIP_SECTIONS, KIND_OF_FILE, WEATHER, WeatherFolder
from tasks.errors import InputError
from tasks.render.weather.parameters import KindLook, WeatherParameters
from tasks.surface.weather import WEATHERS

OF_BEFORE = ("full_cover_mm", "texture_depth_mm", "exposure_ev", "cloud_contrast", "cloud_size_m")
"""Values that datasets made before keep here, and that are not read any more."""
MOST_STEPS = 100
"""Size classes, or octaves of noise [1]: five times what ships; each one costs time in every frame."""
WRITTEN: dict[Any, Any] = {
    float: Number,
    int: Annotated[int, Field(strict=True, ge=1, le=MOST_STEPS)],
    str: Text,
}
"""What a file must hold for a field of each type."""


def load_weather(weather: WeatherFolder = WEATHER) -> WeatherParameters:
    """Read how the weathers look.

    Parameters
    ----------
    weather : holds air.yaml and sky.yaml, and a file for each kind of weather under cloud that is asked for

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
    shared = {name: _read_file(hints[name], weather, name, problems) for name in ("air", "sky")}
    overcast = [name for name, kind in WEATHERS.items() if kind.overcast]
    found = [name for name in weather.contents if name not in shared]
    problems += [
        f"{shorten(weather.folder / name)}.yaml: must be of a kind of weather, which are {', '.join(overcast)};"
        f" {shorten(name, 60)} is none"
        for name in found
        if name not in overcast
    ]
    kinds = {name: _read_file(KindLook, weather, name, problems) for name in overcast if name in found}
    if problems:
        raise InputError(cap_problems(problems))
    return WeatherParameters(kinds=kinds, **shared)


def _read_file(form: Any, weather: WeatherFolder, name: str, problems: list[str]) -> Any:
    """One file in its form; None, and its problems, where that fails."""
    path = weather.folder / f"{name}.yaml"
    if name not in weather.contents:
        problems.append(f"{shorten(path)}: the weather catalogue needs this file; it is not there")
        return None
    try:
        return _build(form, parse_entry(_make_schema(form), weather.contents[name], path, KIND_OF_FILE))
    except InputError as error:
        problems += error.problems
        return None


def _list_fields(form: Any) -> dict[str, tuple[Any, bool]]:
    """Type of each field of a class of parameters, and whether it may be missing."""
    hints = get_type_hints(form)
    return {
        name: (next(one for one in get_args(hint) if one is not NoneType), True)
        if NoneType in get_args(hint)
        else (hint, False)
        for name, hint in hints.items()
    }


@cache
def _make_schema(form: Any) -> type[CatalogueEntry]:
    """The schema of a file, or of a part of one: a table for a class, else value, unit and source."""
    if not is_dataclass(form):
        within = tuple(WRITTEN.get(one, one) for one in get_args(form))
        value: Any = GenericAlias(tuple, within) if within else WRITTEN[form]
        return create_model(
            "Look", __base__=CatalogueEntry, value=(value, ...), unit=(Text, ...), source=(Text, ...)
        )
    passed_over = (*OF_BEFORE, *(GRIP_SECTIONS if form is KindLook else ()))
    fields: dict[str, Any] = dict.fromkeys(passed_over, (Any, None))
    for name, (kind, is_optional) in _list_fields(form).items():
        schema: Any = _make_schema(kind)
        fields[name] = (schema | None, None) if is_optional else (schema, ...)
    return create_model("Look", __base__=CatalogueEntry, **fields)


def _build(form: Any, entry: Any) -> Any:
    """The parameters that an entry of their schema holds."""
    if "value" in type(entry).model_fields:
        return entry.value
    given = {name: (kind, getattr(entry, name)) for name, (kind, _) in _list_fields(form).items()}
    values = {name: None if one is None else _build(kind, one) for name, (kind, one) in given.items()}
    return form(**values)
