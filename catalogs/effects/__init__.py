"""The library of effects that a vehicle model may lack."""

from pathlib import Path
from typing import Any

import yaml

from tasks.errors import InputError
from tasks.vehicle.effects.library import PARAMETER_INDEX, Effect, EffectParameter

LIBRARY_FILE = Path(__file__).with_name("library.yaml")


def load_effects(path: str | Path = LIBRARY_FILE) -> tuple[Effect, ...]:
    """Effects of a library file, in its order.

    Parameters
    ----------
    path : YAML list of effects

    Raises
    ------
    InputError
        With every rule the file breaks.
    """
    with open(path, encoding="utf-8") as file:
        entries = yaml.safe_load(file)
    problems: list[str] = []
    for entry in entries:
        problems += _problems(entry)
    names = [entry.get("name") for entry in entries]
    problems += [
        f"effect {name} stands twice in {path}" for name in sorted({n for n in names if names.count(n) > 1})
    ]
    if problems:
        raise InputError(problems)
    return tuple(_effect(entry) for entry in entries)


def _problems(entry: dict[str, Any]) -> list[str]:
    where = f"effect {entry.get('name', '?')}"
    needed = ("name", "class", "port", "variable", "enters", "source", "parameters")
    problems = [f"{where} needs the key {key}" for key in needed if key not in entry]
    if problems:
        return problems
    if entry["class"] not in ("effect", "retune", "sensor"):
        problems.append(f"{where}: class must be effect, retune or sensor; it is {entry['class']}")
    if not 1 <= len(entry["parameters"]) <= 2:
        problems.append(f"{where} must have one or two parameters; it has {len(entry['parameters'])}")
    for name, p in entry["parameters"].items():
        if name not in PARAMETER_INDEX:
            problems.append(
                f"{where}: no port knows the parameter {name}; there are: {', '.join(PARAMETER_INDEX)}"
            )
        elif not (p["lower"] <= p["start"] <= p["upper"] and 0 < p["step"] < p["upper"] - p["lower"]):
            problems.append(f"{where}: {name} needs lower <= start <= upper and a step above 0; it has {p}")
    return problems


def _effect(entry: dict[str, Any]) -> Effect:
    return Effect(
        name=entry["name"],
        effect_class=entry["class"],
        port=entry["port"],
        variable=entry["variable"],
        enters=entry["enters"],
        source=entry["source"],
        parameters=tuple(
            EffectParameter(
                name=name, unit=p["unit"], **{k: float(p[k]) for k in ("lower", "upper", "step", "start")}
            )
            for name, p in entry["parameters"].items()
        ),
    )
