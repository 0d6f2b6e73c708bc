"""Two datasets side by side: which clips differ, how far their labels moved, and which input can be why."""

from collections.abc import Mapping, Sequence
from math import isnan
from typing import Any

import numpy as np

from flows.making.plan import read_plan
from flows.store.address import open_for_reading
from flows.store.frames import read_clip
from flows.store.layout import Layout
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest
from flows.store.telemetry import read_columns
from manifests.canonical import content_id
from manifests.compare import find_row_difference
from manifests.explain import find_input_differences, find_reasons
from manifests.records import Receipt
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.eval.label_moves import compare_figures, compare_ticks


def compare_datasets(a: str, b: str, *, out: str | None = None) -> dict[str, Any]:
    """Compare two finished datasets clip by clip; clips are paired by their scenario and seed.

    Whether clips differ follows from the hashes that the manifests record, and not from the files.

    Parameters
    ----------
    a, b : sealed dataset folders
    out : folder for ``diff.json`` and ``diff.txt``; None writes none

    Returns
    -------
    ``same``, ``why[]`` (inputs that differ, to the value), ``clips[]`` that differ with ``labels`` in physical
    units, ``only_in_a``, ``only_in_b`` and ``summary``.

    Raises
    ------
    InputError
        If a folder is no sealed dataset, or its inputs are missing.
    """
    results = Outputs(out, "lab diff", "diff.json", "diff.txt")
    old, new = open_for_reading(a), open_for_reading(b)
    before, after = read_manifest(old), read_manifest(new)
    why = find_input_differences(before, after, _read_inputs(old, before), _read_inputs(new, after))
    pairs, only_in_a, only_in_b = pair_clips(before["clips"], after["clips"])
    rows = [row for x, y in pairs if (row := _clip_row(old, new, x, y, why)) is not None]
    result: dict[str, Any] = {
        "a": {"dataset": str(old), "run_id": before["run_id"]},
        "b": {"dataset": str(new), "run_id": after["run_id"]},
        "same": not (rows or only_in_a or only_in_b),
        "why": why,
        "clips": rows,
        "only_in_a": [clip["label"] for clip in only_in_a],
        "only_in_b": [clip["label"] for clip in only_in_b],
        "summary": {
            "compared": len(pairs),
            "changed": len(rows),
            "labels_changed": sum("ticks" in row["changed"] for row in rows),
            "largest": _find_largest_changes(rows),
        },
    }
    results.write_json("diff.json", result)
    results.write("diff.txt", format_text(result))
    return result


def pair_clips(
    ours: Sequence[Receipt], theirs: Sequence[Receipt]
) -> tuple[list[tuple[Receipt, Receipt]], list[Receipt], list[Receipt]]:
    """Pair clips of one scenario: first those of one seed, then the others in the order of each dataset.

    Parameters
    ----------
    ours, theirs : records of the clips of two datasets

    Returns
    -------
    The pairs, and the clips of each dataset that none of the other is left for.
    """
    waiting: dict[str, dict[str, Receipt]] = {}
    for clip in theirs:
        waiting.setdefault(content_id(clip["scenario"]), {})[clip["seed"]] = clip
    choices = [(clip, waiting.get(content_id(clip["scenario"]), {})) for clip in ours]
    found: dict[str, Receipt] = {}
    for by_seed in (True, False):
        for clip, left in choices:
            seed = clip["seed"] if by_seed else next(iter(left), None)
            if clip["clip_id"] not in found and seed in left:
                found[clip["clip_id"]] = left.pop(seed)
    pairs = [(clip, found[clip["clip_id"]]) for clip in ours if clip["clip_id"] in found]
    taken = {clip["clip_id"] for clip in found.values()}
    return (
        pairs,
        [clip for clip in ours if clip["clip_id"] not in found],
        [clip for clip in theirs if clip["clip_id"] not in taken],
    )


def format_text(result: Mapping[str, Any]) -> str:
    """The comparison in lines for people.

    Parameters
    ----------
    result : of `compare_datasets`
    """
    summary = result["summary"]
    lines = [
        f"{summary['changed']} of {summary['compared']} clips differ,"
        f" {summary['labels_changed']} of them in their labels"
    ]
    lines += [f"only in A: {label}" for label in result["only_in_a"]]
    lines += [f"only in B: {label}" for label in result["only_in_b"]]
    lines.append("inputs that differ:" if result["why"] else "no recorded input differs")
    for row in result["why"]:
        field = f"{row['input']} {row['path']}".strip()
        lines.append(f"  {field}: {row['a']} -> {row['b']} (reaches {', '.join(row['reaches'])})")
    for row in result["clips"]:
        because = ", ".join(row["why"]) or "no recorded input"
        lines.append(f"{row['label']}: {', '.join(row['changed'])} differ; can come from: {because}")
        for name, value in row["labels"].items():
            if value:
                lines.append(f"  {name}: {value:+.4g}" if "change" in name else f"  {name}: {value:.4g}")
    lines.append("compared by what the manifests record; musync verify holds the files of each against it")
    return "\n".join(lines) + "\n"


def _clip_row(
    old: Layout, new: Layout, a: Mapping[str, Any], b: Mapping[str, Any], why: list[dict[str, Any]]
) -> dict[str, Any] | None:
    names = dict.fromkeys([*a["content"], *b["content"]])
    changed = [name for name in names if a["content"].get(name) != b["content"].get(name)]
    if not changed:
        return None
    row: dict[str, Any] = {
        "label": a["label"],
        "clip_id_a": a["clip_id"],
        "clip_id_b": b["clip_id"],
        "changed": changed,
        "why": find_reasons(changed, why),
        "first": None,
        "picture": None,
    }
    moves = compare_figures(a["figures"], b["figures"])
    if "ticks" in changed:
        ours, theirs = _read_ticks(old, a), _read_ticks(new, b)
        moves |= compare_ticks(ours, theirs)
        channels = [channel.name for channel in TICK_CHANNELS if channel.name in ours.keys() | theirs.keys()]
        shared = [channel for channel in channels if channel in ours.keys() & theirs.keys()]
        first = find_row_difference(ours, theirs, shared) or find_row_difference(ours, theirs, channels)
        row["first"] = first and {
            "channel": first["channel"], "tick": first["tick"], "a": first["recorded"], "b": first["remade"]
        }  # fmt: skip
    if "rgb" in changed and "rgb" in a["content"].keys() & b["content"].keys():
        row["picture"] = _compare_pictures(old, new, a["index"], b["index"])
    return row | {"labels": {name: None if isnan(value) else value for name, value in moves.items()}}


def _read_ticks(layout: Layout, clip: Mapping[str, Any]) -> dict[str, np.ndarray]:
    folder = layout.telemetry / "ticks" / f"family={clip['scenario']['weather']}"
    return read_columns(folder, clip["clip_id"], most=read_plan(layout.root).ticks_per_clip)


def _compare_pictures(old: Layout, new: Layout, a: int, b: int) -> dict[str, float] | None:
    """Return the share of changed pixels and the mean change of their 8-bit values; None for pictures of two sizes."""
    ours, theirs = read_clip(old.frames, a, "rgb"), read_clip(new.frames, b, "rgb")
    if ours.shape[1:] != theirs.shape[1:]:
        return None
    count = min(len(ours), len(theirs))
    change = np.abs(ours[:count].astype(np.int16) - theirs[:count])
    return {
        "changed_pixels_share": float((change.max(axis=-1) > 0).mean()),
        "mean_change_8bit": float(change.mean()),
    }


def _read_inputs(layout: Layout, manifest: Mapping[str, Any]) -> dict[str, bytes]:
    files = {name: layout.inputs / name for name in manifest["inputs"]}
    missing = [file for file in files.values() if not file.is_file()]
    if missing:
        raise InputError([f"{file}: the manifest names this input, but it is not there" for file in missing])
    return {name: file.read_bytes() for name, file in files.items()}


def _find_largest_changes(rows: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return, for each label, the clip with the largest change."""
    largest: dict[str, dict[str, Any]] = {}
    for row in rows:
        for name, value in row["labels"].items():
            if value is not None and abs(value) > abs(largest.get(name, {"value": 0.0})["value"]):
                largest[name] = {"value": value, "label": row["label"]}
    return largest
