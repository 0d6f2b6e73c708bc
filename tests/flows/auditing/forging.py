"""How a forger changes a file of a dataset, or a record and what follows from it."""

import json
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from flows.making.plan import Plan
from flows.making.summaries import summarise_clips
from flows.store.layout import Layout
from flows.store.sealed import read_manifest
from flows.store.telemetry import columns_hash, read_columns, write_parquet, write_tables
from manifests.canonical import sha256_of_file
from tasks.conventions import TICK_CHANNELS
from tests.flows.reseal import reseal

TICKS, FRAMES = (f"telemetry/{table}/family=dry/part-0000.parquet" for table in ("ticks", "frames"))
CLIPS, PAIRS, SHEET = "telemetry/clips.parquet", "telemetry/pairs.parquet", "previews/contact_sheet.png"
Forge = Callable[[Layout], object]


def change_table(path: str, change: Callable[[pa.Table], pa.Table]) -> Forge:
    """Write a table anew with our writer."""
    return lambda layout: write_parquet(change(read_stored(layout, path)), layout.root / path)


def write_otherwise(path: str, **options: Any) -> Forge:
    """Write the values and labels of a table with other options of the writer."""
    return lambda layout: pq.write_table(read_stored(layout, path), layout.root / path, **options)


def read_stored(layout: Layout, path: str) -> pa.Table:
    return pq.read_table(layout.root / path, partitioning=None)


def change_labels(path: str, column: str, **labels: str) -> Forge:
    def change(table: pa.Table) -> pa.Table:
        place = table.column_names.index(column)
        field = table.schema.field(place)
        kept = {key.decode(): text.decode() for key, text in field.metadata.items() if b"PARQUET" not in key}
        return table.set_column(place, field.with_metadata(kept | labels), table[column])

    return change_table(path, change)


def change_values(path: str, column: str, change: Callable[[np.ndarray], Any]) -> Forge:
    def whole(table: pa.Table) -> pa.Table:
        place = table.column_names.index(column)
        changed = pa.array(change(np.array(table[column])))
        field = table.schema.field(place).with_type(changed.type)
        return table.set_column(place, field, changed)

    return change_table(path, whole)


def name_rows(path: str, column: str, value: str) -> Forge:
    def whole(table: pa.Table) -> pa.Table:
        place = table.column_names.index(column)
        words = pa.array([value] * len(table)).dictionary_encode()
        return table.set_column(place, table.schema.field(place), words)

    return change_table(path, whole)


def exchange(column: str) -> Callable[[pa.Table], pa.Table]:
    """Give the rows of each of two clips the word of the other."""

    def change(table: pa.Table) -> pa.Table:
        place, words = table.column_names.index(column), table[column].to_pylist()
        swap = dict(zip(dict.fromkeys(words), reversed(dict.fromkeys(words)), strict=True))
        found = pa.array([swap[word] for word in words]).dictionary_encode()
        return table.set_column(place, table.schema.field(place), found)

    return change


def forge_footer(path: str, column: str, least: float) -> Forge:
    """Overwrite the largest value of a column in the footer alone."""

    def forge(layout: Layout) -> None:
        file = layout.root / path
        metadata = pq.read_metadata(file)
        place = metadata.schema.names.index(column)
        said = struct.pack("<d", metadata.row_group(0).column(place).statistics.max)
        content = file.read_bytes()
        footer = len(content) - 8 - struct.unpack("<I", content[-8:-4])[0]
        file.write_bytes(content[:footer] + content[footer:].replace(said, struct.pack("<d", least)))

    return forge


def change_json(path: str, change: Callable[[Any], object], indent: int | None = 2) -> Forge:
    def forge(layout: Layout) -> None:
        value = json.loads((layout.root / path).read_text())
        change(value)
        (layout.root / path).write_text(json.dumps(value, indent=indent))

    return forge


def change_attributes(path: str, **attributes: Any) -> Forge:
    """Change attributes of an array or the group, and the group's copies with them."""

    def forge(layout: Layout) -> None:
        change_json(path, lambda value: value["attributes"].update(attributes))(layout)
        name = path.split("/")[1]
        if name != "zarr.json":
            copies = lambda value: value["consolidated_metadata"]["metadata"][name]["attributes"]  # noqa: E731
            change_json("frames.zarr/zarr.json", lambda value: copies(value).update(attributes))(layout)

    return forge


def add_file(path: str, *, recorded: bool) -> Forge:
    def forge(layout: Layout) -> None:
        (layout.root / path).write_bytes(b"more")
        digest = sha256_of_file(layout.root / path)
        if recorded:
            reseal(layout, lambda manifest: manifest["artifacts"].update({path: digest}))

    return forge


def change_clip(change: Callable[[dict[str, Any]], object], *, plan: bool = False) -> Forge:
    """Change the record of the first clip, and the tables that follow from it."""

    def forge(layout: Layout) -> None:
        if plan:
            change_json("plan.json", lambda value: change(value["clips"][0]))(layout)
        reseal(layout, lambda manifest: change(manifest["clips"][0]))
        manifest = read_manifest(layout)
        for path, tables in summarise_clips(Plan.of(manifest, layout.manifest), manifest["clips"]):
            write_tables(tables, layout.root / path)

    return forge


def record_rows(layout: Layout) -> None:
    """Record the hashes of the rows as they are now."""

    def change(manifest: dict[str, Any]) -> None:
        for clip in manifest["clips"][:2]:
            ticks, frames = (
                read_columns(layout.root / path, clip["clip_id"], most=100_000, exact=False)
                for path in (TICKS, FRAMES)
            )
            own = sorted(frames.keys() - clip["figures"].keys() - {"clip_id", "label", "weather"})
            clip["content"]["ticks"] = columns_hash(ticks, [channel.name for channel in TICK_CHANNELS])
            clip["content"]["frames"] = columns_hash(frames, own)

    reseal(layout, change)


def and_record(forge: Forge) -> Forge:
    return lambda layout: (forge(layout), record_rows(layout))


def swap_shards(manifest: dict[str, Any]) -> None:
    first, other = (clip["artifacts"] for clip in manifest["clips"][:2])
    first_rgb, other_rgb = (next(path for path in files if "rgb" in path) for files in (first, other))
    first[other_rgb], other[first_rgb] = other.pop(other_rgb), first.pop(first_rgb)


def append(path: str, content: bytes) -> Forge:
    return lambda layout: (layout.root / path).write_bytes((layout.root / path).read_bytes() + content)


def two_rows_exchanged(table: pa.Table) -> pa.Table:
    order = np.arange(len(table))
    order[[3, 4]] = order[[4, 3]]
    return table.take(pa.array(order))


OURS = {"compression": "zstd", "compression_level": 3, "write_page_checksum": True}
