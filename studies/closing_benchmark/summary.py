"""Counts over judged campaigns: shares with exact intervals, confusion by truth, power by size, time."""

import json
from collections import Counter
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from scipy.special import betaincinv

from tasks.identification.decision.answer import Verdict

Rows = list[dict[str, Any]]
KINDS = {"null", "library", "outside", "size", "pair", "poor", "poor null"}


def classify_outcome(verdict: Verdict, truth: str | None, form: tuple[str, str] | None = None) -> str:
    """Return how a verdict compares with the truth: right, wrong, a set with or without the truth, a form, or refused.

    Parameters
    ----------
    verdict : verdict of `judge_runs`
    truth : name of the effect in the data; None where there is none
    form : port and variable of a truth outside the library
    """
    names = [effect.name for effect in verdict.effects]
    if truth is None:
        return "right" if not names else "false discovery"
    if not names:
        return "refused"
    if form is not None and verdict.verdict in ("UNKNOWN_FORM", "SET"):
        right = form in {(e.port, e.variable) for e in verdict.effects if e.effect_class == "form"}
        if verdict.verdict == "UNKNOWN_FORM":
            return "right form" if right else "wrong form"
        return "set with truth" if right else "set without truth"
    if verdict.verdict == "UNKNOWN_FORM":
        return "form"
    if verdict.verdict == "SET":
        contained = truth in {*names, *(rival.name for _, rival in verdict.rivals)}
        return "set with truth" if contained else "set without truth"
    return "right" if names == [truth] else "wrong"


def measure_interval_miss(verdict: Verdict, truth: str, values: Mapping[str, float]) -> float | None:
    """Return how far the truth is from the first parameter's value, in halves of its 95 % interval on that side [1].

    The interval holds the truth up to 1. None unless the truth alone is named.

    Parameters
    ----------
    verdict : verdict of `judge_runs`
    truth : name of the effect in the data
    values : its parameters by name [units of the table]
    """
    if [effect.name for effect in verdict.effects] != [truth]:
        return None
    first = verdict.effects[0].parameters[0]
    off = values[first.name] - first.value
    half = first.ci_high - first.value if off > 0.0 else first.value - first.ci_low
    return float(abs(off) / max(half, np.finfo(np.float64).tiny))


def compute_exact_interval(hits: int, trials: int) -> tuple[float, float]:
    """Return the Clopper-Pearson interval of 95 % of a share (Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404).

    Parameters
    ----------
    hits, trials : number of successes and of trials [1]
    """
    low = float(betaincinv(hits, trials - hits + 1, 0.025)) if hits else 0.0
    high = float(betaincinv(hits + 1, trials - hits, 0.975)) if hits < trials else 1.0
    return low, high


def pair_outcome(
    verdict: str, named: Collection[str], rivals: Collection[str], truths: Collection[str]
) -> str:
    """How a verdict stands to two effects at once.

    Parameters
    ----------
    verdict : FOUND, SET, ...
    named, rivals : effects that it names, and those that it cannot tell from them
    truths : effects in the data

    Returns
    -------
    both, one (and nothing else), set with truth, set without truth, form, wrong (something else is named), refused
    """
    if not named:
        return "refused"
    if verdict == "UNKNOWN_FORM":
        return "form"
    if verdict == "SET":
        return "set with truth" if set(truths) & {*named, *rivals} else "set without truth"
    if not set(named) <= set(truths):
        return "wrong"
    return "both" if len(set(named)) == len(set(truths)) else "one"


def summarise_benchmark(rows: Rows) -> dict[str, Any]:
    """Confusion by truth and shares with exact 95 % intervals.

    Parameters
    ----------
    rows : one for each campaign, of kind null, library, outside, size, pair, poor or poor null
    """
    of = {
        kind: [row for row in rows if row["kind"] == kind] for kind in {row["kind"] for row in rows} | KINDS
    }
    single = of["library"] + of["outside"]
    judged = [row for row in of["library"] if row["covered"] is not None]
    figures: list[tuple[str, dict[str, Any]]] = [
        ("library effect named exactly", _count(of["library"], "right")),
        ("library effect in the set", _count(of["library"], "set with truth")),
        ("wrong single label", _count(of["library"], "wrong")),
        ("set without the truth", _count(of["library"], "set without truth")),
        ("form given for a library effect", _count(of["library"], "form")),
        ("refused", _count(of["library"], "refused")),
        ("truth within the 95 % interval", _share(sum(row["covered"] for row in judged), len(judged))),
        ("outside the library: form with right port and variable", _count(of["outside"], "right form")),
        ("outside the library: wrong single label", _count(of["outside"], "wrong")),
        ("two effects at once: both named, nothing else", _count(of["pair"], "both")),
        ("two effects at once: one of them named, nothing else", _count(of["pair"], "one")),
        ("two effects at once: a set with one of them", _count(of["pair"], "set with truth")),
        (
            "two effects at once: something else named",
            _count(of["pair"], "wrong", "form", "set without truth"),
        ),
        ("poor design: named exactly", _count(of["poor"], "right")),
        ("poor design: in the set", _count(of["poor"], "set with truth")),
        ("poor design: refused", _count(of["poor"], "refused")),
        ("poor design: something else named", _count(of["poor"], "wrong", "form", "set without truth")),
        ("poor design: false discoveries on nulls", _count(of["poor null"], "false discovery")),
    ]
    return {
        "false_discoveries": _count(of["null"], "false discovery"),
        "summary": [{"figure": name, **share} for name, share in figures],
        "confusion": {
            truth: dict(sorted(Counter(row["outcome"] for row in single if row["truth"] == truth).items()))
            for truth in dict.fromkeys(row["truth"] for row in single)
        },
        "named_instead": {
            truth: dict(sorted(found.items()))
            for truth in dict.fromkeys(row["truth"] or "nothing" for row in single + of["null"])
            if (
                found := Counter(
                    name
                    for row in single + of["null"]
                    if (row["truth"] or "nothing") == truth
                    for name in row["named"]
                    if name != truth
                )
            )
        },
        "power": [
            {"truth": truth, "values": json.loads(values), **_count(group, "right")}
            for (truth, values), group in _grouped(of["size"]).items()
        ],
        "cpu_s": {
            kind: {"mean": sum(times) / len(times), "median": float(np.median(times)), "max": max(times)}
            for kind, group in (("null", of["null"]), ("effect", single), ("pair", of["pair"]))
            if (times := [row["cpu_s"] for row in group])
        },
    }


def _share(hits: int, of: int) -> dict[str, Any]:
    low, high = compute_exact_interval(hits, of) if of else (0.0, 1.0)
    return {"hits": hits, "of": of, "share": hits / of if of else None, "low": low, "high": high}


def _count(group: Rows, *outcomes: str) -> dict[str, Any]:
    return _share(sum(row["outcome"] in outcomes for row in group), len(group))


def _grouped(rows: Rows) -> dict[tuple[str, str], Rows]:
    groups: dict[tuple[str, str], Rows] = {}
    for row in rows:
        groups.setdefault((row["truth"], json.dumps(row["values"])), []).append(row)
    return groups
