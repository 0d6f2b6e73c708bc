"""Scenario grids: a YAML file of blocks whose product is a list of scenarios."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from catalogs.documents import parse_yaml
from catalogs.grids.blocks import fields_set_by, list_combinations
from catalogs.grids.faults import read_form
from catalogs.grids.form import GridFile
from catalogs.grids.selection import CALIBRATION, facts_of, split_of
from catalogs.scenario import UNKNOWN_WEATHER, Scenario, find_range_problems, find_scenario_problems
from catalogs.sentences import cap_problems, name_some, shorten
from catalogs.street_names import find_default_split
from tasks.errors import InputError

__all__ = ["FaultyGrid", "Grid", "GridFile", "build_grid", "expand_grid", "warn_of_late_brakes"]

LONGEST_LABEL = 200
"""Bytes of a label [1]: with a suffix it is still a file name, of 255 bytes at most."""


@dataclass(frozen=True, kw_only=True)
class Grid:
    """A validated grid: what all clips share, and the labelled scenarios in order.

    Parameters
    ----------
    settings : what all clips share
    scenarios : labelled, in order
    tags : of each, its split (empty without splits) and its place in the calibrated range
    left_out : combinations that ``exclude`` took out [1]
    idle : places of the conditions of ``exclude`` that took out none
    poses : folder of reference traces whose motion the clips show in place of the vehicle's; None for the vehicle
    driven : files of a policy's drive by their name under ``inputs/``; none where the scenarios brake
    """

    settings: GridFile
    scenarios: tuple[tuple[str, Scenario], ...]
    tags: tuple[tuple[str, str], ...]
    left_out: int = 0
    idle: tuple[int, ...] = ()
    poses: Path | None = None
    driven: Mapping[str, bytes] = field(default_factory=dict)


class FaultyGrid(InputError):
    """A grid that breaks rules.

    Parameters
    ----------
    problems : one sentence each
    grid : what could be read all the same, so that its entries and its route can be checked too; None if nothing
    """

    def __init__(self, problems: Sequence[str], grid: Grid | None):
        super().__init__(problems)
        self.grid = grid


def build_grid(content: bytes, path: Path) -> Grid:
    """Return the grid that a file holds, checked.

    Parameters
    ----------
    content, path : of the file

    Raises
    ------
    InputError
        The file is no YAML.
    FaultyGrid
        Listing every problem of the file at once.
    """
    form = read_form(parse_yaml(content, path, "grid", finite=False), path)
    problems = cap_problems(form.problems)
    grid = None if form.settings is None else Grid(settings=form.settings, scenarios=(), tags=())
    if form.settings is not None and form.is_expandable:
        try:
            grid = expand_grid(form.settings, str(path))
        except FaultyGrid as faults:
            problems += faults.problems
            grid = faults.grid
        problems += _find_impossible_conditions(form.settings, path)
        if grid is not None and not problems:
            problems = cap_problems(_find_idle_conditions(grid, path))
    if problems or grid is None:
        raise FaultyGrid(problems, grid)
    return grid


def expand_grid(settings: GridFile, origin: str) -> Grid:
    """The product of the blocks, later ones over earlier ones over ``base``, less what is excluded, each checked."""
    # a value that every level overrides is checked too: it is in the file
    in_base = find_range_problems(Scenario(**fields_set_by(settings.base)))
    problems: dict[str, list[str]] = {problem: ["base"] for problem in in_base}
    scenarios, tags, left_out = [], [], 0
    labels: set[str] = set()
    idle = set(range(len(settings.exclude)))
    for label, fields in list_combinations(settings, settings.base, settings.scene):
        scenario = Scenario(**fields)
        unknown = [name for name, value in fields.items() if value != value or value == UNKNOWN_WEATHER]
        facts = facts_of(scenario)
        met = {number for number, condition in enumerate(settings.exclude) if condition.holds(facts)}
        idle -= met
        if met:
            left_out += 1
            continue
        split = split_of(facts, settings.splits)
        if not settings.splits and scenario.scene is not None:
            split = find_default_split(scenario.scene)
        scenarios.append((label, scenario))
        tags.append((split or "", facts[CALIBRATION]))
        # of what cannot be read in full nobody knows whether it is excluded
        found = [] if unknown and settings.exclude else find_scenario_problems(scenario, unknown)
        if settings.splits and split is None and not unknown:
            found.append("belongs to no split: end them with one whose condition is {}")
        if len(label.encode()) > LONGEST_LABEL:
            found.append(f"its label must have at most {LONGEST_LABEL} bytes; it has {len(label.encode())}")
        if label in labels:
            found.append("its label must be its own; another has it too: rename a level")
        labels.add(label)
        for problem in found:
            problems.setdefault(problem, []).append(label)
    if not scenarios:
        problems["exclude leaves nothing to make"] = ["all"]
    grid = Grid(
        settings=settings,
        scenarios=tuple(scenarios),
        tags=tuple(tags),
        left_out=left_out,
        idle=tuple(sorted(idle)),
    )
    if problems:
        sentences = [
            f"{shorten(origin)}: scenario {name_some(named)}: {rule}" for rule, named in problems.items()
        ]
        raise FaultyGrid(cap_problems(sentences), grid)
    return grid


def _find_impossible_conditions(settings: GridFile, origin: Path) -> list[str]:
    """Return a sentence for each value of a condition that its field never has."""
    exclude = {f"exclude.{number}": condition for number, condition in enumerate(settings.exclude)}
    splits = {f"splits.{name}": condition for name, condition in settings.splits.items()}
    return [
        f"{shorten(origin)}: {name}.{problem}"
        for name, condition in (exclude | splits).items()
        for problem in condition.list_impossible()
    ]


def _find_idle_conditions(grid: Grid, origin: Path) -> list[str]:
    """Return a sentence for each split without a clip, and each condition of ``exclude`` that nothing meets.

    Such a number is mistyped. Where values are drawn, the draw may leave a condition without a clip. The grid of a
    frozen manifest is not asked: it makes what it made.
    """
    filled = {split for split, _ in grid.tags}
    problems = [
        f"{shorten(origin)}: splits.{split}: gets no clip; correct its condition or those before it, or remove it"
        for split in grid.settings.splits
        if split not in filled
    ]
    if grid.settings.latin_hypercube is None:
        problems += [
            f"{shorten(origin)}: exclude.{number}: leaves nothing out; correct its condition or remove it"
            for number in grid.idle
        ]
    return problems


def warn_of_late_brakes(grid: Grid) -> str | None:
    """Return a sentence that names the scenarios whose brake comes after the telemetry's end; None without any.

    It is no fault: who tries a grid with a few frames wants it too.

    Parameters
    ----------
    grid : a validated grid
    """
    end = grid.settings.telemetry_s
    late = {
        label: scenario.brake_onset_s
        for label, scenario in grid.scenarios
        if scenario.peak_pressure_mpa > 0 and scenario.brake_onset_s is not None
        and scenario.brake_onset_s >= end
    }  # fmt: skip
    if not late:
        return None
    return (
        f"scenario {name_some(list(late))} does not brake: brake_onset_s is {min(late.values()):g} s or later, and the"
        f" telemetry ends at {end:g} s: make duration_s longer"
    )
