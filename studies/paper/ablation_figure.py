"""The panels of the paper's ablation figure."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.pages.figures import Figure, Line, Panel, Style

STYLES = {
    "appearance-only": Style("e"),
    "vertical-only": Style("c"),
    "fixed-mu": Style("d"),
    "full": Style("a"),
    "reference": Style("ink", "dashed"),
}
RATE = {"rain": "rain [mm/h]", "snow": "snow, water equivalent [mm/h]"}


def draw_ablation(
    stops: Sequence[Mapping[str, Any]],
    time: NDArray[np.float64],
    curves: Mapping[str, NDArray[np.float64]],
    pitch: Mapping[str, Mapping[str, Any]],
) -> Figure:
    """Draw stopping distance over rain and snow, and pitch over time.

    Parameters
    ----------
    stops : rows with variant, weather, precipitation_mm_h and stopping_distance_m
    time : [N] of the curves [s]
    curves : [N] pitch of each variant [deg]
    pitch : when each variant meets and leaves the hump, and stops
    """
    full = pitch["full"]
    end = full["stop_time_s"] or float(time[-1])
    hump = (full["front_axle_meets_hump_s"], full["front_axle_leaves_hump_s"])
    shown = time <= end + 0.6
    angle = Panel(
        title="braking onto a hump",
        y="pitch, nose down [deg]",
        lines=[Line(name=name, x=time[shown], y=curve[shown], style=STYLES[name]) for name, curve in curves.items()],
        shaded=[(full["brake_onset_s"], end), *([hump] if None not in hump else [])],
    )  # fmt: skip
    return Figure(
        caption="Stopping distance from 60 km/h and pitch, coupling by coupling; shaded: braking, and the front axle on"
        " the hump.",
        panels=[*(_draw_stops(kind, [row for row in stops if row["weather"] == kind]) for kind in RATE), angle],
        columns=3,
    )  # fmt: skip


def _draw_stops(kind: str, rows: Sequence[Mapping[str, Any]]) -> Panel:
    lines = []
    for variant in dict.fromkeys(row["variant"] for row in rows):
        mine = [row for row in rows if row["variant"] == variant]
        x, y = ([row[name] for row in mine] for name in ("precipitation_mm_h", "stopping_distance_m"))
        lines.append(Line(name=variant, x=x, y=y, style=STYLES[variant]))
    return Panel(title=f"stops in {kind}", x=RATE[kind], y="stopping distance [m]", lines=lines)
