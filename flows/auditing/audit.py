"""A reproducibility audit: are the files those recorded, and do the same inputs still make the same bytes?"""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from flows.auditing.audit_facts import collect_facts, tell_time
from flows.auditing.audit_report import format_text, tell_verdict, write_audit_page
from flows.auditing.signing import signature_findings
from flows.auditing.verify import compare_files
from flows.making.generate import create_frame_arrays, fan_out, open_workers
from flows.making.input_changes import input_changes
from flows.making.plan import Plan, read_plan
from flows.running.orchestration import run_as_stage
from flows.running.runner import RunnerName, check_runner
from flows.store.address import open_for_writing, want_everything
from flows.store.arrays import arrays_of
from flows.store.frames import read_clip
from flows.store.layout import STAGED_TABLES, Layout, write_atomically
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest, read_receipt
from flows.store.staging import scratch_dataset
from flows.store.telemetry import read_columns
from manifests.canonical import sha256_of
from manifests.compare import find_pixel_difference, find_row_difference
from manifests.explain import as_sentences, find_reasons
from manifests.records import Manifest, Receipt
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError

__all__ = ["audit_dataset", "format_text"]

STAGE_OF = {"ticks": "vehicle", "frames": "frames"} | dict.fromkeys(arrays_of(labels=True), "render")


def audit_dataset(
    dataset: str,
    *,
    share: float = 0.1,
    key: str | None = None,
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
    key : file with the signer's Ed25519 public key in PEM; None checks no signature
    out : folder for ``audit.html``, ``audit.json`` and ``audit.txt``; None writes none
    workers : how many at once; None takes another number than a generating run does by itself [1]

    Returns
    -------
    The audit: ``verdict``, a sentence; ``verified`` (all well); what `flows.auditing.audit_facts.collect_facts` says of
    dataset, tools and machine; ``files``, ``intact``, ``damaged[]`` and ``unrecorded[]`` as of
    `flows.auditing.verify.compare_files`; ``signed``, ``signature``, ``signers``, ``key_id`` and ``key_sha256`` as of
    `flows.auditing.signing.signature_findings`; ``rerun[]``, ids of the clips made again, and ``remade[]``, the same
    with label and outcome; ``compared``, how many tables and arrays of them; ``mismatches[]``, each with where it
    differs first and the inputs that can be ``why``; ``differences[]`` of inputs and tools between what made the
    dataset and what is here; ``not_remade[]``, why damaged inputs let no clip be made; ``started_utc``, ``ended_utc``.

    Raises
    ------
    InputError
        If the folder is no sealed dataset of this format, the share is not in [0, 1], the key is none, or there is no
        such runner.
    """
    if not 0 <= share <= 1:
        raise InputError(f"--share must lie in 0 to 1; it is {share:g}")
    check_runner(runner, scheduler)
    results = Outputs(out, "audit", "audit.html", "audit.json", "audit.txt")
    started = tell_time()
    changes: list[dict[str, Any]] = []
    mismatches: list[dict[str, Any]] = []
    not_remade: list[str] = []
    workers = workers or other_count()
    with open_for_writing(dataset, want_everything) as layout:
        manifest = read_manifest(layout, sealed=False)
        signature = signature_findings(layout, key)
        compared = run_as_stage(compare_files)(layout)
        facts = collect_facts(layout, manifest)
        chosen = chosen_clips(manifest, share)
        try:
            changes = input_changes(layout, manifest)
            mismatches = run_as_stage(remake_and_compare)(
                layout, manifest, chosen, runner, workers, scheduler
            )
        except InputError as error:
            if compared["verified"]:
                raise
            chosen, not_remade = [], list(error.problems)
    differing = {row["clip_id"] for row in mismatches}
    result = {
        "verified": compared["verified"] and not mismatches and signature["signed"] is not False,
        **facts,
        **{name: found for name, found in compared.items() if name != "verified"},
        **signature,
        "share": share,
        "runner": runner,
        "workers": workers,
        "rerun": [clip["clip_id"] for clip in chosen],
        "remade": [
            {"label": c["label"], "clip_id": c["clip_id"], "as_recorded": c["clip_id"] not in differing}
            for c in chosen
        ],
        "compared": count_contents(chosen),
        "mismatches": [row | {"why": find_reasons(row["changed"], changes)} for row in mismatches],
        "differences": as_sentences(changes),
        "not_remade": not_remade,
        "started_utc": started,
        "ended_utc": tell_time(),
    }
    result = {"verdict": tell_verdict(result), **result}
    results.write_json("audit.json", result)
    results.write("audit.txt", format_text(result))
    results.write("audit.html", write_audit_page(result))
    return result


def count_contents(chosen: Sequence[Receipt]) -> dict[str, int]:
    """Return how many decoded tables and arrays of clips were compared.

    Parameters
    ----------
    chosen : receipts of the clips that were made again
    """
    contents = [name for clip in chosen for name in clip["content"]]
    tables = sum(name in STAGED_TABLES for name in contents)
    return {"tables": tables, "arrays": len(contents) - tables}


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
        with open_workers(remade, plan, runner, workers, scheduler) as executor:
            fan_out(remade, plan, indices, executor)
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
        difference = find_row_difference(recorded, again, channels)
    else:
        recorded_pixels = read_clip(layout.frames, index, first)
        difference = find_pixel_difference(first, recorded_pixels, read_clip(remade.frames, index, first))
    # the hashes differ but the stored values do not: the file was changed after it was recorded
    return {"clip_id": clip_id, "label": clip["label"], "stage": STAGE_OF[first], "changed": changed,
            "counted_in": "tick" if first == "ticks" else "frame",
            **(difference or {"channel": first, "tick": 0})}  # fmt: skip
