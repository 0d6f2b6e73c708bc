"""Tables over judged campaigns: outcomes by effect and size, F1, bias and coverage with exact intervals.

F1, bias of parameters and coverage are those that LISDD reports (Wang 2026, arXiv:2606.23215).
"""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest

from studies.double_track.outcomes import OUTCOMES

Rows = Sequence[dict[str, Any]]
GROUPS = ("null", "standard", "further", "forms")


def summarise(rows: Rows) -> dict[str, Any]:
    """Figures of one set of channels.

    Parameters
    ----------
    rows : judged campaigns
    """
    effects = [row for row in rows if row["group"] in ("standard", "further")]
    estimates = [row for row in effects if row.get("estimate")]
    relative = [row["estimate"]["value"] / row["estimate"]["truth"] - 1.0 for row in estimates]
    honest = [row for row in estimates if row["same_form"]]
    times = [row["cpu_s"] for row in rows if "cpu_s" in row]
    return {
        "campaigns": len(rows),
        "groups": {
            group: {
                outcome: share(sum(row["outcome"] == outcome for row in own), len(own))
                for outcome in OUTCOMES
            }
            for group in GROUPS
            if (own := [row for row in rows if row["group"] == group])
        },
        "sizes": {
            str(size + 1): dict(Counter(row["outcome"] for row in effects if row["size"] == size))
            for size in sorted({row["size"] for row in effects})
        },
        "f1": find_f1(rows),
        "bias": {
            "mean_relative": float(np.mean(relative)) if relative else None,
            "mean_absolute_relative": float(np.mean(np.abs(relative))) if relative else None,
            "of": len(relative),
        },
        "coverage": share(sum(_covered(row) for row in honest), len(honest)),
        "coverage_with_other_forms": share(sum(_covered(row) for row in estimates), len(estimates)),
        "cpu_s": {"mean": float(np.mean(times)), "max": float(np.max(times))} if times else None,
    }


def find_f1(rows: Rows) -> dict[str, float | None]:
    """Precision, recall and F1 of names: each named effect or form is one claim, each effect in the data one truth.

    A set claims its first member only.

    Parameters
    ----------
    rows : judged campaigns
    """
    right = claimed = true = 0
    for row in rows:
        named = row.get("named", [])
        claimed += len(named)
        if row["group"] == "null":
            continue
        true += 1
        if row["form"] is None:
            right += any(name == row["library"] for name, _, _ in named)
        else:
            wanted = [row["form"]["port"], row["form"]["variable"]]
            right += any(found[1:] == wanted for found in named)
    precision, recall = (right / claimed if claimed else None), (right / true if true else None)
    f1 = 2.0 * right / (claimed + true) if claimed + true else None
    return {"precision": precision, "recall": recall, "f1": f1}


def share(hits: int, of: int) -> dict[str, Any]:
    """Count with its share and exact 95 % interval (Clopper and Pearson 1934).

    Parameters
    ----------
    hits, of : counts
    """
    if of == 0:
        return {"hits": 0, "of": 0, "share": None, "low": 0.0, "high": 1.0}
    interval = binomtest(hits, of).proportion_ci(method="exact")
    return {
        "hits": hits,
        "of": of,
        "share": hits / of,
        "low": float(interval.low),
        "high": float(interval.high),
    }


def _covered(row: dict[str, Any]) -> bool:
    estimate = row["estimate"]
    return bool(estimate["low"] <= estimate["truth"] <= estimate["high"])


def format_tables(rows: Rows, channels: str) -> str:
    """Markdown: figures, outcomes by group, by size, and by effect, and every campaign that is not right.

    Parameters
    ----------
    rows : judged campaigns
    channels : the set that they were judged with
    """
    figures = summarise(rows)
    parts = [f"# Double-track car, channels: {channels}", f"{len(rows)} campaigns."]
    parts.append(_outcome_table("group", GROUPS, rows, lambda row: row["group"]))
    sizes = [row for row in rows if row["group"] in ("standard", "further")]
    parts.append(
        _outcome_table("size", sorted({row["size"] for row in sizes}), sizes, lambda row: row["size"])
    )
    effects = list(dict.fromkeys(row["effect"] for row in rows if row["effect"]))
    parts.append(_outcome_table("effect", effects, rows, lambda row: row["effect"]))
    f1, bias, covered = figures["f1"], figures["bias"], figures["coverage"]
    lines = [
        f"- F1 {_text(f1['f1'])}, precision {_text(f1['precision'])}, recall {_text(f1['recall'])}",
        f"- bias of the first parameter, relative: {_text(bias['mean_relative'])}; size of the error"
        f" {_text(bias['mean_absolute_relative'])}; {bias['of']} estimates",
        f"- truth within its 95 % interval: {covered['hits']} of {covered['of']}"
        f" ({covered['low']:.3f} to {covered['high']:.3f})",
    ]
    if figures["cpu_s"]:
        lines.append(
            f"- CPU-seconds a verdict: mean {figures['cpu_s']['mean']:.1f}, most {figures['cpu_s']['max']:.1f}"
        )
    parts.append("\n".join(lines))
    parts.append("\n".join(_miss(row) for row in rows if row["outcome"] != "exact"))
    return "\n\n".join(part for part in parts if part) + "\n"


def _outcome_table(head: str, keys: Sequence[Any], rows: Rows, key: Callable[[dict[str, Any]], Any]) -> str:
    lines = [f"| {head} | campaigns | " + " | ".join(OUTCOMES) + " |", "| --- " * (len(OUTCOMES) + 2) + "|"]
    for entry in keys:
        own = [row["outcome"] for row in rows if key(row) == entry]
        if own:
            shown = entry + 1 if isinstance(entry, int) else entry
            counts = " | ".join(str(own.count(outcome) or "") for outcome in OUTCOMES)
            lines.append(f"| {shown} | {len(own)} | {counts} |")
    return "\n".join(lines) if len(lines) > 2 else ""


def _miss(row: dict[str, Any]) -> str:
    values = ", ".join(f"{name} {value:.4g}" for name, value in row["values"].items())
    named = ", ".join(found[0] for found in row.get("named", [])) or "; ".join(row["reasons"][:1])
    rivals = f"; not told from {', '.join(row['rivals'])}" if row.get("rivals") else ""
    return f"- {row['campaign']} ({values}): {row['outcome']}: {row['verdict']} {named}{rivals}"


def _text(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
