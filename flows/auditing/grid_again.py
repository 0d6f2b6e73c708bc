"""Do the clips of a dataset follow from the grid that it records? The grid is laid out again, nothing is driven."""

from collections.abc import Iterator, Mapping
from itertools import islice, permutations, product

from catalogs.grids import GridFile
from catalogs.grids.blocks import count_combinations, list_combinations
from catalogs.grids.form import MOST_CLIPS
from catalogs.grids.selection import CALIBRATION, facts_of
from catalogs.scenario import Scenario
from catalogs.street_names import find_default_split
from flows.making.plan import ClipPlan, Plan, derive_seed, name_clip
from manifests.explain import format_value

MOST_ORDERS = 720
"""Orders of blocks that are tried [1]: those of six axes."""


def find_grid_contradictions(plan: Plan, is_same_writer: bool) -> list[str]:
    """Return where the recorded clips are not those that the recorded grid asks for, a sentence each.

    A record sorts its keys, so that it does not say in which order the axes overrule each other: the order is one in
    which the labels can have been made. What a grid excludes may be absent, and nothing else.

    Parameters
    ----------
    plan : of the dataset, with the settings and the clips that it records
    is_same_writer : whether the code made the dataset; another version may have another calibrated range
    """
    least: list[str] | None = None
    for settings in islice(_order_blocks(plan.settings), MOST_ORDERS):
        found = _compare_clips(settings, plan, is_same_writer)
        if least is None or len(found) < len(least):
            least = found
        if not found:
            break
    return least or []


def _order_blocks(settings: GridFile) -> Iterator[GridFile]:
    """Yield the settings in each order of axes and of drawn ranges; axes in step become axes like the others."""
    cube = settings.latin_hypercube
    orders = product(
        permutations(settings.axes), permutations(settings.zip), permutations(cube.ranges if cube else ())
    )
    for axes, steps, ranges in orders:
        blocks = {name: settings.axes[name] for name in axes}
        # an axis in step can have the name of another axis
        blocks |= {f"{name} in step": settings.zip[name] for name in steps}
        drawn = cube and cube.model_copy(update={"ranges": {name: cube.ranges[name] for name in ranges}})
        yield settings.model_copy(update={"axes": blocks, "zip": {}, "latin_hypercube": drawn})


def _compare_clips(settings: GridFile, plan: Plan, is_same_writer: bool) -> list[str]:
    if count_combinations(settings) > MOST_CLIPS:
        return []
    combinations = list_combinations(settings, settings.base, settings.scene)
    asked = {label: Scenario(**fields) for label, fields in combinations}
    seeds = range(settings.seed, settings.seed + settings.visual_seeds)
    wanted = {
        name_clip(label, seed, len(seeds)): (scenario, seed)
        for label, scenario in asked.items()
        for seed in seeds
    }
    labels = {clip.label for clip in plan.clips}
    found = [
        f"manifest.json: clip {clip.index} must have a label of its grid; it has {format_value(clip.label)}"
        for clip in plan.clips
        if clip.label not in wanted
    ]
    found += [
        f"manifest.json: clip {label} is absent, for which its grid asks"
        for label, (scenario, _) in wanted.items()
        if label not in labels and not plan.settings.zip and not _is_excluded(settings, scenario)
    ]
    for clip in plan.clips:
        if clip.label in wanted:
            found += _compare_clip(clip, *wanted[clip.label], settings, is_same_writer)
    return found


def _is_excluded(settings: GridFile, scenario: Scenario) -> bool:
    return any(condition.holds(facts_of(scenario)) for condition in settings.exclude)


def _compare_clip(
    clip: ClipPlan, scenario: Scenario, seed: int, settings: GridFile, is_same_writer: bool
) -> Iterator[str]:
    facts = facts_of(scenario)
    default = "" if scenario.scene is None else find_default_split(scenario.scene)
    splits = {name for name, condition in settings.splits.items() if condition.holds(facts)} or {default}
    asked: Mapping[str, object] = {
        **scenario.as_record(),
        "seed": derive_seed(seed, scenario.as_row()),
        "calibration": facts[CALIBRATION] if is_same_writer else clip.calibration,
        "split": clip.split if clip.split in splits else min(splits),
    }
    found = {
        **clip.scenario.as_record(),
        "seed": clip.seed,
        "calibration": clip.calibration,
        "split": clip.split,
    }
    for name, value in asked.items():
        if found.get(name) != value:
            yield (
                f"manifest.json: {name} of clip {clip.label} must be {format_value(value)}, by its grid; it is"
                f" {format_value(found.get(name))}"
            )
