"""Limits of what a recording of a road car can hold."""

from functools import cache
from pathlib import Path
from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, read_entry, require_quantity


class RecordingLimits(CatalogueEntry):
    """The largest deceleration of a road car over a fall of its speed, and the shortest time between samples."""

    deceleration: Annotated[Scalar, require_quantity("m s-2", above=0)]
    sampling_step: Annotated[Scalar, require_quantity("s", above=0)]


@cache
def load_recording_limits() -> RecordingLimits:
    """Return the limits of the catalogue."""
    return read_entry(
        RecordingLimits, Path(__file__).with_name("limits.yaml"), "table of limits of recordings"
    )
