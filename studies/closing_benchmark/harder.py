"""Harder campaigns for close-loop than one effect on a rich design: two effects at once, and too few manoeuvres."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from catalogs.names import WeatherName
from catalogs.quantities import CatalogueEntry, Number
from studies.closing_benchmark.synthetic import TRAINING
from studies.closing_benchmark.truths import Truth
from studies.plans import load_plan
from tasks.campaign.planned_runs import RunPlan
from tasks.surface.weather import DRY

Positive = Annotated[float, Field(strict=True, gt=0)]


class DriveEntry(CatalogueEntry):
    """One planned run; the meanings are given by ``RunPlan``."""

    weather: WeatherName = DRY
    rate: Annotated[float, Field(strict=True, ge=0)] = 0.0
    speed: Positive
    peak: Number
    duration: Positive


class ClosingStudy(CatalogueEntry):
    """Which truths come in pairs, and the poor design.

    Parameters
    ----------
    partner_after : how far after a truth its partner stands [1]
    poor_design : the runs; the first `TRAINING` of them train
    """

    partner_after: Annotated[int, Field(strict=True, ge=1)]
    poor_design: Annotated[tuple[DriveEntry, ...], Field(min_length=TRAINING + 3)]

    def drives(self) -> tuple[RunPlan, ...]:
        """The poor design as planned runs."""
        return tuple(RunPlan(**entry.model_dump()) for entry in self.poor_design)

    def pairs(self, truths: tuple[Truth, ...]) -> tuple[tuple[Truth, Truth], ...]:
        """Each truth with its partner; a pair comes once.

        Parameters
        ----------
        truths : library effects at their sizes
        """
        count = len(truths)
        chosen = {frozenset((j, (j + self.partner_after) % count)): None for j in range(count)}
        return tuple((truths[min(pair)], truths[max(pair)]) for pair in chosen if len(pair) == 2)


def load_harder() -> ClosingStudy:
    """Return the pairs and the poor design of `harder.yaml`."""
    study: ClosingStudy = load_plan(ClosingStudy, Path(__file__).parent, "harder", "closing study")
    return study
