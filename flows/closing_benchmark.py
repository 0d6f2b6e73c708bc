"""The close-loop's own error rates: campaigns with a known truth, judged one by one, counted with exact intervals."""

import time
from collections import Counter
from pathlib import Path
from typing import Any

from catalogs.effects import load_effects
from catalogs.effects.truths import Truth, load_truths
from catalogs.surfaces import load_surface
from catalogs.vehicles import load_vehicle
from flows.store.layout import read_json, write_json
from manifests.provenance import code_version
from tasks.closure.benchmark import covered, exact_interval, outcome, synthetic_campaign
from tasks.closure.verdict import attribute

FILE = "closing-benchmark.json"
FIRST_NULL, FIRST_TRUTH = 1000, 5000
"""Seeds: of the first null, and of the first campaign of the first truth; 100 apart from truth to truth."""


def close_loop_benchmark(
    *, out: str, seeds: int = 10, nulls: int = 100, minutes: float = 1e9, vehicle: str = "paper-reference"
) -> dict[str, Any]:
    """Judge synthetic campaigns with known truths; what an earlier call with the same code made is kept.

    Parameters
    ----------
    out : folder for ``closing-benchmark.json``
    seeds : campaigns of each truth
    nulls : campaigns of a model that lacks nothing
    minutes : no campaign is begun after so long
    vehicle : catalogue name or file
    """
    path = Path(out) / FILE
    made_with = code_version()
    rows: list[dict[str, Any]] = []
    if path.is_file() and (known := read_json(path))["made_with"] == made_with:
        rows = known["campaigns"]
    done = {(row["truth"], row["seed"]) for row in rows}
    truths = load_truths()
    # nulls and truths take turns, so that whatever time there is covers both
    plan: list[tuple[int, Truth | None, int]] = [(i, None, FIRST_NULL + i) for i in range(nulls)]
    plan += [
        (i * nulls // max(seeds, 1), truth, FIRST_TRUTH + 100 * j + i)
        for j, truth in enumerate(truths)
        for i in range(seeds)
    ]
    plan.sort(key=lambda entry: (entry[0], entry[2]))
    model, surface, effects = load_vehicle(vehicle), load_surface("dense-asphalt"), load_effects()
    started = time.monotonic()
    for _, truth, seed in plan:
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
        verdict = attribute(campaign, model, surface, library).verdict
        rows.append(
            {
                "truth": name,
                "seed": seed,
                "in_library": truth is not None and truth.in_library,
                "verdict": verdict.verdict,
                "outcome": outcome(verdict, truth.name if truth else None, truth.form if truth else None),
                "named": [effect.name for effect in verdict.effects],
                "rivals": [rival.name for _, rival in verdict.rivals],
                "ports": [[effect.port, effect.variable] for effect in verdict.effects],
                "covered": covered(verdict, truth.name, truth.values) if truth else None,
                "cpu_s": time.process_time() - before,
            }
        )
        write_json(path, summary(rows) | {"campaigns": rows, "made_with": made_with})
    result = summary(rows) | {"campaigns": rows, "made_with": made_with}
    write_json(path, result)
    return result


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Confusion by truth and shares with exact 95 % intervals."""
    nulls = [row for row in rows if row["truth"] is None]
    library = [row for row in rows if row["truth"] and row["in_library"]]
    outside = [row for row in rows if row["truth"] and not row["in_library"]]
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
        "cpu_s_mean": sum(row["cpu_s"] for row in rows) / max(len(rows), 1),
        "cpu_s_max": max((row["cpu_s"] for row in rows), default=0.0),
    }
