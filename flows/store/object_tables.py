"""The table of a clip's road users: a row a frame and road user, in a Parquet file of its own."""

from collections.abc import Mapping
from typing import Any

import pyarrow as pa
from numpy.typing import NDArray

from flows.store.layout import Layout
from flows.store.links import require_file
from flows.store.telemetry import columns_hash, labelled_table, read_table, table_columns
from tasks.conventions import OBJECT_CHANNELS

MOST_OBJECTS = 65_535
"""Road users of a clip [1]: an instance has 16 bits."""
NAMES = ("frame", *(channel.name for channel in OBJECT_CHANNELS))
_HASHED = tuple(name for name in NAMES if name != "kind")
_LISTS = {
    "size": 3, "centre_world": 3, "rotation_world": 4, "centre_rig": 3, "rotation_rig": 4, "velocity_world": 3,
    "velocity_rig": 3,
}  # fmt: skip


def make_object_table(columns: Mapping[str, NDArray[Any]], identity: Mapping[str, str]) -> pa.Table:
    """Return the table of a clip.

    Parameters
    ----------
    columns : `NAMES`, as `tasks.render.object_truth.measure_objects` gives them; without any, it has no rows
    identity : clip_id, label and weather
    """
    return labelled_table(columns or {name: pa.array([], _choose_type(name)) for name in NAMES}, identity)


def hash_objects(columns: Mapping[str, NDArray[Any]]) -> str:
    """Return the hash of a clip's rows, whose kinds are the scenario's; without rows that of none."""
    rows = len(columns["frame"]) if columns else 0
    return columns_hash(columns, _HASHED) if rows else columns_hash({}, ())


def read_objects(layout: Layout, index: int, frames: int) -> dict[str, NDArray[Any]]:
    """Return the columns of a clip's table.

    Parameters
    ----------
    layout : of the dataset
    index : of the clip
    frames : of each clip [1]

    Raises
    ------
    InputError
        If the file is missing, or is no table as muSync writes it.
    """
    path = require_file(layout.object_table(index))
    return table_columns(read_table(path, required=NAMES, most=frames * MOST_OBJECTS))


def _choose_type(name: str) -> pa.DataType:
    if name in _LISTS:
        return pa.list_(pa.float64(), _LISTS[name])
    if name == "kind":
        return pa.string()
    return pa.int64() if name in {"frame", "object", "visible_pixels"} else pa.float64()


def read_no_objects() -> pa.Table:
    """Return the table of a dataset without road users."""
    return make_object_table({}, dict.fromkeys(("clip_id", "label", "weather"), ""))
