"""The paper's figures of the brake dive: each drive predicted from the others, and their mean."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.pages.figures import Figure, Line, Panel, Style

CURVES = {
    "dive_deg": ("measured", Style("ink", "dashed")),
    "predicted_dive_deg": ("predicted", Style("a")),
}
TIME = "time from the event's start [s]"


def draw_dives(folds: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw a panel for each held-out drive, each curve over its own peak, and one of the mean over drives.

    Parameters
    ----------
    folds : of ``brake_protocol.json``, of one variant
    """
    panels = []
    for fold in folds:
        ratio, curves = fold["peak_ratio"], fold["mean_trajectory"]
        height = "" if ratio is None else f"peak ratio {ratio:.2f}, "
        panels.append(
            Panel(
                title=f"{fold['drive']}: {height}{fold['events']} events",
                x=TIME,
                y="dive over its own peak",
                lines=[
                    Line(
                        name=told, x=curves["time_s"], y=_divide_by_peak(np.array(curves[name])), style=style
                    )
                    for name, (told, style) in CURVES.items()
                ],
            )
        )
    return Figure(
        caption="Dive of each drive, predicted from the others, and its mean",
        panels=[*panels, _draw_mean(folds)],
        columns=4,
    )


def _draw_mean(folds: Sequence[Mapping[str, Any]]) -> Panel:
    """Draw the mean over drives in degrees, with one standard deviation, where all drives have values."""
    time = np.array(min((fold["mean_trajectory"]["time_s"] for fold in folds), key=len))
    lines = []
    for name, (told, style) in CURVES.items():
        curves = np.stack([np.array(fold["mean_trajectory"][name])[: len(time)] for fold in folds])
        middle, spread = curves.mean(axis=0), curves.std(axis=0)
        band = Line(name=told, x=time, y=middle, low=middle - spread, high=middle + spread, style=style)
        lines.append(band)
    return Panel(title="mean of drives ±1 std. deviation", x=TIME, y="dive [deg]", lines=lines)


def _divide_by_peak(curve: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a curve over its value farthest from 0; one that stays at 0 is left as it is."""
    peak = float(np.max(np.abs(curve), initial=0.0))
    return curve / peak if peak > 0.0 else curve
