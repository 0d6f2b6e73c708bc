"""Sealing: staged clips become the dataset's tables, preview and frozen manifest."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from flows.making.gathering import gather_tables
from flows.making.input_changes import read_kept
from flows.making.plan import ClipPlan, Plan
from flows.making.summaries import SUMMARIES, batched, summarise_clips
from flows.store.address import fetch_files, remove_files, send_files
from flows.store.frames import read_clip
from flows.store.layout import STAGED_TABLES, Layout, write_atomically, write_pieces
from flows.store.sealed import read_receipt
from flows.store.staging import remove_staged, remove_staging, staged_files
from flows.store.telemetry import read_columns, write_tables
from manifests.canonical import sha256_of_file
from manifests.environment import environment_bom
from manifests.manifest import freeze_manifest, is_quarantined
from manifests.provenance import describe_processor, git_commit
from manifests.records import Receipt
from tasks.render.contact_sheet import draw_contact_sheet, encode_png

SHEET = "previews/contact_sheet.png"
PREVIEW_FRAMES = (0, 20, 40, 80)
PREVIEW_CLIPS = 24


def seal_dataset(layout: Layout, plan: Plan, executor: Executor | None = None) -> dict[str, list[str]]:
    """Gather the staged tables, draw the contact sheet, and freeze the manifest last.

    Receipts are read one at a time, once for the tables and once for the manifest: memory grows by the numbers of a
    clip's row, not by its record.

    Parameters
    ----------
    layout, plan : of the dataset, every clip of which is made
    executor : whose workers gather the tables of a hundred clips each; None gathers them here

    Returns
    -------
    Why the pose check failed, by label of the clip that it failed for.
    """
    parts = gather_tables(layout, plan, executor)
    fetch_files(layout, _read_here(layout, plan))
    for path, tables in summarise_clips(plan, _read_receipts(layout, plan.clips)):
        write_tables(tables, layout.root / path)
    sheet = layout.root / SHEET
    if plan.settings.stores_frames:
        shown = list(_read_receipts(layout, pick_evenly(plan.clips, PREVIEW_CLIPS)))
        write_atomically(
            sheet, preview_sheet(layout, plan, shown, lambda clip_id: layout.staged(clip_id, "frames"))
        )
    made = [
        *(layout.root / path for path in SUMMARIES),
        *([sheet] if plan.settings.stores_frames else []),
    ]
    shared = [
        *made,
        layout.plan,
        *sorted(path for path in layout.inputs.rglob("*") if path.is_file()),
        *sorted(layout.frames.rglob("zarr.json")),
    ]
    artifacts = parts | {layout.relative(path): sha256_of_file(path) for path in shared}
    read_kept(layout, plan.inputs)
    made_on = {
        "processor": describe_processor(plan.backend), "git": git_commit(), "environment": environment_bom()
    }  # fmt: skip
    quarantined: dict[str, list[str]] = {}
    receipts = _note_quarantined(_read_receipts(layout, plan.clips), quarantined)
    write_pieces(layout.manifest, freeze_manifest(plan.head_as_json(), receipts, artifacts, made_on))
    send_files(layout, made, last=layout.manifest)
    for clips in batched(plan.clips):
        staged = [path for clip in clips for path in _staged_by(layout, clip.clip_id)]
        remove_files(layout, staged)
        remove_staged(staged)
    others = staged_files(layout)
    remove_files(layout, others)
    remove_staged(others)
    remove_staging(layout)
    return quarantined


def _read_receipts(layout: Layout, clips: Iterable[ClipPlan]) -> Iterator[Receipt]:
    return (read_receipt(layout, clip.clip_id) for clip in clips)


def _note_quarantined(receipts: Iterable[Receipt], into: dict[str, list[str]]) -> Iterator[Receipt]:
    for receipt in receipts:
        if is_quarantined(receipt):
            into[receipt["label"]] = receipt["verdict"]["reasons"]
        yield receipt


def _staged_by(layout: Layout, clip_id: str) -> list[Path]:
    return [layout.receipt(clip_id), *(layout.staged(clip_id, table) for table in STAGED_TABLES)]


def _read_here(layout: Layout, plan: Plan) -> Iterator[Path]:
    """The files of finished clips that sealing reads beside their tables, and those of clips on the contact sheet."""
    for clip in plan.clips:
        yield layout.receipt(clip.clip_id)
    for clip in pick_evenly(plan.clips, PREVIEW_CLIPS) if plan.settings.stores_frames else []:
        yield layout.staged(clip.clip_id, "frames")
        yield layout.frame_shard("rgb", clip.index)


def preview_sheet(
    layout: Layout, plan: Plan, receipts: Sequence[Receipt], find_table: Callable[[str], Path]
) -> bytes:
    """Return the contact sheet as PNG.

    Parameters
    ----------
    layout, plan : of the dataset, whose pictures it shows
    receipts : of its clips
    find_table : the file with the frame rows of a clip, by its id
    """
    frames = [frame for frame in PREVIEW_FRAMES if frame < plan.settings.frames]
    rows = []
    for receipt in pick_evenly(receipts, PREVIEW_CLIPS):
        pictures = list(read_clip(layout.frames, receipt["index"], "rgb", frames))
        columns = read_columns(find_table(receipt["clip_id"]), receipt["clip_id"], most=plan.settings.frames)
        label = receipt["label"] + (" (quarantined)" if is_quarantined(receipt) else "")
        rows.append((label, pictures, {"speed": columns["speed"], "pitch": columns["pitch"]}))
    return encode_png(draw_contact_sheet(rows, frames, plan.settings.frame_rate_hz))


def pick_evenly(items: Sequence[Any], most: int) -> list[Any]:
    """Return at most that many of the items, evenly spaced from the first to the last."""
    chosen = np.linspace(0, len(items) - 1, min(len(items), most))
    return [items[i] for i in np.rint(chosen).astype(int)]
