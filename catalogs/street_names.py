"""Kinds of street, of which a seed draws one: ``KIND-SEED``, such as town-7, is the name of a scene."""

import re
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from catalogs.sentences import shorten_value

KIND_FILES = {file.stem: file for file in sorted((Path(__file__).parent / "scenes" / "kinds").glob("*.yaml"))}
"""File of each kind of street by its name: what it has otherwise than the built-in street."""
KINDS = tuple(KIND_FILES)
HIGHEST_SEED = 999_999
MOST_STREETS = 10_000
"""Streets of one axis [1]."""
_NAME = re.compile(rf"({'|'.join(KINDS)})-(0|[1-9][0-9]{{0,5}})")
_VALIDATED, _TESTED = (3, 8), (4, 9)
"""Last digits of the seeds whose streets are kept for validation, and for the test."""


@dataclass(frozen=True, kw_only=True)
class StreetName:
    """A street by its kind and seed."""

    kind: str
    seed: int

    def __str__(self) -> str:
        return f"{self.kind}-{self.seed}"

    @property
    def random_seed(self) -> int:
        """Seed of all that is drawn, so that one seed of two kinds draws different numbers [1]."""
        return int.from_bytes(sha256(str(self).encode()).digest()[:6], "big")


def parse_street_name(name: object) -> StreetName | None:
    """Return kind and seed of a street that is named ``KIND-SEED``; None of any other scene.

    Parameters
    ----------
    name : of a scene
    """
    found = _NAME.fullmatch(name) if isinstance(name, str) else None
    return None if found is None else StreetName(kind=found[1], seed=int(found[2]))


def find_default_split(scene: str) -> str:
    """Return the split of a street's clips where a grid has several scenes and names no splits.

    It follows from the seed alone, so that a street stays in its split whatever other streets a dataset has.

    Parameters
    ----------
    scene : its name
    """
    street = parse_street_name(scene)
    last = None if street is None else street.seed % 10
    return "val" if last in _VALIDATED else "test" if last in _TESTED else "train"


def read_scene_setting(value: Any) -> Any:
    """Return the name of the scene that a grid asks for as ``{street: {kind: town, seed: 7}}``; else the value itself.

    Parameters
    ----------
    value : as written in the grid

    Raises
    ------
    ValueError
        If it is a table of another form.
    """
    if not isinstance(value, dict):
        return value
    names = _list_streets(value, "street")
    if len(names) != 1:
        raise ValueError(f"must be one street; kind and seed name {len(names)}")
    return names[0]


def read_scene_levels(value: Any) -> Any:
    """Return the levels of an axis that is written as ``{streets: {kind: [...], seed: [...]}}``; else the value itself.

    Every kind is taken with every seed, and each level has the name of its street.

    Parameters
    ----------
    value : as written in the grid

    Raises
    ------
    ValueError
        If the table has another form.
    """
    if not isinstance(value, dict) or set(value) != {"streets"} or "kind" not in (value["streets"] or {}):
        return value
    return {name: {"scene": name} for name in _list_streets(value, "streets")}


SceneName = Annotated[str, Field(min_length=1, max_length=4096), BeforeValidator(read_scene_setting)]
"""A scene as a grid names it: a name, a folder, or a street by kind and seed."""


def _list_streets(table: dict[Any, Any], key: str) -> list[str]:
    streets = table.get(key)
    if set(table) != {key} or not isinstance(streets, dict) or set(streets) != {"kind", "seed"}:
        raise ValueError(f"must be {{{key}: {{kind: ..., seed: ...}}}}; it is {shorten_value(table)}")
    kinds = streets["kind"] if isinstance(streets["kind"], list) else [streets["kind"]]
    if wrong := [kind for kind in kinds if kind not in KINDS]:
        raise ValueError(f"kind must be of {', '.join(KINDS)}; it is {shorten_value(wrong[0])}")
    seeds = streets["seed"]
    if isinstance(seeds, dict) and set(seeds) == {"min", "max"} and all(map(_is_seed, seeds.values())):
        if seeds["max"] - seeds["min"] >= MOST_STREETS:
            raise ValueError(f"seed must name at most {MOST_STREETS:,} streets; it names more")
        seeds = list(range(seeds["min"], seeds["max"] + 1))
    seeds = seeds if isinstance(seeds, list) else [seeds]
    if not seeds or not all(map(_is_seed, seeds)):
        raise ValueError(
            f"seed must be whole numbers from 0 to {HIGHEST_SEED}: one, a list, or min and max that ascend; it is"
            f" {shorten_value(streets['seed'])}"
        )
    return [str(StreetName(kind=kind, seed=seed)) for kind in kinds for seed in seeds]


def _is_seed(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= HIGHEST_SEED
