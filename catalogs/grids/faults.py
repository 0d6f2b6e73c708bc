"""Reading a faulty grid as far as possible: faults are reported and left out, so that the rest is checked too."""

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from catalogs.grids.blocks import Levels, PartialScenario
from catalogs.grids.form import GridFile
from catalogs.road_users import RoadUser, TrackForm
from catalogs.scenario import NUMBERS, UNKNOWN_WEATHER
from catalogs.sentences import KeyPath, describe_rules

BLOCKS = ("axes", "zip", "scenarios", "latin_hypercube")
UNKNOWN: dict[str, Any] = {"weather": UNKNOWN_WEATHER, **dict.fromkeys(NUMBERS, nan)}
"""Values of a level of which nothing can be read."""


@dataclass(kw_only=True)
class GridForm:
    """The readable part of a faulty grid.

    Parameters
    ----------
    settings : the grid without its faults; None if nothing is left
    problems : one sentence for each fault of form
    is_expandable : False where a fault leaves open which scenarios there are
    """

    settings: GridFile | None
    problems: list[str] = field(default_factory=list)
    is_expandable: bool = True


def read_form(content: dict[str, Any], path: Path) -> GridForm:
    """Return the settings of a grid, and the problems of their form.

    Parameters
    ----------
    content : of the file
    path : the file, for the sentences
    """
    kept = deepcopy(content)
    form = GridForm(settings=None)
    unknown: dict[KeyPath, set[str]] = {}
    for _ in range(4):  # without a fault, a rule about the whole grid can fail, and then another
        try:
            settings = GridFile.model_validate(kept)
        except ValidationError as error:
            form.problems += describe_rules(error, path, _known_keys)
            for fault in error.errors(include_url=False):
                if not _leave_out(kept, fault["loc"], unknown):
                    form.is_expandable = False
            if not form.is_expandable:
                kept = {key: value for key, value in kept.items() if key not in (*BLOCKS, "base", "exclude")}
                kept["scenarios"] = {"unknown": {}}
        else:
            form.settings = _mark_unknown(settings, unknown)
            break
    return form


def _known_keys(key_path: KeyPath) -> Iterable[str]:
    if "objects" in key_path:
        return TrackForm.model_fields if key_path[-1] == "track" else RoadUser.model_fields
    return GridFile.model_fields if not key_path else PartialScenario.model_fields


def _leave_out(kept: dict[str, Any], key_path: KeyPath, unknown: dict[KeyPath, set[str]]) -> bool:
    """Remove the faulty parts; return False where the scenarios are then undetermined.

    A field of a level, or all of the level, is noted as unknown.
    """
    if not key_path:
        return False
    block = key_path[0]
    depth = {"axes": 3, "zip": 3, "scenarios": 2, "base": 1}.get(str(block), 0)
    if not depth or len(key_path) < depth:
        kept.pop(str(block), None)
        if block == "name":
            kept["name"] = "unnamed"
        if block == "frames":  # the rate's rule is about both
            kept.pop("frame_rate_hz", None)
        if block in ("frames", "frame_rate_hz"):
            kept.pop("duration_s", None)
        if block == "frame_rate_hz":
            kept.pop("frames", None)
        return block not in (*BLOCKS, "exclude")
    if key_path[-1] == "[key]":
        return False
    table: Any = kept
    for key in key_path[: depth - 1]:
        table = table.get(key, {})
    if key_path[depth - 1] not in table:  # left out with what was around it
        return True
    level = key_path[depth - 1]
    if len(key_path) == depth:
        table[level] = {}
        unknown.setdefault(key_path, set()).update(UNKNOWN)
        return block != "base"
    name = str(key_path[depth])
    table[level].pop(name, None)
    unknown.setdefault(key_path[:depth], set()).add(name)
    return True


def _mark_unknown(settings: GridFile, unknown: dict[KeyPath, set[str]]) -> GridFile:
    """The settings with every field that could not be read as NaN, or as the unknown weather."""

    def mark(partial: PartialScenario, key_path: KeyPath) -> PartialScenario:
        names = unknown.get(key_path, set()) & UNKNOWN.keys()
        return partial.model_copy(update={name: UNKNOWN[name] for name in names})

    def mark_axes(block: str, axes: dict[str, Levels]) -> dict[str, Levels]:
        return {
            axis: {name: mark(level, (block, axis, name)) for name, level in levels.items()}
            for axis, levels in axes.items()
        }

    return settings.model_copy(
        update={
            "base": mark(settings.base, ("base",)),
            "axes": mark_axes("axes", settings.axes),
            "zip": mark_axes("zip", settings.zip),
            "scenarios": {
                name: mark(level, ("scenarios", name)) for name, level in settings.scenarios.items()
            },
        }
    )
