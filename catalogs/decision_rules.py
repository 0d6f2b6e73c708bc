"""The rules by which a verdict is reached."""

from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, require_quantity
from tasks.identification.rules import DecisionRules

Count = Annotated[Scalar, require_quantity("1", minimum=1)]
Share = Annotated[Scalar, require_quantity("1", above=0, below=1)]
Level = Annotated[Scalar, require_quantity("1", above=0)]


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
    foreign_misfit: Level
    hardly_known_tolerance: Level
    command_tolerance: Level
    hardly_known_grip: Level
    driven_acceleration: Annotated[Scalar, require_quantity("m s-2", above=0)]
    brake_onset_share: Share
    closed_throttle: Share
    saturation_ratio: Level
    limited_time: Annotated[Scalar, require_quantity("s", above=0)]

    def build(self) -> DecisionRules:
        """Return the rules; counts are integers."""
        counts = {name for name, kind in DecisionRules.__annotations__.items() if kind is int}
        return DecisionRules(
            **{name: int(value) if name in counts else value for name, value in self.numbers().items()}
        )
