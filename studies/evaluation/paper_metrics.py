"""The paper's own figures of its video metrics, each with the clips that it is a mean over."""

from functools import cache
from pathlib import Path
from typing import Annotated, Literal

from catalogs.quantities import CatalogueList, Scalar, require_quantity
from studies.plans import load_plan

ClipSet = Literal["stops", "rain-stops", "snow-stops", "dry-features"]
"""Braking clips on a flat road in every weather, in rain, in snow; dry clips with a road feature."""


class MetricFile(CatalogueList[dict[str, dict[ClipSet, Annotated[Scalar, require_quantity("1")]]]]):
    """Content of the file: printed figures by metric and by the clips that they are a mean over."""

    def build(self) -> dict[str, dict[ClipSet, float]]:
        """Return value by metric and set of clips; a metric without a printed value is left out [1]."""
        return {metric: {over: one.value for over, one in sets.items()} for metric, sets in self.root.items()}


@cache
def load_printed_figures() -> dict[str, dict[ClipSet, float]]:
    """Return the figures of `paper_metrics.yaml`."""
    figures: dict[str, dict[ClipSet, float]] = load_plan(
        MetricFile, Path(__file__).parent, "paper_metrics", "table of printed figures"
    )
    return figures
