"""Sealing: staged clips become the dataset's tables, preview and frozen manifest."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from flows.making.plan import Plan
from flows.store.address import remove_files, send_files
from flows.store.frames import read_clip
from flows.store.layout import STAGED_TABLES, Layout, write_atomically
from flows.store.sealed import read_receipt
from flows.store.staging import remove_staged, remove_staging, staged_files
from flows.store.telemetry import labelled_table, read_columns, read_table, write_parquet
from manifests.canonical import sha256_of_file
from manifests.environment import environment_bom
from manifests.manifest import freeze_manifest, is_quarantined
from manifests.provenance import describe_processor, git_commit
from manifests.records import Receipt
from manifests.siblings import sibling_pairs
from tasks.conventions import PAIR_CHANNELS
from tasks.render.contact_sheet import draw_contact_sheet, encode_png

CLIPS_PER_FILE = 100
PREVIEW_FRAMES = (0, 20, 40, 80)
PREVIEW_CLIPS = 24


def seal_dataset(layout: Layout, plan: Plan) -> None:
    """Collect the staged tables, draw the contact sheet, and freeze the manifest last."""
    receipts = [read_receipt(layout, clip.clip_id) for clip in plan.clips]
    tables = [
        write_part(layout, table, path, clip_ids)
        for table in STAGED_TABLES
        for path, clip_ids in table_parts(plan, table).items()
    ]
    write_parquet(clips_table(receipts), layout.telemetry / "clips.parquet")
    write_parquet(pairs_table(receipts), layout.telemetry / "pairs.parquet")
    sheet = layout.previews / "contact_sheet.png"
    if plan.settings.pictures:
        write_atomically(sheet, preview_sheet(layout, layout.frames, plan, receipts))
    made = [
        *tables,
        layout.telemetry / "clips.parquet",
        layout.telemetry / "pairs.parquet",
        *([sheet] if plan.settings.pictures else []),
    ]
    shared = [
        *made,
        layout.plan,
        *sorted(path for path in layout.inputs.rglob("*") if path.is_file()),
        *sorted(layout.frames.rglob("zarr.json")),
    ]
    artifacts = {layout.relative(path): sha256_of_file(path) for path in shared}
    made_on = {"processor": describe_processor(), "git": git_commit(), "environment": environment_bom()}
    write_atomically(layout.manifest, freeze_manifest(plan.as_json(), receipts, artifacts, made_on))
    send_files(layout, made, last=layout.manifest)
    staged = staged_files(layout)
    remove_files(layout, staged)
    remove_staged(staged)
    remove_staging(layout)


def needed_to_seal(layout: Layout, plan: Plan) -> list[Path]:
    """The files of finished clips that sealing reads."""
    ids = [clip.clip_id for clip in plan.clips]
    shown = pick_evenly(plan.clips, PREVIEW_CLIPS) if plan.settings.pictures else []
    return [
        *(layout.receipt(clip_id) for clip_id in ids),
        *(layout.staged(clip_id, table) for clip_id in ids for table in STAGED_TABLES),
        *(layout.frame_shard("rgb", clip.index) for clip in shown),
    ]


def table_parts(plan: Plan, table: str) -> dict[str, list[str]]:
    """The files of one kind of table and the clips in each: one a weather and hundred clips, in plan order."""
    by_weather: dict[str, list[str]] = {}
    for clip in plan.clips:
        by_weather.setdefault(clip.scenario.weather, []).append(clip.clip_id)
    return {
        f"telemetry/{table}/family={weather}/part-{part:04d}.parquet": clip_ids[
            start : start + CLIPS_PER_FILE
        ]
        for weather, clip_ids in by_weather.items()
        for part, start in enumerate(range(0, len(clip_ids), CLIPS_PER_FILE))
    }


def write_part(layout: Layout, table: str, path: str, clip_ids: Sequence[str]) -> Path:
    """Gather the staged tables of some clips into one file of the dataset."""
    staged = [read_table(layout.staged(clip_id, table)) for clip_id in clip_ids]
    write_parquet(pa.concat_tables(staged).unify_dictionaries().combine_chunks(), layout.root / path)
    return layout.root / path


def clips_table(receipts: Sequence[Receipt]) -> pa.Table:
    """One row a clip: controls, surface, outcome and verdict."""
    rows = [
        {name: r[name] for name in ("clip_id", "index", "label", "seed", "split", "calibration")}
        | r["scenario"]
        | r["figures"]
        | {"quarantined": is_quarantined(r)}
        | {f"check_{key}": value for key, value in r["verdict"].items() if key != "reasons"}
        for r in receipts
    ]
    columns: dict[str, Any] = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        numeric = any(isinstance(value, float) for value in values) or all(value is None for value in values)
        columns[name] = np.array([np.nan if v is None else v for v in values], float) if numeric else values
    return labelled_table(columns)


def pairs_table(receipts: Sequence[Receipt]) -> pa.Table:
    """One row a pair of clips that differ in exactly one control: what that control changes."""
    rows = sibling_pairs(receipts)
    kinds = {channel.name: float if channel.name.endswith("_change") else str for channel in PAIR_CHANNELS}
    columns = {name: np.array([row[name] for row in rows], kind) for name, kind in kinds.items()}
    return labelled_table(columns)


def preview_sheet(layout: Layout, pictures_at: Path, plan: Plan, receipts: Sequence[Receipt]) -> bytes:
    """The contact sheet as PNG, from staged frame tables and the frames at ``pictures_at``."""
    frames = [frame for frame in PREVIEW_FRAMES if frame < plan.settings.frames]
    rows = []
    for receipt in pick_evenly(receipts, PREVIEW_CLIPS):
        pictures = read_clip(pictures_at, receipt["index"], "rgb")
        columns = read_columns(layout.staged(receipt["clip_id"], "frames"))
        label = receipt["label"] + (" (quarantined)" if is_quarantined(receipt) else "")
        rows.append((label, [pictures[frame] for frame in frames],
                     {"speed": columns["speed"], "pitch": columns["pitch"]}))  # fmt: skip
    return encode_png(draw_contact_sheet(rows, frames, plan.settings.frame_rate_hz))


def pick_evenly(items: Sequence[Any], most: int) -> list[Any]:
    """Return at most that many of the items, evenly spaced from the first to the last."""
    chosen = np.linspace(0, len(items) - 1, min(len(items), most))
    return [items[i] for i in np.rint(chosen).astype(int)]
