"""Means of an evaluation's figures over clips and visual seeds, the paper's figure beside the mean over its clips."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.evaluation.judged_clip import JudgedClip, Row
from studies.evaluation.paper_metrics import ClipSet, load_printed_figures
from studies.evaluation.rows import figure_row, group_weather_families, read_visual_seed

SETS: dict[ClipSet, Callable[[dict[str, Any]], bool]] = {
    "stops": lambda c: c["peak_pressure_mpa"] > 0 and c["hazard_height_m"] == 0,
    "rain-stops": lambda c: SETS["stops"](c) and c["weather"] == "rain",
    "snow-stops": lambda c: SETS["stops"](c) and c["weather"] == "snow",
    "dry-features": lambda c: c["hazard_height_m"] != 0 and c["weather"] == "dry",
}
"""Which clips the paper's protocols take, by their facts."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a row's condition stands.

    Parameters
    ----------
    head : first part of the label, or the kind of weather of a family
    seed : visual seed, empty if there is but one
    facts : of the clip, of a family's heaviest
    """

    head: str
    seed: str
    facts: dict[str, Any]


def mean_rows(rows: Sequence[Row], clips: list[JudgedClip]) -> Iterator[Row]:
    """For each metric, method and window the mean of all figures, of each first part, and of the paper's clips.

    Figures are averaged within a seed, then over seeds, as Appendix A.5 says. A metric that was not run keeps the
    paper's figure beside the reason.

    Parameters
    ----------
    rows : single figures
    clips : as their judges saw them
    """
    places = _find_conditions(clips)
    groups: dict[tuple[str, str, int], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row["metric"], row["method"], row["window"]].append(row)
    for (metric, _, _), figures in groups.items():
        printed = load_printed_figures().get(metric, {})
        placed = [row for row in figures if row["condition"] in places]
        if not placed:
            for over, value in printed.items():
                yield {**figures[0], "condition": f"paper/{over}", "paper": value, "averaged": 0}
            continue
        yield _average_rows("all", placed, places)
        heads = dict.fromkeys(places[row["condition"]].head for row in placed)
        for head in heads:
            mine = [row for row in placed if places[row["condition"]].head == head]
            if 1 < len(mine) < len(placed):
                yield _average_rows(f"{head}/all", mine, places)
        for over, value in printed.items():
            mine = [row for row in placed if SETS[over](places[row["condition"]].facts)]
            if mine:
                yield _average_rows(f"paper/{over}", mine, places, value)


def _find_conditions(clips: list[JudgedClip]) -> dict[str, Place]:
    places = {}
    for facts in (clip.facts for clip in clips):
        label = facts["label"]
        places[label] = Place(head=label.partition("/")[0], seed=read_visual_seed(label), facts=facts)
    for kind, condition, levels in group_weather_families(clips):
        facts = levels[-1].facts
        places[condition] = Place(head=kind, seed=read_visual_seed(facts["label"]), facts=facts)
    return places


def _average_rows(
    condition: str, rows: list[Row], places: dict[str, Place], paper: float | None = None
) -> Row:
    first, scored = rows[0], [row for row in rows if row["value"] is not None]
    seeds = [places[row["condition"]].seed for row in scored]
    values = average_within_seeds([row["value"] for row in scored], seeds)
    floors = [row["floor"] for row in scored]
    notes = [f"mean of {len(scored)}"]
    if len(scored) < len(rows):
        notes.append(f"{len(rows) - len(scored)} more without a value")
    if first["note"] and len({row["note"] for row in rows}) == 1:
        notes.append(first["note"])
    return figure_row(
        first["metric"], first["method"], condition, float(np.mean(values)) if values else None, first["unit"],
        note="; ".join(notes), window=first["window"],
        floor=None if not floors or None in floors else float(np.mean(average_within_seeds(floors, seeds))),
        paper=paper, averaged=len(scored),
        seed_std=float(np.std(values, ddof=1)) if len(values) > 1 else None,
    )  # fmt: skip


def average_within_seeds(values: Sequence[float], seeds: Sequence[str]) -> list[float]:
    """Return the mean of the values of each seed, in the order of their first values.

    Parameters
    ----------
    values : figures of one metric [any]
    seeds : visual seed of each
    """
    by_seed: dict[str, list[float]] = defaultdict(list)
    for value, seed in zip(values, seeds, strict=True):
        by_seed[seed].append(value)
    return [float(np.mean(mine)) for mine in by_seed.values()]
