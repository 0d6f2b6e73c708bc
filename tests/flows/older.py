"""A dataset as an earlier version of muSync left it: NaN where a value is not represented, and fewer columns."""

import shutil
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from flows.making.identity import identify_run, list_deciding
from flows.making.plan import Plan
from flows.store.layout import Layout
from flows.store.telemetry import content_hash, read_columns, write_parquet
from manifests.canonical import sha256_of_file
from tests.flows.reseal import reseal

Columns = dict[str, np.ndarray]


def make_older(
    dataset: Layout,
    copy: Path,
    lacking: Collection[str] = (),
    change: Callable[[Columns], object] | None = None,
) -> Layout:
    """Copy a dataset with NaN for NULL and without some columns, in its tables and in its records.

    ``change`` alters the columns of the first file of ticks, as a forger does who records what follows from it.
    """
    shutil.copytree(dataset.root, copy)
    older = Layout(copy)
    for path in sorted(older.telemetry.rglob("*.parquet")):
        table = pq.read_table(path, partitioning=None)
        columns = {name: put_nan(table[name]) for name in table.column_names if name not in lacking}
        if change is not None and "ticks" in path.parts:
            numbers = {name: np.array(column) for name, column in columns.items() if column.type == "double"}
            change(numbers)
            columns |= {name: pa.array(values) for name, values in numbers.items()}
            change = None
        schema = pa.schema([table.schema.field(name) for name in columns])
        write_parquet(pa.Table.from_arrays(list(columns.values()), schema=schema), path)

    def forget(manifest: dict[str, Any]) -> None:
        manifest["made_with"]["code"] = {"version": "0.0.1", "source_sha256": "0" * 64}
        plan = Plan.of(manifest, older.manifest)
        ids = [clip.clip_id for clip in plan.clips]
        deciding = list_deciding(plan.settings, plan.scene, plan.inputs, plan.backend)
        manifest["run_id"] = identify_run(deciding, manifest["grid"], ids, manifest["made_with"])
        plan = replace(plan, run_id=manifest["run_id"])
        older.plan.write_bytes(b"".join(plan.file_pieces()))
        manifest["artifacts"]["plan.json"] = sha256_of_file(older.plan)
        for clip in manifest["clips"]:
            for record, prefix in (("figures", ""), ("verdict", "check_")):
                clip[record] = {k: v for k, v in clip[record].items() if f"{prefix}{k}" not in lacking}
            for table in ("ticks", "frames"):
                held = read_columns(older.telemetry / table, clip["clip_id"], most=100_000, exact=False)
                clip["content"][table] = content_hash(table, held)

    reseal(older, forget)
    return older


def put_nan(column: pa.ChunkedArray) -> pa.Array:
    """Return a column with NaN where a float is NULL."""
    whole = column.combine_chunks()
    return pa.array(np.array(whole.to_numpy(zero_copy_only=False))) if whole.type == "double" else whole
