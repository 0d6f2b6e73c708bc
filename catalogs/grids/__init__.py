"""Scenario grids: a YAML file of blocks whose product is a list of scenarios."""

from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import Field, ValidationError

from catalogs.grids.blocks import Blocks, PartialScenario, combinations
from catalogs.grids.selection import CALIBRATION, Condition, facts_of, split_of
from catalogs.scenario import Scenario, scenario_problems
from tasks.errors import InputError

GRID_FOLDER = Path(__file__).parent


class GridFile(Blocks):
    """A grid as written in YAML."""

    name: str = Field(min_length=1)
    scene: str = "street"
    vehicle: str = "paper-reference"
    surface: str = "dense-asphalt"
    camera: str = "dashcam-480x320"
    hazard_marking: str | None = Field(
        default=None, description="Paint on raised road features; without an entry they are left bare."
    )
    vehicle_mode: Literal["paper", "coupled"] = "paper"
    frames: int = Field(default=81, ge=2)
    frame_rate_hz: float = Field(default=10.0, gt=0, le=1000)
    seed: int = Field(default=2025, ge=0, lt=2**53)
    visual_seeds: int = Field(
        default=1, ge=1, le=1000, description="Clips of each scenario, with visual seeds from seed upward."
    )
    composition: Literal["linear", "paper"] = Field(
        default="linear",
        description="linear adds up light; paper adds drops and flakes as 8-bit differences (Appendix A.4).",
    )
    labels: bool = False
    pictures: bool = True
    base: PartialScenario = PartialScenario()
    exclude: list[Condition] = Field(
        default=[], description="Combinations to leave out: those that keep any of these."
    )
    splits: dict[str, Condition] = Field(
        default={}, description="Name to condition; a clip belongs to the first that it keeps."
    )


@dataclass(frozen=True, kw_only=True)
class Grid:
    """A validated grid: what all clips share, and the labelled scenarios in order.

    Parameters
    ----------
    settings : what all clips share
    scenarios : labelled, in order
    tags : of each, its split (empty without splits) and its place in the calibrated range
    left_out : combinations that ``exclude`` took out [1]
    """

    settings: GridFile
    scenarios: tuple[tuple[str, Scenario], ...]
    tags: tuple[tuple[str, str], ...]
    left_out: int = 0


class FaultyGrid(InputError):
    """A grid that breaks rules.

    Parameters
    ----------
    problems : one sentence each
    settings : what could be read all the same, so that the entries it names can be checked too; None if nothing
    """

    def __init__(self, problems: list[str], settings: GridFile | None):
        super().__init__(problems)
        self.settings = settings


def grid_names() -> list[str]:
    """Names of the grids that ship with the project."""
    return sorted(path.stem for path in GRID_FOLDER.glob("*.yaml"))


def load_grid(source: str | Path) -> Grid:
    """Read and check a grid by catalogue name or file.

    Raises
    ------
    InputError
        The file cannot be read.
    FaultyGrid
        Listing every problem of the file at once.
    """
    path = Path(source)
    if path.suffix not in {".yaml", ".yml"}:
        path = GRID_FOLDER / f"{source}.yaml"
    if not path.is_file():
        raise InputError(f"{source}: no such grid; give a YAML file or one of: {', '.join(grid_names())}")
    try:
        content = yaml.safe_load(path.read_text())
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: a grid must be valid YAML; {' '.join(str(error).split())}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: a grid must be a YAML mapping; it is {type(content).__name__}")
    settings, problems = _settings(content, path)
    try:
        grid = expand_grid(settings, str(path)) if settings else None
    except InputError as error:
        problems += error.problems
    if problems or grid is None:
        raise FaultyGrid(problems, settings)
    return grid


def _settings(content: dict[str, Any], path: Path) -> tuple[GridFile | None, list[str]]:
    """The settings, and what is wrong with their form; what is wrong is left out, so that the rest is checked."""
    try:
        return GridFile.model_validate(content), []
    except ValidationError as error:
        problems = [_sentence(path, problem) for problem in error.errors()]
        kept = deepcopy(content)
        for problem in error.errors():
            _leave_out(kept, problem["loc"])
    try:
        return GridFile.model_validate(kept), problems
    except ValidationError:
        return None, problems


def _leave_out(content: Any, place: tuple[int | str, ...]) -> None:
    """Take out the key at fault, or the whole level of an axis, so that nothing follows from its absence."""
    if len(place) == 1:
        content.pop(place[0], None)
    elif place[0] == "axes" and len(place) > 2:
        content["axes"][place[1]].pop(place[2], None)


def expand_grid(settings: GridFile, place: str) -> Grid:
    """The product of the blocks, later ones over earlier ones over ``base``, less what is excluded, each checked."""
    base = settings.base.model_dump(exclude_none=True)
    problems: dict[str, list[str]] = {}
    scenarios, tags, left_out = [], [], 0
    for combination in combinations(settings):
        label = "/".join(level for level, _ in combination)
        merged: dict[str, Any] = dict(base)
        for _, partial in combination:
            merged |= partial
        scenario = Scenario(**merged)
        facts = facts_of(scenario)
        if any(condition.holds(facts) for condition in settings.exclude):
            left_out += 1
            continue
        split = split_of(facts, settings.splits)
        scenarios.append((label, scenario))
        tags.append((split or "", facts[CALIBRATION]))
        found = scenario_problems(scenario)
        if settings.splits and split is None:
            found.append("belongs to no split: end them with one whose condition is {}")
        for problem in found:
            problems.setdefault(problem, []).append(label)
    if not scenarios:
        problems["exclude leaves nothing to make"] = ["all"]
    if problems:
        raise InputError(
            [f"{place}: scenario {_some(labels)}: {problem}" for problem, labels in problems.items()]
        )
    return Grid(settings=settings, scenarios=tuple(scenarios), tags=tuple(tags), left_out=left_out)


def _some(labels: list[str]) -> str:
    return labels[0] if len(labels) == 1 else f"{labels[0]} and {len(labels) - 1} more"


def _sentence(path: Path, problem: Any) -> str:
    place = ".".join(str(part) for part in problem["loc"]) or "the file"
    if problem["type"] == "extra_forbidden":
        known = GridFile.model_fields if len(problem["loc"]) == 1 else PartialScenario.model_fields
        return f"{path}: {place}: unknown key; known here are {', '.join(known)}"
    if problem["type"] == "missing":
        return f"{path}: {place}: this key is required; it is missing"
    if problem["type"] == "value_error":
        return f"{path}: {place}: {problem['msg'].removeprefix('Value error, ')}"
    return f"{path}: {place}: {problem['msg'].removeprefix('Input ').lower()}; it is {problem['input']!r}"
