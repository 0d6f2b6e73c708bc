"""A dataset as an earlier version of muSync left it: NaN where a value is not represented, and fewer columns."""

import shutil
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from flows.store.layout import Layout
from flows.store.telemetry import content_hash, read_columns, write_parquet
from tests.flows.reseal import reseal


def make_older(dataset: Layout, copy: Path, lacking: Collection[str] = ()) -> Layout:
    """Copy a dataset with NaN for NULL and without some columns, in its tables and in its records."""
    shutil.copytree(dataset.root, copy)
    older = Layout(copy)
    for path in older.telemetry.rglob("*.parquet"):
        table = pq.read_table(path, partitioning=None)
        names = [name for name in table.column_names if name not in lacking]
        schema = pa.schema([table.schema.field(name) for name in names])
        write_parquet(pa.Table.from_arrays([put_nan(table[name]) for name in names], schema=schema), path)

    def forget(manifest: dict[str, Any]) -> None:
        for clip in manifest["clips"]:
            for record, prefix in (("figures", ""), ("verdict", "check_")):
                clip[record] = {k: v for k, v in clip[record].items() if f"{prefix}{k}" not in lacking}
            for table in ("ticks", "frames"):
                columns = read_columns(older.telemetry / table, clip["clip_id"])
                clip["content"][table] = content_hash(table, columns)

    reseal(older, forget)
    return older


def put_nan(column: pa.ChunkedArray) -> pa.Array:
    """Fill the NULLs of a column of floats with NaN."""
    column = column.combine_chunks()
    return (
        pa.array(np.array(column.to_numpy(zero_copy_only=False)))
        if pa.types.is_floating(column.type)
        else column
    )
