"""A reproducibility audit: are the files those recorded, and do the same inputs still make the same bytes?"""

import math
import secrets
from collections.abc import Sequence
from typing import Any

from flows.auditing.audit_facts import collect_facts, format_present_time, list_unchecked, name_other_writers
from flows.auditing.audit_report import describe_unchecked, describe_verdict, format_text, write_audit_page
from flows.auditing.contradictions import find_contradictions
from flows.auditing.remaking import remake_and_compare
from flows.auditing.signing import signature_findings
from flows.auditing.verify import compare_files
from flows.making.input_changes import input_changes, scene_changes
from flows.running.failures import ClipsFailed
from flows.running.orchestration import run_as_stage
from flows.running.processors import count_processors
from flows.running.runner import RunnerName, check_runner
from flows.store.address import open_for_writing, want_everything
from flows.store.layout import OBJECTS, STAGED_TABLES
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest
from manifests.canonical import sha256_of
from manifests.explain import as_sentences, find_reasons
from manifests.records import Manifest, Receipt
from tasks.errors import InputError

__all__ = ["audit_dataset", "format_text"]

SEED_BITS = 32
"""Of a drawn seed [1]: enough that nobody foresees the draw, and few enough to type."""


def audit_dataset(
    dataset: str,
    *,
    share: float = 0.1,
    seed: int | None = None,
    key: str | None = None,
    out: str | None = None,
    runner: RunnerName = "dask",
    workers: int | None = None,
    scheduler: str | None = None,
) -> dict[str, Any]:
    """Verify every hash, hold all that any reader meets against the records, and a share of the clips against new ones.

    Parameters
    ----------
    dataset : a sealed dataset folder
    share : share of the clips to make again, at least one clip unless 0 [1]
    seed : of the draw of these clips; None draws by one that nobody knew before
    key : file with the signer's Ed25519 public key in PEM; None checks no signature
    out : folder for ``audit.html``, ``audit.json`` and ``audit.txt``; None writes none
    workers : how many at once; None takes another number than a generating run does by itself [1]

    Returns
    -------
    The audit: ``not_checked`` and ``verdict``, a sentence each; ``verified`` (all well); what
    `flows.auditing.audit_facts.collect_facts` says of dataset, tools and machine; ``files``, ``intact``, ``damaged[]``
    and ``unrecorded[]`` as of `flows.auditing.verify.compare_files`; ``signed``, ``signature``, ``signers``, ``key_id``
    and ``key_sha256`` as of `flows.auditing.signing.signature_findings`; ``contradictions[]`` as of
    `flows.auditing.contradictions.find_contradictions`; ``unchecked[]``, what was left out and why, as of
    `flows.auditing.audit_facts.list_unchecked`; ``share`` and ``seed`` of the draw; ``rerun[]``, ids of the clips made
    again, and ``remade[]``, the same with label and outcome; ``compared``, how many tables and arrays of them;
    ``mismatches[]``, each with where it differs first and the inputs that can be ``why``; ``differences[]`` of inputs
    and tools between what made the dataset and what is here; ``not_remade[]``, why no clip could be made again;
    ``started_utc``, ``ended_utc``.

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
    started = format_present_time()
    changes: list[dict[str, Any]] = []
    mismatches: list[dict[str, Any]] = []
    not_remade: list[str] = []
    workers = workers or other_count()
    seed = secrets.randbits(SEED_BITS) if seed is None else seed
    with open_for_writing(dataset, want_everything) as layout:
        manifest = read_manifest(layout, sealed=False)
        signature = signature_findings(layout, key)
        compared = run_as_stage(compare_files)(layout)
        facts = collect_facts(layout, manifest)
        damaged = {row["path"] for row in compared["damaged"]}
        contradictions, others = (
            ([], [])
            if "manifest.json" in damaged
            else run_as_stage(find_contradictions)(
                layout, manifest, damaged, not name_other_writers(manifest)
            )
        )
        chosen = draw_clips(manifest, share, seed)
        try:
            changes = input_changes(layout, manifest)
            if chosen:
                changes += scene_changes(layout, manifest)
                mismatches = run_as_stage(remake_and_compare)(
                    layout, manifest, chosen, runner, workers, scheduler
                )
        except (InputError, ClipsFailed) as error:
            chosen, not_remade = [], explain_failure(error)
    unchecked = list_unchecked(manifest, len(chosen), compared, others)
    differing = {row["clip_id"] for row in mismatches}
    result = {
        "verified": compared["verified"]
        and signature["signed"] is not False
        and not (contradictions or mismatches or not_remade),
        **facts,
        **{name: found for name, found in compared.items() if name != "verified"},
        **signature,
        "contradictions": contradictions,
        "unchecked": unchecked,
        "share": share,
        "seed": seed,
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
        "ended_utc": format_present_time(),
    }
    result = {"not_checked": describe_unchecked(unchecked), "verdict": describe_verdict(result), **result}
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
    tables = sum(name in (*STAGED_TABLES, OBJECTS) for name in contents)
    return {"tables": tables, "arrays": len(contents) - tables}


def other_count() -> int:
    """Another number of workers than a run takes by itself: bytes must not depend on it [1]."""
    return count_processors() - 1 or 2


def draw_clips(manifest: Manifest, share: float, seed: int) -> list[Receipt]:
    """A share of the clips, drawn by hash: the same seed draws the same clips of a dataset, spread over its grid.

    Parameters
    ----------
    manifest : of the dataset
    share : of its clips [1]
    seed : which the dataset's maker must not know beforehand, who could leave the clips that it draws as they are
    """
    count = math.ceil(share * len(manifest["clips"]))
    return sorted(manifest["clips"], key=lambda clip: sha256_of([f"{seed}/{clip['clip_id']}".encode()]))[
        :count
    ]


def explain_failure(error: InputError | ClipsFailed) -> list[str]:
    """Why clips could not be made again, a sentence each."""
    if isinstance(error, InputError):
        return list(error.problems)
    first = error.__cause__
    return [f"a clip ended in {type(first).__name__}: {first}"]
