"""The SQL views of a dataset and their columns; a column that a dataset's tables do not have is NULL there."""

import pyarrow as pa

from flows.store.telemetry import labelled_field
from tasks.conventions import (
    CHANNELS_BY_NAME,
    CHECK_CHANNELS,
    CLIP_CHANNELS,
    ESSENTIAL,
    FRAME_CHANNELS,
    IDENTITY_CHANNELS,
    OBJECT_CHANNELS,
    PAIR_CHANNELS,
    TICK_CHANNELS,
    Channel,
)

_JOIN_KEYS = tuple(c for c in IDENTITY_CHANNELS if c.name in {"clip_id", "label", "weather"})
_SURFACE = tuple(c for c in CLIP_CHANNELS if c.name in {
    "film_depth_mm", "snow_depth_mm", "snow_coverage", "surface_friction", "tyre_peak",
})  # fmt: skip
VIEWS: dict[str, tuple[Channel, ...]] = {
    "clips": (*IDENTITY_CHANNELS, *CLIP_CHANNELS, *CHECK_CHANNELS),
    "ticks": (*_JOIN_KEYS, *TICK_CHANNELS),
    "frames": (*_JOIN_KEYS, *_SURFACE, *FRAME_CHANNELS, *TICK_CHANNELS),
    "verdicts": (*_JOIN_KEYS, *CHECK_CHANNELS),
    "pairs": PAIR_CHANNELS,
    "objects": (*_JOIN_KEYS, CHANNELS_BY_NAME["frame"], *OBJECT_CHANNELS),
}
"""The views and their columns; ``ticks`` and ``frames`` also have ``family``, by which their files lie."""


def list_absent(table: str, schema: pa.Schema) -> list[pa.Field]:
    """Return the columns that a stored table of an older dataset does not have: its values are not represented.

    Parameters
    ----------
    table : clips, ticks, frames or pairs
    schema : of its files
    """
    there = {name.casefold() for name in schema.names}
    return [
        labelled_field(channel.name, pa.float64() if channel.unit else pa.string())
        for channel in VIEWS[table]
        if channel.name not in there and channel.name not in ESSENTIAL
    ]
