"""Sealing: staged clips become the dataset's tables, preview and frozen manifest."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from itertools import chain, islice
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from catalogs.variants import Variant
from flows.making.gathering import gather_tables
from flows.making.input_changes import read_kept
from flows.making.plan import ClipPlan, Plan
from flows.store.address import fetch_files, remove_files, send_files
from flows.store.frames import read_clip
from flows.store.layout import STAGED_TABLES, Layout, write_atomically, write_pieces
from flows.store.sealed import read_receipt
from flows.store.staging import remove_staged, remove_staging, staged_files
from flows.store.telemetry import labelled_table, read_columns, write_parquet, write_tables
from manifests.canonical import sha256_of_file
from manifests.environment import environment_bom
from manifests.manifest import freeze_manifest, is_quarantined
from manifests.provenance import describe_processor, git_commit
from manifests.records import Receipt
from manifests.siblings import FIGURES, iterate_pairs
from tasks.conventions import PAIR_CHANNELS
from tasks.render.contact_sheet import draw_contact_sheet, encode_png

BATCH = 200
"""Rows and files that are held at once where there is one a clip or a pair [1]."""
PREVIEW_FRAMES = (0, 20, 40, 80)
PREVIEW_CLIPS = 24

Item = TypeVar("Item")


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
    outcomes = _write_clips(layout, plan)
    write_tables(pairs_tables(outcomes), layout.telemetry / "pairs.parquet")
    del outcomes
    sheet = layout.previews / "contact_sheet.png"
    if plan.settings.pictures:
        shown = list(_read_receipts(layout, pick_evenly(plan.clips, PREVIEW_CLIPS)))
        write_atomically(sheet, preview_sheet(layout, layout.frames, plan, shown))
    made = [
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
    artifacts = parts | {layout.relative(path): sha256_of_file(path) for path in shared}
    read_kept(layout, plan.inputs)
    made_on = {"processor": describe_processor(), "git": git_commit(), "environment": environment_bom()}
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


def batched(items: Iterable[Item], size: int | None = None) -> Iterator[list[Item]]:
    """Yield the items in lists of at most ``size`` [1], by default `BATCH`."""
    left = iter(items)
    while batch := list(islice(left, size or BATCH)):
        yield batch


def _write_clips(layout: Layout, plan: Plan) -> "Outcomes":
    """Write the table of the clips; returns what pairs of them need."""
    table = clips_table(_read_receipts(layout, plan.clips), plan.settings.variant)
    write_parquet(table, layout.telemetry / "clips.parquet")
    return Outcomes(plan.clips, table)


def _read_here(layout: Layout, plan: Plan) -> Iterator[Path]:
    """The files of finished clips that sealing reads beside their tables, and those of clips on the contact sheet."""
    for clip in plan.clips:
        yield layout.receipt(clip.clip_id)
    for clip in pick_evenly(plan.clips, PREVIEW_CLIPS) if plan.settings.pictures else []:
        yield layout.staged(clip.clip_id, "frames")
        yield layout.frame_shard("rgb", clip.index)


def clips_table(receipts: Iterable[Receipt], variant: Variant = "full") -> pa.Table:
    """One row a clip: controls, surface, outcome and verdict; where a coupling is cut, also which.

    Parameters
    ----------
    receipts : of the clips
    variant : of the dataset
    """
    columns: dict[str, list[Any]] = {}
    for batch in batched(receipts):
        rows = [_clip_row(receipt) for receipt in batch]
        for name in rows[0]:
            columns.setdefault(name, []).append(_pack([row[name] for row in rows]))
    # each column's parts go when it is whole
    cut = {} if variant == "full" else {"variant": variant}
    return labelled_table({name: _join(columns.pop(name)) for name in list(columns)}, cut)


def _clip_row(r: Receipt) -> dict[str, Any]:
    return (
        {name: r[name] for name in ("clip_id", "index", "label", "seed", "split", "calibration")}
        | r["scenario"]
        | r["figures"]
        | {"quarantined": is_quarantined(r)}
        | {f"check_{key}": value for key, value in r["verdict"].items() if key != "reasons"}
    )


def _pack(values: list[Any]) -> Any:
    """Values of some rows: floats, with NaN for None, where one is, an array where all are text, else as they are."""
    if any(isinstance(value, float) for value in values):
        return _as_floats(values)
    return pa.array(values) if all(isinstance(value, str) for value in values) else values


def _join(parts: list[Any]) -> Any:
    """The packed parts of one column: floats where any part is, or where nothing is represented."""
    if any(isinstance(part, np.ndarray) for part in parts) or all(v is None for part in parts for v in part):
        return np.concatenate([part if isinstance(part, np.ndarray) else _as_floats(part) for part in parts])
    if all(isinstance(part, pa.Array) for part in parts):
        return pa.concat_arrays(parts)
    return [value for part in parts for value in (part.to_pylist() if isinstance(part, pa.Array) else part)]


def _as_floats(values: list[Any]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], float)


class Outcomes(Sequence[Mapping[str, Any]]):
    """Records of clips as `manifests.siblings` reads them, each made when it is read.

    Parameters
    ----------
    clips : of the plan
    table : of the same clips
    """

    def __init__(self, clips: Sequence[ClipPlan], table: pa.Table):
        self.clips = clips
        self.figures = {name: table[name].to_numpy() for name in FIGURES}

    def __len__(self) -> int:
        return len(self.clips)

    def __getitem__(self, place: Any) -> Any:
        clip = self.clips[place]
        figures = {name: values[place] for name, values in self.figures.items()}
        return {
            "clip_id": clip.clip_id,
            "label": clip.label,
            "scenario": clip.scenario.as_row(),
            "figures": figures,
        }


def pairs_table(receipts: Sequence[Mapping[str, Any]]) -> pa.Table:
    """One row a pair of clips that differ in exactly one control: what that control changes."""
    return pa.concat_tables(pairs_tables(receipts)).combine_chunks()


def pairs_tables(receipts: Sequence[Mapping[str, Any]]) -> Iterator[pa.Table]:
    """Yield the rows of `pairs_table` in tables of some of them; the first one has none."""
    kinds = {channel.name: float if channel.name.endswith("_change") else str for channel in PAIR_CHANNELS}
    for rows in chain([[]], batched(iterate_pairs(receipts))):
        yield labelled_table(
            {name: np.array([row[name] for row in rows], kind) for name, kind in kinds.items()}
        )


def preview_sheet(layout: Layout, pictures_at: Path, plan: Plan, receipts: Sequence[Receipt]) -> bytes:
    """The contact sheet as PNG, from staged frame tables and the frames at ``pictures_at``."""
    frames = [frame for frame in PREVIEW_FRAMES if frame < plan.settings.frames]
    rows = []
    for receipt in pick_evenly(receipts, PREVIEW_CLIPS):
        pictures = list(read_clip(pictures_at, receipt["index"], "rgb", frames))
        columns = read_columns(layout.staged(receipt["clip_id"], "frames"))
        label = receipt["label"] + (" (quarantined)" if is_quarantined(receipt) else "")
        rows.append((label, pictures, {"speed": columns["speed"], "pitch": columns["pitch"]}))
    return encode_png(draw_contact_sheet(rows, frames, plan.settings.frame_rate_hz))


def pick_evenly(items: Sequence[Any], most: int) -> list[Any]:
    """Return at most that many of the items, evenly spaced from the first to the last."""
    chosen = np.linspace(0, len(items) - 1, min(len(items), most))
    return [items[i] for i in np.rint(chosen).astype(int)]
