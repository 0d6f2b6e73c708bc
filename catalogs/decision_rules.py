"""The rules by which a verdict is reached."""

from pathlib import Path
from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, read_entry, require_quantity
from tasks.identification.rules import DecisionRules

DECISION_RULES = Path(__file__).with_name("decision_rules.yaml")

Count = Annotated[Scalar, require_quantity("1", minimum=1)]
Share = Annotated[Scalar, require_quantity("1", above=0, below=1)]
Level = Annotated[Scalar, require_quantity("1", above=0)]


class DecisionRulesEntry(CatalogueEntry):
    """Content of the file; the meanings are given by ``DecisionRules``."""

    accept_score: Level
    held_out_gain: Level
    rival_span: Level
    rival_gain_share: Share
    discrepancy_limit: Level
    foreign_inflation: Level
    win_share: Share
    bootstrap_resamples: Count
    refined_candidates: Count
    refined_look_alikes: Count
    look_alike_cosine: Share
    trusted_screen_share: Share
    relinearisation_gain: Level
    reached_share: Share
    most_effects: Count
    explored_candidates: Count
    relinearised_candidates: Count
    relinearisation_change: Share
    retune_pull: Level
    relinearisation_pull: Level
    disagreement: Level
    lone_form_share: Share
    least_expected_d2: Level
    retune_widening: Level
    error_resamples: Count
    worse_limit: Level
    noticed_share: Share
    longest_lag: Annotated[Scalar, require_quantity("s", above=0)]
    profile_points: Count
    profile_tolerance: Share
    forked_misfit: Level
    fewest_runs: Count


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
    counts = {name for name, kind in DecisionRules.__annotations__.items() if kind is int}
    return DecisionRules(
        **{name: int(number.value) if name in counts else number.value for name, number in entry}
    )
