"""The rules by which a verdict is reached."""

from pathlib import Path
from typing import Annotated, Any

from catalogs.quantities import CatalogueEntry, Scalar, read_entry, require_quantity
from tasks.identification.rules import DecisionRules, JointRules

DECISION_RULES = Path(__file__).with_name("decision_rules.yaml")

Count = Annotated[Scalar, require_quantity("1", minimum=1)]
Share = Annotated[Scalar, require_quantity("1", above=0, below=1)]
Level = Annotated[Scalar, require_quantity("1", above=0)]


class JointRulesEntry(CatalogueEntry):
    """Rules of the joint fit; the meanings are given by ``JointRules``."""

    unknown_gain_tolerance: Level
    fewest_runs: Count
    foreign_misfit: Level
    missed_share: Share
    noticed_share: Share
    driven_acceleration: Annotated[Scalar, require_quantity("m s-2", above=0)]
    brake_onset_share: Share
    braking_deceleration: Annotated[Scalar, require_quantity("m s-2", above=0)]
    fewest_curve_stops: Count
    saturation_ratio: Level
    limited_time: Annotated[Scalar, require_quantity("s", above=0)]
    least_pressure_range: Annotated[Scalar, require_quantity("MPa", above=0)]
    least_disc_range: Annotated[Scalar, require_quantity("K", above=0)]
    delay_interval: Annotated[Scalar, require_quantity("s", above=0)]
    coasted_share: Share
    closed_throttle: Share
    false_name_chance: Share
    fewest_scatter_runs: Annotated[Scalar, require_quantity("1", minimum=2)]
    most_residual_correlation: Share
    longest_memory: Annotated[Scalar, require_quantity("s", above=0)]
    better_prediction_share: Level
    equal_prediction_share: Level
    same_fit_errors: Level
    wrong_number_tolerances: Level
    rival_gain_share: Share
    worse_limit: Level


class DecisionRulesEntry(CatalogueEntry):
    """Content of the file; the meanings are given by ``DecisionRules``."""

    named_odds: Level
    slab_width: Level
    spike_width: Share
    signature_error: Share
    foreign_disagreement: Level
    form_width: Level
    form_odds: Level
    most_effects: Count
    beam_width: Count
    most_turns: Count
    most_compared: Count
    discrepancy_limit: Level
    relinearisation_pull: Level
    least_expected_d2: Level
    retune_widening: Level
    error_resamples: Count
    longest_lag: Annotated[Scalar, require_quantity("s", above=0)]
    step_misfit: Level
    fewest_runs: Count
    joint: JointRulesEntry


def load_decision_rules(path: str | Path = DECISION_RULES) -> DecisionRules:
    """Read decision rules; by default those of the catalogue.

    Parameters
    ----------
    path : YAML file

    Raises
    ------
    InputError
        Listing every rule the file breaks.
    """
    entry = read_entry(DecisionRulesEntry, Path(path), "set of decision rules")
    joint = JointRules(**_plain_values(entry.joint, JointRules))
    return DecisionRules(joint=joint, **_plain_values(entry, DecisionRules))


def _plain_values(entry: CatalogueEntry, rules: type) -> dict[str, Any]:
    """Return the numbers of an entry by name, counts as integers."""
    counts = {name for name, kind in rules.__annotations__.items() if kind is int}
    return {
        name: int(number.value) if name in counts else number.value
        for name, number in entry
        if isinstance(number, Scalar)
    }
