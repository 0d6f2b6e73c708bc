"""The paper's figure of trajectories: a reference case, what the models make of it, and what is left."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flows.drawing import escape_formulas
from tasks.vehicle.rollout import Rollout

Curves = dict[str, NDArray[np.float64]]

QUANTITIES = {
    "speed": "speed [m/s]",
    "pitch": "pitch, nose down [deg]",
    "slip": "mean braking slip [1]",
    "load": "load of a front wheel [N]",
}
"""The four quantities of the paper's figure, with their labels."""
POINTS = 800
"""Points of a curve that a figure of this size can show."""
COLOURS = ("#1f6fb2", "#b8860b")


def draw_trajectories(
    case: str,
    reference: Mapping[str, NDArray[Any]],
    rides: Mapping[str, Rollout],
    window: tuple[float, float],
) -> Figure:
    """Draw the four quantities of a case over time, and below each the model less the reference.

    Parameters
    ----------
    case : its name
    reference : its trace, as `tasks.eval.state_agreement.case_agreement` takes it
    rides : of the models, by what they are called
    window : time that is scored [s]
    """
    figure = Figure(figsize=(10, 5.4), layout="constrained")
    figure.suptitle(f"{escape_formulas(case)}: shaded is what is scored", fontsize=10, x=0.01, ha="left")
    axes = figure.subplots(4, 2, sharex=True, height_ratios=(2, 1, 2, 1))
    thin = slice(None, None, max(len(reference["time"]) // POINTS, 1))
    time = reference["time"][thin]
    truth = {name: values[thin] for name, values in _read_reference(reference).items()}
    for place, (name, label) in enumerate(QUANTITIES.items()):
        row, column = divmod(place, 2)
        above, below = axes[2 * row][column], axes[2 * row + 1][column]
        above.plot(time, truth[name], color="#222222", ls=(0, (4, 2)), lw=1.2, label="reference")
        for colour, (told, ride) in zip(COLOURS, rides.items(), strict=False):
            model = np.interp(time, ride.columns["t_ns"] * 1e-9, _read_ride(ride)[name], right=np.nan)
            above.plot(time, model, color=colour, lw=1.2, label=told)
            below.plot(time, model - truth[name], color=colour, lw=1.0)
        above.set_ylabel(label, fontsize=8)
        below.set_ylabel("difference", fontsize=8)
        below.axhline(0.0, color="#bbbbbb", lw=0.6, zorder=0)
        for axis in (above, below):
            axis.axvspan(*window, color="#1f6fb2", alpha=0.06, lw=0)
            axis.tick_params(labelsize=8)
            axis.spines[["top", "right"]].set_visible(False)
    axes[0][0].legend(fontsize=7, frameon=False)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]", fontsize=8)
    return figure


def _read_reference(trace: Mapping[str, NDArray[Any]]) -> Curves:
    """Return the four quantities of a trace, the front wheels' and all wheels' means."""
    slips = [values for name, values in trace.items() if name.startswith("slip_")]
    loads = [values for name, values in trace.items() if name.startswith("wheel_load_f")]
    slip, load = np.mean(slips, axis=0), np.mean(loads, axis=0)
    return {"speed": trace["speed"], "pitch": trace["pitch"], "slip": slip, "load": load}


def _read_ride(ride: Rollout) -> Curves:
    """Return the four quantities of a rollout, in the units of a trace."""
    columns = ride.columns
    return {
        "speed": columns["speed"],
        "pitch": np.rad2deg(columns["pitch"] + ride.static_pitch),
        "slip": 0.5 * (columns["braking_slip_f"] + columns["braking_slip_r"]),
        "load": 0.5 * columns["axle_load_f"],
    }
