"""A reproducibility audit: are the files those recorded, and do the same inputs still make the same bytes?"""

import math
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flows.generate import create_frame_arrays, fan_out
from flows.orchestration import stage
from flows.plan import Plan, read_plan
from flows.runner import RunnerName
from flows.store.address import everything, working
from flows.store.arrays import arrays_of
from flows.store.frames import read_clip
from flows.store.layout import STAGED_TABLES, Layout, read_json, write_json
from flows.store.lock import sole_writer
from flows.store.sealed import read_manifest
from flows.store.telemetry import read_columns
from manifests.canonical import sha256_of
from manifests.compare import first_pixel_difference, first_row_difference
from manifests.manifest import damaged_files
from manifests.provenance import code_version, library_versions, processor
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError

STAGE_OF = {"ticks": "vehicle", "frames": "frames"} | dict.fromkeys(arrays_of(labels=True), "render")


def audit(
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
    out : folder for ``audit.json``; None writes none

    Returns
    -------
    The audit: ``verified`` (all well), ``damaged``, ``rerun``, ``mismatches`` and ``differences`` of the tools.

    Raises
    ------
    InputError
        If the folder is no sealed dataset of this format, or the share is not in [0, 1].
    """
    if not 0 <= share <= 1:
        raise InputError(f"--share must lie in 0 to 1; it is {share:g}")
    with working(dataset, everything) as layout:
        manifest = read_manifest(layout)
        damaged = stage(damaged_files)(layout.root, manifest)
        chosen = chosen_clips(manifest, share)
        mismatches = stage(remake_and_compare)(layout, manifest, chosen, runner, workers, scheduler)
    result = {
        "verified": not damaged and not mismatches,
        "files": len(manifest["artifacts"]) + sum(len(clip["artifacts"]) for clip in manifest["clips"]),
        "damaged": damaged,
        "rerun": [clip["clip_id"] for clip in chosen],
        "mismatches": mismatches,
        "differences": tool_differences(manifest),
    }
    if out is not None:
        write_json(Path(out) / "audit.json", result)
    return result


def chosen_clips(manifest: Mapping[str, Any], share: float) -> list[Mapping[str, Any]]:
    """A share of the clips, drawn by hash: the same clips for the same dataset, spread over the grid."""
    count = math.ceil(share * len(manifest["clips"]))
    drawn = sorted(
        manifest["clips"], key=lambda clip: sha256_of([f"{manifest['run_id']}/{clip['clip_id']}".encode()])
    )
    return drawn[:count]


def remake_and_compare(
    layout: Layout,
    manifest: Mapping[str, Any],
    chosen: list[Mapping[str, Any]],
    runner: RunnerName,
    workers: int | None,
    scheduler: str | None,
) -> list[dict[str, Any]]:
    """Make the chosen clips again beside the dataset, in reverse order, and name what differs first."""
    if not chosen:
        return []
    with tempfile.TemporaryDirectory(prefix=".audit-", dir=layout.root.parent) as folder:
        remade = Layout(Path(folder))
        shutil.copytree(layout.inputs, remade.inputs)
        shutil.copy(layout.plan, remade.plan)
        plan = read_plan(remade.root)
        create_frame_arrays(remade, plan)
        indices = sorted((clip["index"] for clip in chosen), reverse=True)
        with sole_writer(remade):  # what holds no lock is a left-over of a killed audit
            fan_out(remade, plan, indices, runner, workers, scheduler)
        return [
            difference
            for clip in chosen
            if (difference := _first_difference(layout, remade, plan, clip)) is not None
        ]


def tool_differences(manifest: Mapping[str, Any]) -> list[str]:
    """How the code, libraries and processor here differ from those that made the dataset."""
    ours = {"code": code_version(), "libraries": library_versions(), "processor": processor()}
    theirs = {**manifest["made_with"], "processor": manifest["processor"]}
    return [
        f"{group} {key}: {theirs[group].get(key)} made it, {value} is here"
        for group, facts in ours.items()
        for key, value in facts.items()
        if theirs[group].get(key) != value
    ]


def _first_difference(
    layout: Layout, remade: Layout, plan: Plan, clip: Mapping[str, Any]
) -> dict[str, Any] | None:
    clip_id, index = clip["clip_id"], clip["index"]
    new = read_json(remade.receipt(clip_id))["content"]
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
            **(difference or {"channel": first, "tick": 0})}  # fmt: skip
