"""ROC curves of the negative controls: one panel a fault, one curve a metric."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from flows.drawing import escape_formulas

COLUMNS = 4


def roc_figure(rows: Sequence[Mapping[str, Any]], meanings: Mapping[str, str]) -> Figure:
    """Detections over false alarms, by the method that parts a fault best.

    Parameters
    ----------
    rows : one for each control, method and metric, with auc and roc
    meanings : what each control does, in the order of the panels
    """
    tried = [name for name in meanings if any(row["control"] == name for row in rows)]
    metrics = sorted({row["metric"] for row in rows})
    colours = dict(zip(metrics, matplotlib.colormaps["tab20"].colors, strict=False))  # type: ignore[attr-defined]
    lines = -(-len(tried) // COLUMNS)
    figure = Figure(figsize=(2.9 * COLUMNS, 3.1 * lines), layout="constrained")
    panels = figure.subplots(lines, COLUMNS, squeeze=False, sharex=True, sharey=True).ravel()
    for axis, control in zip(panels, tried, strict=False):
        for metric in metrics:
            mine = [row for row in rows if (row["control"], row["metric"]) == (control, metric)]
            if mine:
                best = max(mine, key=lambda row: row["auc"])
                label = escape_formulas(f"{metric} ({best['method']}, {best['auc']:.2f})")
                axis.plot(
                    best["roc"]["false_alarms"],
                    best["roc"]["detections"],
                    color=colours[metric],
                    lw=1.4,
                    label=label,
                )
        axis.plot([0, 1], [0, 1], color="#aaaaaa", lw=0.8, ls=":")
        axis.set_title(f"{control}\n{meanings[control]}", fontsize=8)
        axis.legend(fontsize=5.5, loc="lower right")
        axis.set_xlabel("sound clips accused", fontsize=8)
    for axis in panels[len(tried) :]:
        axis.set_axis_off()
    panels[0].set_ylabel("faults seen", fontsize=8)
    return figure
