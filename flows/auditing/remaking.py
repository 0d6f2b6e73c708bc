"""Clips of a dataset, made again beside it: what is stored and what is recorded of each must be what comes out."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
from numpy.typing import NDArray

from flows.auditing.audit_facts import name_other_writers
from flows.making.gathering import table_parts
from flows.making.generate import create_frame_arrays, fan_out, open_workers
from flows.making.plan import Plan, read_plan
from flows.running.runner import RunnerName
from flows.store.arrays import arrays_of
from flows.store.frames import buffer_hash, read_clip
from flows.store.layout import OBJECTS, STAGED_TABLES, Layout, write_atomically
from flows.store.links import require_file
from flows.store.object_tables import hash_objects, read_objects
from flows.store.sealed import read_receipt
from flows.store.staging import scratch_dataset
from flows.store.telemetry import content_hash, read_columns, table_columns
from manifests.canonical import sha256_of_file
from manifests.compare import find_pixel_difference, find_row_difference
from manifests.explain import find_value_differences
from manifests.records import Manifest, Receipt
from tasks.conventions import CHANNELS_BY_NAME, ESSENTIAL, TICK_CHANNELS
from tasks.errors import InputError

Columns = dict[str, NDArray[Any]]
RECORDED = ("label", "scenario", "seed", "split", "calibration", "figures", "verdict")
"""Entries of a clip's record beside the hashes of its content."""
STAGES = {"ticks": "vehicle", "frames": "frames"} | dict.fromkeys(RECORDED, "record")
"""Stage of each content and record; arrays are of the renderer."""


def remake_and_compare(
    layout: Layout,
    manifest: Manifest,
    chosen: list[Receipt],
    runner: RunnerName,
    workers: int | None,
    scheduler: str | None,
) -> list[dict[str, Any]]:
    """Make the chosen clips again beside the dataset, in reverse order, and name what differs first."""
    with scratch_dataset(layout) as remade:
        for name in ("plan.json", *(f"inputs/{name}" for name in manifest["inputs"])):
            write_atomically(remade.root / name, require_file(layout.root / name).read_bytes())
        plan = read_plan(remade.root)
        if [clip.clip_id for clip in plan.clips] != [clip["clip_id"] for clip in manifest["clips"]]:
            raise InputError(f"{layout.plan}: must plan the clips of the manifest; it plans others")
        create_frame_arrays(remade, plan)
        indices = sorted((clip["index"] for clip in chosen), reverse=True)
        with open_workers(remade, plan, runner, workers, scheduler) as executor:
            fan_out(remade, plan, indices, executor)
        parts = {
            (table, clip_id): path
            for table in STAGED_TABLES
            for path, clip_ids in table_parts(plan, table).items()
            for clip_id in clip_ids
        }
        is_same_writer = not name_other_writers(manifest)
        found = (_compare_clip(layout, remade, plan, parts, clip, is_same_writer) for clip in chosen)
        return [difference for difference in found if difference is not None]


def _compare_clip(
    layout: Layout,
    remade: Layout,
    plan: Plan,
    parts: Mapping[tuple[str, str], str],
    clip: Receipt,
    is_same_writer: bool,
) -> dict[str, Any] | None:
    """Compare a clip as it is stored and recorded with the one made again; one array at a time is in memory.

    Parameters
    ----------
    layout, remade : of the dataset, and of the scratch folder that holds the clip again
    plan : of both
    parts : file in the dataset that holds the rows of a clip, by table and clip id
    clip : as the manifest records it
    is_same_writer : whether code and libraries are those that wrote the dataset, so that files must be equal too

    Returns
    -------
    ``clip_id`` and ``label``; ``changed``, the contents and records that differ; ``stage`` of the first one, and where
    it differs; None where nothing does.
    """
    clip_id, index = clip["clip_id"], clip["index"]
    again = read_receipt(remade, clip_id)
    changed: dict[str, dict[str, Any]] = {}
    settings = plan.settings
    arrays = arrays_of(settings.labels, settings.has_objects) if settings.stores_frames else ()
    objects = (OBJECTS,) if settings.has_objects else ()
    for name in (*STAGED_TABLES, *objects, *arrays):
        digest = again["content"][name]
        try:
            if name in STAGED_TABLES:
                columns = _read_as_stored(name, layout.root / parts[name, clip_id], remade, clip_id)
                digest, stored = content_hash(name, columns[1]), _compare_rows(*columns)
            elif name == OBJECTS:
                held, made = (read_objects(side, index, settings.frames) for side in (layout, remade))
                digest, stored = hash_objects(made), find_row_difference(held, made, list(made))
            else:
                stored = _compare_pixels(layout, remade, index, name, digest, is_same_writer)
        except InputError as error:
            stored = {"channel": name, "problem": error.problems[0]}
        if stored is not None or digest != clip["content"].get(name):
            # where the stored values are those made again, the recorded hash alone is another
            changed[name] = stored or {"channel": name, "tick": 0}
    for name in RECORDED:
        changed |= _compare_record(name, clip[name], again[name])  # type: ignore[literal-required]
    if not changed:
        return None
    first = next(iter(changed))
    return {
        "clip_id": clip_id,
        "label": clip["label"],
        "stage": STAGES.get(first, "render"),
        "changed": list(changed),
        "counted_in": "tick" if first == "ticks" else "frame",
        **changed[first],
    }


def _read_as_stored(table: str, file: Path, remade: Layout, clip_id: str) -> tuple[Columns, Columns]:
    """Return a clip's columns as they are stored and those made again, without such as an older table does not have."""
    again = table_columns(pq.read_table(remade.staged(clip_id, table)))
    rows = len(next(iter(again.values())))
    recorded = read_columns(require_file(file), clip_id, most=rows, exact=False)
    later = CHANNELS_BY_NAME.keys() - recorded.keys() - ESSENTIAL
    return recorded, {name: values for name, values in again.items() if name not in later}


def _compare_rows(recorded: Columns, remade: Columns) -> dict[str, Any] | None:
    """Compare all columns of a clip's rows, those of the motion first."""
    motion = [channel.name for channel in TICK_CHANNELS if channel.name in remade]
    return find_row_difference(recorded, remade, list(dict.fromkeys([*motion, *remade, *recorded])))


def _compare_pixels(
    layout: Layout, remade: Layout, index: int, name: str, digest: str, is_same_writer: bool
) -> dict[str, Any] | None:
    """Hold one array of a clip against the one made again; it is decoded only where its file is another."""
    shard, again = (side.frame_shard(name, index) for side in (layout, remade))
    if sha256_of_file(require_file(shard)) == sha256_of_file(again):
        return None
    recorded = read_clip(layout.frames, index, name)
    if buffer_hash(recorded) != digest:
        return find_pixel_difference(name, recorded, read_clip(remade.frames, index, name))
    if not is_same_writer:
        return None
    return {
        "channel": name,
        "problem": f"{layout.relative(shard)}: its pixels are those made again and its bytes are not, so that another"
        " reader can see others",
    }


def _compare_record(name: str, recorded: Any, again: Any) -> dict[str, dict[str, Any]]:
    if name in {"figures", "verdict"}:
        # older records lack figures that their ticks and frames have
        again = {figure: value for figure, value in again.items() if figure in recorded}
    for field, a, b in find_value_differences(recorded, again, name):
        return {name: {"channel": field, "recorded": a, "remade": b}}
    return {}
