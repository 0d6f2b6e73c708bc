"""How the end of a stop is kept steady in paper mode: the numbers behind ``low_speed: steady``."""

from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, require_quantity
from tasks.vehicle.paper.low_speed import SteadyStop

LOW_SPEED, LOW_SPEED_CUT = "low_speed.yaml", "no_low_speed_rule.yaml"
"""Names among a dataset's kept inputs; the second where its variant is ``no-low-speed-rule``."""


class LowSpeedEntry(CatalogueEntry):
    """Content of the file; `SteadyStop` gives the meanings."""

    held_share: Annotated[Scalar, require_quantity("1", minimum=0, maximum=1)]
    explicit_limit: Annotated[Scalar, require_quantity("1", above=0, maximum=2)]

    def build(self) -> SteadyStop:
        """The numbers themselves."""
        return SteadyStop(**self.numbers())


class LowSpeedCutEntry(CatalogueEntry):
    """Content of the file that leaves the rule out; ``applied`` is 1 where it holds and 0 where not."""

    applied: Annotated[Scalar, require_quantity("1", minimum=0, maximum=1)]

    def build(self) -> bool:
        """Whether the rule acts."""
        return self.applied.value > 0
