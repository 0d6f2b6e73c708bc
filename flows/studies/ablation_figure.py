"""The two panels of the paper's ablation figure."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

COLOURS = {
    "appearance-only": "#b8860b",
    "vertical-only": "#2e8b57",
    "fixed-mu": "#7b4fa3",
    "full": "#1f6fb2",
    "reference": "#222222",
}
BRAKING, HUMP = "#1f6fb2", "#b8860b"


def ablation_figure(
    stops: Sequence[Mapping[str, Any]],
    time: NDArray[np.float64],
    curves: Mapping[str, NDArray[np.float64]],
    pitch: Mapping[str, Mapping[str, Any]],
) -> Figure:
    """Stopping distance over rain and snow, and pitch over time.

    Parameters
    ----------
    stops : rows with variant, weather, precipitation_mm_h and stopping_distance_m
    time : [N] of the curves [s]
    curves : [N] pitch of each variant [deg]
    pitch : when each variant meets and leaves the hump, and stops
    """
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    rain, snow, angle = figure.subplots(1, 3, width_ratios=(1, 1, 1.6))
    for axis, kind in ((rain, "rain"), (snow, "snow")):
        _draw_stops(axis, [row for row in stops if row["weather"] == kind])
        axis.set_xlabel(f"{kind} [mm/h]" if kind == "rain" else "snow, water equivalent [mm/h]")
    snow.sharey(rain)
    rain.set_ylabel("stopping distance [m]")
    rain.set_title("(a) stops from 60 km/h", loc="left", fontsize=10)
    for name, curve in curves.items():
        style = (0, (4, 2)) if name == "reference" else "-"
        angle.plot(time, curve, color=COLOURS[name], lw=1.3, ls=style, label=name)
    full = pitch["full"]
    angle.axvspan(full["brake_onset_s"], full["stop_time_s"] or time[-1], color=BRAKING, alpha=0.07, lw=0)
    if full["front_axle_meets_hump_s"] is not None and full["front_axle_leaves_hump_s"] is not None:
        angle.axvspan(
            full["front_axle_meets_hump_s"], full["front_axle_leaves_hump_s"], color=HUMP, alpha=0.15, lw=0
        )
    angle.set_xlim(0.0, (full["stop_time_s"] or time[-1]) + 0.6)
    angle.set_xlabel("time [s]")
    angle.set_ylabel("pitch, nose down [deg]")
    angle.set_title("(b) braking onto a hump; shaded: braking, front axle on it", loc="left", fontsize=10)
    angle.legend(fontsize=7, loc="upper right")
    for axis in (rain, snow, angle):
        axis.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_stops(axis: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    for variant in dict.fromkeys(row["variant"] for row in rows):
        mine = [row for row in rows if row["variant"] == variant]
        axis.plot(
            [row["precipitation_mm_h"] for row in mine],
            [row["stopping_distance_m"] for row in mine],
            color=COLOURS[variant],
            lw=1.5,
            label=variant,
        )
