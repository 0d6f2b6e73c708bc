"""The close-loop's own error rates: campaigns with a known truth, judged one by one, counted with exact intervals."""

import json
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.effects import load_effects
from catalogs.effects.truths import Truth, load_sizes, load_truths
from catalogs.surfaces import load_surface
from catalogs.vehicles import load_vehicle
from flows.closing_benchmark_tables import benchmark_tables
from flows.store.layout import write_atomically, write_json
from manifests.canonical import sha256_of
from manifests.provenance import code_version, source_hashes
from tasks.closure.benchmark import covered, exact_interval, outcome, synthetic_campaign
from tasks.closure.verdict import attribute

FILE, TABLES, LOG = "closing-benchmark.json", "closing-benchmark.md", "campaigns.jsonl"
FIRST_NULL, FIRST_TRUTH, FIRST_SIZE = 200_000, 300_000, 400_000
"""Seeds: of the first null, of the first campaign of the first truth and of the first size; 100 apart from one truth
or size to the next. None of them has been used while the engine was made."""
SIZE_SEEDS = 5
"""Campaigns of each size of the power table."""
JUDGES = (
    "tasks/closure/",
    "tasks/vehicle/",
    "tasks/surface/",
    "catalogs/effects/",
    "catalogs/vehicles/paper",
)
"""Sources that a verdict depends on: campaigns judged by the same ones belong to one table."""


def close_loop_benchmark(
    *, out: str, seeds: int = 10, nulls: int = 100, minutes: float = 1e9, vehicle: str = "paper-reference"
) -> dict[str, Any]:
    """Judge synthetic campaigns with known truths; what an earlier call with the same engine made is kept.

    Every campaign is a line of ``campaigns.jsonl`` as soon as it is judged, so a stop at any time loses nothing. Seeds
    go round by round over all truths, so that whatever time there is covers them evenly.

    Parameters
    ----------
    out : folder for ``closing-benchmark.json``, its tables in Markdown and ``campaigns.jsonl``
    seeds : campaigns of each truth
    nulls : campaigns of a model that lacks nothing
    minutes : no campaign is begun after so long
    vehicle : catalogue name or file
    """
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    log, engine = folder / LOG, engine_hash()
    lines = log.read_text(encoding="utf-8").splitlines() if log.is_file() else []
    rows: list[dict[str, Any]] = [row for row in map(json.loads, lines) if row["engine"] == engine]
    done = {(row["truth"], row["seed"]) for row in rows}
    model, surface, effects = load_vehicle(vehicle), load_surface("dense-asphalt"), load_effects()
    started = time.monotonic()
    for kind, truth, seed in _plan(seeds, nulls):
        name = truth.name if truth else None
        if (name, seed) in done:
            continue
        if time.monotonic() - started > 60.0 * minutes:
            break
        library = tuple(e for e in effects if truth is None or e.name not in truth.left_out)
        before = time.process_time()
        campaign = synthetic_campaign(
            model, surface, truth.values if truth else {}, seed, slots=truth.slots if truth else ()
        )
        made = time.process_time()
        verdict = attribute(campaign, model, surface, library).verdict
        row = {
            "kind": kind,
            "truth": name,
            "values": truth.values if truth else {},
            "seed": seed,
            "verdict": verdict.verdict,
            "outcome": outcome(verdict, name, truth.form if truth else None),
            "named": [effect.name for effect in verdict.effects],
            "rivals": [rival.name for _, rival in verdict.rivals],
            "ports": [[effect.port, effect.variable] for effect in verdict.effects],
            "tried": [[effect.name, effect.score, effect.held_out_gain] for effect in verdict.tried[:3]],
            "covered": covered(verdict, truth.name, truth.values) if truth else None,
            "reasons": list(verdict.reasons),
            "cpu_s": time.process_time() - made,
            "made_cpu_s": made - before,
            "engine": engine,
        }
        rows.append(row)
        with log.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
    result = summary(rows) | {"campaigns": rows, "engine_sha256": engine, "made_with": code_version()}
    write_json(folder / FILE, result)
    write_atomically(folder / TABLES, benchmark_tables(result).encode())
    return result


def engine_hash() -> str:
    """SHA-256 over the sources that a verdict depends on."""
    judging = {path: digest for path, digest in source_hashes().items() if path.startswith(JUDGES)}
    return sha256_of(f"{path} {digest}\n".encode() for path, digest in sorted(judging.items()))


def _plan(seeds: int, nulls: int) -> Iterator[tuple[str, Truth | None, int]]:
    """Kind, truth and seed of every campaign, round by round over all truths, nulls and sizes spread over them."""
    truths, sizes = load_truths(), load_sizes()
    rounds = max(seeds, 1)
    for i in range(rounds):
        yield from (
            ("null", None, FIRST_NULL + n) for n in range(i * nulls // rounds, (i + 1) * nulls // rounds)
        )
        if i < seeds:
            for j, truth in enumerate(truths):
                yield "library" if truth.in_library else "outside", truth, FIRST_TRUTH + 100 * j + i
        if i < min(seeds, SIZE_SEEDS):
            for j, size in enumerate(sizes):
                yield "size", size, FIRST_SIZE + 100 * j + i


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Confusion by truth and shares with exact 95 % intervals."""
    nulls, library, outside, sizes = (
        [row for row in rows if row["kind"] == kind] for kind in ("null", "library", "outside", "size")
    )
    judged = [row for row in library if row["covered"] is not None]

    def share(hits: int, of: int) -> dict[str, Any]:
        low, high = exact_interval(hits, of) if of else (0.0, 1.0)
        return {"hits": hits, "of": of, "share": hits / of if of else None, "low": low, "high": high}

    def count(group: list[dict[str, Any]], *kinds: str) -> dict[str, Any]:
        return share(sum(row["outcome"] in kinds for row in group), len(group))

    confusion = {
        truth: dict(sorted(Counter(row["outcome"] for row in rows if row["truth"] == truth).items()))
        for truth in dict.fromkeys(row["truth"] for row in library + outside)
    }
    return {
        "false_discoveries": count(nulls, "false discovery"),
        "summary": [
            {"figure": "library effect named exactly", **count(library, "right")},
            {"figure": "library effect in the set", **count(library, "set with truth")},
            {"figure": "wrong single label", **count(library, "wrong")},
            {"figure": "set without the truth", **count(library, "set without truth")},
            {"figure": "form given for a library effect", **count(library, "form")},
            {"figure": "refused", **count(library, "refused")},
            {
                "figure": "truth within the 95 % interval",
                **share(sum(r["covered"] for r in judged), len(judged)),
            },
            {
                "figure": "outside the library: form with right port and variable",
                **count(outside, "right form"),
            },
            {"figure": "outside the library: wrong single label", **count(outside, "wrong")},
        ],
        "confusion": confusion,
        "power": [
            {"truth": truth, "values": json.loads(values), **count(group, "right")}
            for (truth, values), group in _grouped(sizes).items()
        ],
        "cpu_s": {
            kind: {"mean": sum(times) / len(times), "median": float(np.median(times)), "max": max(times)}
            for kind, group in (("null", nulls), ("effect", library + outside))
            if (times := [row["cpu_s"] for row in group])
        },
    }


def _grouped(rows: list[dict[str, Any]]) -> dict[tuple[str, str], list[dict[str, Any]]]:
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["truth"], json.dumps(row["values"])), []).append(row)
    return groups
