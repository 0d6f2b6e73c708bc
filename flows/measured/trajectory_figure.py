"""The paper's figure of trajectories: a reference case, what the models make of it, and what is left."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.pages.figures import Figure, Line, Panel, Style
from tasks.vehicle.rollout import Rollout

Curves = dict[str, NDArray[np.float64]]

QUANTITIES = {
    "speed": "speed [m/s]",
    "pitch": "pitch, nose down [deg]",
    "slip": "mean braking slip",
    "load": "load of a front wheel [N]",
}
"""The four quantities of the paper's figure, with their labels."""
POINTS = 800
"""Points of a curve that a figure of this size can show."""
STYLES = (Style("a"), Style("b"))


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
    thin = slice(None, None, max(len(reference["time"]) // POINTS, 1))
    time = reference["time"][thin]
    truth = {name: values[thin] for name, values in _read_reference(reference).items()}
    models = {
        told: {
            name: np.interp(time, ride.columns["t_ns"] * 1e-9, values, right=np.nan)
            for name, values in _read_ride(ride).items()
        }
        for told, ride in rides.items()
    }
    above, below = [], []
    for name, label in QUANTITIES.items():
        curves = [
            (told, model[name], style) for style, (told, model) in zip(STYLES, models.items(), strict=False)
        ]
        shown = [Line(name=told, x=time, y=y, style=style) for told, y, style in curves]
        left = [Line(name=told, x=time, y=y - truth[name], style=style) for told, y, style in curves]
        reference_line = Line(name="reference", x=time, y=truth[name], style=Style("ink", "dashed"))
        above.append(Panel(y=label, lines=[reference_line, *shown], shaded=[window]))
        below.append(Panel(y="difference", lines=left, shaded=[window]))
    pairs = [[*above[k : k + 2], *below[k : k + 2]] for k in (0, 2)]
    return Figure(
        caption=f"{case}: reference, models, and what is left of each; shaded is what is scored",
        panels=[panel for pair in pairs for panel in pair],
        columns=2,
        linked=True,
        panel_px=190,
    )


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
