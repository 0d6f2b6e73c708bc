"""A reproducibility audit: are the files those recorded, and do the same inputs still make the same bytes?"""

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flows.making.generate import create_frame_arrays, fan_out
from flows.making.input_changes import input_changes
from flows.making.plan import Plan, read_plan
from flows.running.orchestration import run_as_stage
from flows.running.runner import RunnerName
from flows.store.address import open_for_writing, want_everything
from flows.store.arrays import arrays_of
from flows.store.frames import read_clip
from flows.store.layout import STAGED_TABLES, Layout, write_atomically
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest, read_receipt
from flows.store.staging import scratch_dataset
from flows.store.telemetry import read_columns
from manifests.canonical import sha256_of
from manifests.compare import first_pixel_difference, first_row_difference
from manifests.explain import as_sentences, find_reasons
from manifests.manifest import damaged_files, manifest_damage
from manifests.records import Manifest, Receipt
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError

STAGE_OF = {"ticks": "vehicle", "frames": "frames"} | dict.fromkeys(arrays_of(labels=True), "render")


def audit_dataset(
    dataset: str,
    *,
    share: float = 0.1,
    out: str | None = None,
    runner: RunnerName = "dask",
    workers: int | None = None,
    scheduler: str | None = None,
) -> dict[str, Any]:
    """Verify every recorded hash, then make a share of the clips again and compare them.

    Parameters
    ----------
    dataset : a sealed dataset folder
    share : share of the clips to make again, at least one clip unless 0 [1]
    out : folder for ``audit.json`` and ``audit.txt``; None writes none
    workers : how many at once; None takes another number than a generating run does by itself [1]

    Returns
    -------
    The audit: ``verified`` (all well); ``files``; ``damaged[]``; ``rerun[]``, the clips made again; ``mismatches[]``,
    each with where it differs first and the inputs that can be ``why``; ``differences[]`` of inputs and tools between
    what made the dataset and what is here; ``not_remade[]``, why damaged inputs let no clip be made.

    Raises
    ------
    InputError
        If the folder is no sealed dataset of this format, or the share is not in [0, 1].
    """
    if not 0 <= share <= 1:
        raise InputError(f"--share must lie in 0 to 1; it is {share:g}")
    results = Outputs(out, "audit", "audit.json", "audit.txt")
    changes: list[dict[str, Any]] = []
    mismatches: list[dict[str, Any]] = []
    not_remade: list[str] = []
    with open_for_writing(dataset, want_everything) as layout:
        manifest = read_manifest(layout)
        damaged = run_as_stage(damaged_files)(layout.root, manifest)
        if (fault := manifest_damage(layout.manifest.read_bytes())) is not None:
            damaged.append({"path": "manifest.json", "clip_id": None, "damage": fault})
        chosen = chosen_clips(manifest, share)
        try:
            changes = input_changes(layout, manifest)
            mismatches = run_as_stage(remake_and_compare)(
                layout, manifest, chosen, runner, workers or other_count(), scheduler
            )
        except InputError as error:
            if not damaged:
                raise
            chosen, not_remade = [], list(error.problems)
    result = {
        "verified": not damaged and not mismatches,
        "files": len(manifest["artifacts"]) + sum(len(clip["artifacts"]) for clip in manifest["clips"]),
        "damaged": damaged,
        "rerun": [clip["clip_id"] for clip in chosen],
        "mismatches": [row | {"why": find_reasons(row["changed"], changes)} for row in mismatches],
        "differences": as_sentences(changes),
        "not_remade": not_remade,
    }
    results.write_json("audit.json", result)
    results.write("audit.txt", format_text(result))
    return result


def format_text(result: Mapping[str, Any]) -> str:
    """The audit in lines for people.

    Parameters
    ----------
    result : of `audit_dataset`
    """
    lines = [
        f"{len(result['damaged'])} of {result['files']} files are not those recorded",
        *(f"  {row['path']}: {row['damage']}" for row in result["damaged"]),
        f"{len(result['mismatches'])} of {len(result['rerun'])} clips made again differ",
        *(f"  none could be made: {problem}" for problem in result["not_remade"]),
    ]
    for row in result["mismatches"]:
        pixel = f", pixel {row['pixel'][0]} right and {row['pixel'][1]} down" if "pixel" in row else ""
        values = f": {row['recorded']} recorded, {row['remade']} made again" if "recorded" in row else ""
        because = ", ".join(row["why"]) or "no input that is recorded"
        first = f"{row['stage']}, {row['channel']}, {row['counted_in']} {row['tick']}{pixel}{values}"
        lines += [
            f"  {row['label']} ({row['clip_id']}): {', '.join(row['changed'])}",
            f"    first in {first}",
            f"    can come from: {because}",
        ]
    lines.append(
        "inputs and tools that differ:" if result["differences"] else "no recorded input or tool differs"
    )
    lines += [f"  {difference}" for difference in result["differences"]]
    lines.append("verified" if result["verified"] else "not verified")
    return "\n".join(lines) + "\n"


def other_count() -> int:
    """Another number of workers than a run takes by itself: bytes must not depend on it [1]."""
    return len(os.sched_getaffinity(0)) - 1 or 2


def chosen_clips(manifest: Manifest, share: float) -> list[Receipt]:
    """A share of the clips, drawn by hash: the same clips for the same dataset, spread over the grid."""
    count = math.ceil(share * len(manifest["clips"]))
    drawn = sorted(
        manifest["clips"], key=lambda clip: sha256_of([f"{manifest['run_id']}/{clip['clip_id']}".encode()])
    )
    return drawn[:count]


def remake_and_compare(
    layout: Layout,
    manifest: Manifest,
    chosen: list[Receipt],
    runner: RunnerName,
    workers: int | None,
    scheduler: str | None,
) -> list[dict[str, Any]]:
    """Make the chosen clips again beside the dataset, in reverse order, and name what differs first."""
    if not chosen:
        return []
    with scratch_dataset(layout) as remade:
        for name in ("plan.json", *(f"inputs/{name}" for name in manifest["inputs"])):
            write_atomically(remade.root / name, recorded_bytes(layout.root / name))
        plan = read_plan(remade.root)
        if [clip.clip_id for clip in plan.clips] != [clip["clip_id"] for clip in manifest["clips"]]:
            raise InputError(f"{layout.plan}: must plan the clips of the manifest; it plans others")
        create_frame_arrays(remade, plan)
        indices = sorted((clip["index"] for clip in chosen), reverse=True)
        fan_out(remade, plan, indices, runner, workers, scheduler)
        return [
            difference
            for clip in chosen
            if (difference := _first_difference(layout, remade, plan, clip)) is not None
        ]


def recorded_bytes(path: Path) -> bytes:
    """The bytes of a small file of a dataset.

    Raises
    ------
    InputError
        If it is missing, or lies behind a link.
    """
    if path.resolve() != path or not path.is_file():
        raise InputError(f"{path}: the manifest records this file; it is missing, or behind a link")
    return path.read_bytes()


def _first_difference(layout: Layout, remade: Layout, plan: Plan, clip: Receipt) -> dict[str, Any] | None:
    clip_id, index = clip["clip_id"], clip["index"]
    new = read_receipt(remade, clip_id)["content"]
    changed = [
        name
        for name in (*STAGED_TABLES, *arrays_of(plan.settings.labels))
        if new.get(name) != clip["content"].get(name)  # without frames no array has one
    ]
    if not changed:
        return None
    first = changed[0]
    difference: dict[str, Any] | None
    if first in STAGED_TABLES:
        family = plan.clips[index].scenario.weather
        recorded = read_columns(layout.telemetry / first / f"family={family}", clip_id)
        again = read_columns(remade.staged(clip_id, first))
        channels = [c.name for c in TICK_CHANNELS] if first == "ticks" else list(again)
        difference = first_row_difference(recorded, again, channels)
    else:
        recorded_pixels = read_clip(layout.frames, index, first)
        difference = first_pixel_difference(first, recorded_pixels, read_clip(remade.frames, index, first))
    # the hashes differ but the stored values do not: the file was changed after it was recorded
    return {"clip_id": clip_id, "label": clip["label"], "stage": STAGE_OF[first], "changed": changed,
            "counted_in": "tick" if first == "ticks" else "frame",
            **(difference or {"channel": first, "tick": 0})}  # fmt: skip
