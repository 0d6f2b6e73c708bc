"""The paper's figure of recovered motion: change of progress in weather, pitch over a road feature, by visual seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flows.drawing import escape_formulas
from tasks.eval.video_motion import MotionProtocol

Floats = NDArray[np.float64]
COLOURS = {"photometric": "#1f6fb2", "pnp": "#c0392b", "essential": "#2e8b57"}
OTHERS = ("#1f6fb2", "#c0392b", "#2e8b57", "#b8860b", "#7d5ba6", "#5f6b73")
"""Of curves that are no method of ours."""
PROGRESS, PITCH = "change of progress [1]", "pitch of the event [deg]"
LEAST_SPAN = {PROGRESS: 0.02, PITCH: 0.25}
"""Half of the least range that a panel spans, so that noise looks like noise."""


@dataclass(frozen=True, kw_only=True)
class MotionPanel:
    """One condition: what was meant, and what was recovered of it.

    Parameters
    ----------
    title : of the condition
    quantity : `PROGRESS` or `PITCH`
    times : float64 [F] [s]
    meant : float64 [F] NaN where it is not known [unit of the quantity]
    recovered : float64 [S, F] by method or model, a row a visual seed [unit of the quantity]
    shaded : event window [s]; None for none
    """

    title: str
    quantity: str
    times: Floats
    meant: Floats
    recovered: Mapping[str, Floats]
    shaded: tuple[float, float] | None = None


def make_event_panel(
    title: str, times: Floats, meant: Floats, recovered: Mapping[str, Floats], opening: float
) -> MotionPanel:
    """Return the panel of a road feature, from the first flank of its event window to the end of the second.

    Parameters
    ----------
    title : of the condition
    times : float64 [F] [s]
    meant, recovered : as of `MotionPanel`, at those times [deg]
    opening : of the event window [s]
    """
    chosen = MotionProtocol()
    shown = (times >= opening + chosen.before[0] - 1e-9) & (times <= opening + chosen.after[1] + 1e-9)
    return MotionPanel(
        title=title,
        quantity=PITCH,
        times=times[shown],
        meant=meant[shown],
        recovered={name: values[:, shown] for name, values in recovered.items()},
        shaded=(opening + chosen.event[0], opening + chosen.event[1]),
    )


def draw_motion(panels: Sequence[MotionPanel], meant: str) -> Figure:
    """Draw the panels, two a line: black what is meant, in colour the mean over seeds with one standard deviation.

    Parameters
    ----------
    panels : one at least
    meant : what the black curve is, for the legend
    """
    lines = -(-len(panels) // 2)
    figure = Figure(figsize=(10, 2.6 * lines + 0.5), layout="constrained")
    axes = figure.subplots(lines, 2, squeeze=False).ravel()
    shown: dict[str, None] = {}
    for axis, panel in zip(axes, panels, strict=False):
        axis.axhline(0.0, color="#bbbbbb", lw=0.6, zorder=0)
        if panel.shaded is not None:
            axis.axvspan(*panel.shaded, color="#888888", alpha=0.15, lw=0)
        axis.plot(panel.times, panel.meant, color="black", lw=1.6, label=escape_formulas(meant))
        for name, values in panel.recovered.items():
            shown.setdefault(name)
            colour = COLOURS.get(name, OTHERS[list(shown).index(name) % len(OTHERS)])
            mean = values.mean(axis=0)
            axis.plot(panel.times, mean, color=colour, lw=1.0, label=escape_formulas(name))
            if len(values) > 1:
                spread = values.std(axis=0, ddof=1)
                axis.fill_between(panel.times, mean - spread, mean + spread, color=colour, alpha=0.2, lw=0)
        axis.set_title(escape_formulas(panel.title), fontsize=9)
        axis.set_xlabel("time [s]", fontsize=8)
        axis.set_ylabel(panel.quantity, fontsize=8)
        axis.tick_params(labelsize=7)
        low, high = axis.get_ylim()
        least = LEAST_SPAN[panel.quantity]
        axis.set_ylim(min(low, -least), max(high, least))
    for axis in axes[len(panels) :]:
        axis.set_axis_off()
    told = {
        label: line for axis in axes for line, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    figure.legend(told.values(), told.keys(), fontsize=8, ncols=4, loc="outside lower center", frameon=False)
    return figure
