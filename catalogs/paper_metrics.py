"""The paper's own figures of its video metrics, each with the clips that it is a mean over."""

from functools import cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import TypeAdapter

from catalogs.quantities import Scalar, read_entries, require_quantity

PAPER_METRICS = Path(__file__).with_name("paper_metrics.yaml")

ClipSet = Literal["stops", "rain-stops", "snow-stops", "dry-features"]
"""Braking clips on a flat road in every weather, in rain, in snow; dry clips with a road feature."""
FILE = TypeAdapter(dict[str, dict[ClipSet, Annotated[Scalar, require_quantity("1")]]])
"""Content of the file: printed figures by metric and by the clips that they are a mean over."""


@cache
def paper_values() -> dict[str, dict[ClipSet, float]]:
    """Value by metric and set of clips; a metric without a printed value is left out [1]."""
    entries = read_entries(FILE, PAPER_METRICS, "table of printed figures")
    return {metric: {over: one.value for over, one in sets.items()} for metric, sets in entries.items()}
