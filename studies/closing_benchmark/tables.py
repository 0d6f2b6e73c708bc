"""The benchmark's figures as the tables that the documents show."""

from collections.abc import Mapping, Sequence
from typing import Any

ASKED = {
    "library effect named exactly": "at least 90 %",
    "wrong single label": "at most 0.5 %",
    "truth within the 95 % interval": "93 to 97 %",
    "outside the library: form with right port and variable": "at least 80 %",
}
"""Required value of each figure that has one."""
KINDS = (
    "right",
    "right form",
    "set with truth",
    "refused",
    "form",
    "wrong form",
    "set without truth",
    "wrong",
)


def benchmark_tables(result: Mapping[str, Any]) -> str:
    """Markdown of a benchmark: figures beside what was asked, confusion, misses, power against size, time.

    Parameters
    ----------
    result : of `close_loop_benchmark`
    """
    rows = result["campaigns"]
    parts = [
        f"{len(rows)} campaigns judged by the engine {result['engine_sha256'][:12]}.",
        _table(("figure", "asked", "count", "share", "exact 95 % interval"), _figures(result)),
        _table(("CPU-seconds a verdict", "asked", "mean", "median", "most"), _times(result)),
        _table(("truth", *KINDS), _confusion(result["confusion"])),
        "\n".join(_misses(rows)),
        _table(("effect", "size", "named exactly", "share", "exact 95 % interval"), _power(result["power"])),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _table(head: Sequence[str], body: list[Sequence[str]]) -> str:
    if not body:
        return ""
    lines = [head, ["---"] * len(head), *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _share(entry: Mapping[str, Any]) -> list[str]:
    share = "-" if entry["share"] is None else f"{entry['share']:.2f}"
    return [f"{entry['hits']} of {entry['of']}", share, f"{entry['low']:.3f} to {entry['high']:.3f}"]


def _figures(result: Mapping[str, Any]) -> list[Sequence[str]]:
    null = ["false discoveries on nulls", "0", *_share(result["false_discoveries"])]
    return [null, *([e["figure"], ASKED.get(e["figure"], ""), *_share(e)] for e in result["summary"])]


def _times(result: Mapping[str, Any]) -> list[Sequence[str]]:
    words = {"null": "nothing missing", "effect": "an effect or a form", "pair": "two effects at once"}
    return [
        [
            words[kind],
            "mean 15, most 60",
            *(f"{times[key]:.1f}" for key in ("mean", "median", "max")),
        ]
        for kind, times in result["cpu_s"].items()
    ]


def _confusion(confusion: Mapping[str, Mapping[str, int]]) -> list[Sequence[str]]:
    return [[truth, *(str(counts.get(kind, "")) for kind in KINDS)] for truth, counts in confusion.items()]


def _misses(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line for every campaign that was neither right nor refused, and for every interval without its truth."""
    lines = []
    for row in rows:
        poor = "poor design, " if row["kind"].startswith("poor") else ""
        at = f"{row['truth'] or 'nothing missing'} ({poor}seed {row['seed']})"
        if row["outcome"] not in ("right", "right form", "both", "refused"):
            rivals = f"; not told from {', '.join(row['rivals'])}" if row["rivals"] else ""
            lines.append(f"- {at}: {row['verdict']} {', '.join(row['named'])}{rivals}")
        elif row["covered"] is False:
            lines.append(f"- {at}: named right, its truth outside the interval")
    return lines


def _power(power: Sequence[Mapping[str, Any]]) -> list[Sequence[str]]:
    return [
        [
            entry["truth"],
            ", ".join(f"{name} {value:g}" for name, value in entry["values"].items()),
            *_share(entry),
        ]
        for entry in power
    ]
