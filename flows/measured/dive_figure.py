"""The paper's figures of the brake dive: each drive predicted from the others, and their mean."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flows.drawing import escape_formulas

MEASURED, PREDICTED = "#222222", "#1f6fb2"


def draw_dives(folds: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw a panel for each held-out drive, each curve over its own peak, and one of the mean over drives.

    Parameters
    ----------
    folds : of ``brake_protocol.json``, of one variant
    """
    figure = Figure(figsize=(3.1 * (len(folds) + 1), 2.8), layout="constrained")
    *panels, mean = figure.subplots(1, len(folds) + 1)
    for axis, fold in zip(panels, folds, strict=True):
        time, dive, predicted = (
            np.array(fold["mean_trajectory"][k]) for k in ("time_s", "dive_deg", "predicted_dive_deg")
        )
        axis.plot(time, _divide_by_peak(dive), color=MEASURED, ls=(0, (4, 2)), label="measured")
        axis.plot(time, _divide_by_peak(predicted), color=PREDICTED, label="predicted")
        ratio = fold["peak_ratio"]
        axis.set_title(
            f"{escape_formulas(fold['drive'])}: {'' if ratio is None else f'peak ratio {ratio:.2f}, '}"
            f"{fold['events']} events",
            fontsize=9, loc="left",
        )  # fmt: skip
    panels[0].set_ylabel("dive over its own peak [1]")
    panels[0].legend(fontsize=7, frameon=False)
    _draw_mean(mean, folds)
    for axis in (*panels, mean):
        axis.axhline(0.0, color="#bbbbbb", lw=0.6, zorder=0)
        axis.set_xlabel("time from the event's start [s]")
        axis.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_mean(axis: Axes, folds: Sequence[Mapping[str, Any]]) -> None:
    """Draw the mean over drives in degrees, with one standard deviation, where all drives have values."""
    time = np.array(min((fold["mean_trajectory"]["time_s"] for fold in folds), key=len))
    for name, colour, told in (
        ("dive_deg", MEASURED, "measured"),
        ("predicted_dive_deg", PREDICTED, "predicted"),
    ):
        curves = np.stack([np.array(fold["mean_trajectory"][name])[: len(time)] for fold in folds])
        middle, spread = curves.mean(axis=0), curves.std(axis=0)
        axis.fill_between(time, middle - spread, middle + spread, color=colour, alpha=0.15, lw=0)
        axis.plot(time, middle, color=colour, label=told)
    axis.set_ylabel("dive [deg]")
    axis.set_title("mean of drives ±1 std. deviation", fontsize=9, loc="left")


def _divide_by_peak(curve: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a curve over its value farthest from 0; one that stays at 0 is left as it is."""
    peak = float(np.max(np.abs(curve), initial=0.0))
    return curve / peak if peak > 0.0 else curve
