"""The paper's figure of recovered motion: change of progress in weather, pitch over a road feature, by visual seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flows.pages.figures import Figure, Line, Panel, pick_style
from studies.evaluation.metrics.video_motion import MotionProtocol

Floats = NDArray[np.float64]
PROGRESS, PITCH = "change of progress", "pitch of the event [deg]"
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
    """Draw the panels, two a row: what is meant, and the mean over seeds with one standard deviation.

    Parameters
    ----------
    panels : one at least
    meant : what the curve of what is meant is, for the key
    """
    names = list(dict.fromkeys(name for panel in panels for name in panel.recovered))
    return Figure(
        caption=f"Recovered motion beside {meant}: mean over visual seeds, with one standard deviation where there are"
        " several; shaded: the event window.",
        panels=[_draw_panel(panel, meant, names) for panel in panels],
        columns=2,
    )  # fmt: skip


def _draw_panel(panel: MotionPanel, meant: str, names: Sequence[str]) -> Panel:
    lines = [Line(name=meant, x=panel.times, y=panel.meant)]
    for name, values in panel.recovered.items():
        mean = values.mean(axis=0)
        line = Line(name=name, x=panel.times, y=mean, style=pick_style(names.index(name)))
        if len(values) > 1:
            spread = values.std(axis=0, ddof=1)
            line = replace(line, low=mean - spread, high=mean + spread)
        lines.append(line)
    return Panel(
        title=panel.title,
        y=panel.quantity,
        lines=lines,
        shaded=[panel.shaded] if panel.shaded is not None else [],
        least=LEAST_SPAN[panel.quantity],
    )
