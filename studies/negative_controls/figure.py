"""ROC curves of the negative controls: one panel a fault, one curve a metric."""

from collections.abc import Mapping, Sequence
from typing import Any

from flows.pages.figures import Figure, Line, Panel, Style, pick_style

COLUMNS = 4
CHANCE = Line(name="chance", x=[0.0, 1.0], y=[0.0, 1.0], style=Style("soft", "dotted"))


def draw_roc(rows: Sequence[Mapping[str, Any]], meanings: Mapping[str, str]) -> Figure:
    """Draw detections over false alarms, by the method that parts a fault best.

    Parameters
    ----------
    rows : one for each control, method and metric, with auc and roc
    meanings : what each control does, in the order of the panels
    """
    metrics = sorted({row["metric"] for row in rows})
    panels = []
    for control, meaning in meanings.items():
        mine = [row for row in rows if row["control"] == control]
        best = [
            max((row for row in mine if row["metric"] == metric), key=lambda row: row["auc"])
            for metric in metrics
            if any(row["metric"] == metric for row in mine)
        ]
        lines = [
            Line(
                name=row["metric"], x=row["roc"]["false_alarms"], y=row["roc"]["detections"],
                style=pick_style(metrics.index(row["metric"])),
            )
            for row in best
        ]  # fmt: skip
        if lines:
            panels.append(
                Panel(
                    title=f"{control}\n{meaning}",
                    x="sound clips accused",
                    y="faults seen",
                    lines=[*lines, CHANCE],
                )
            )
    return Figure(caption="Faults seen over sound clips accused", panels=panels, columns=COLUMNS)
