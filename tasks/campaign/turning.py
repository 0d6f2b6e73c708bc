"""Brake applications in a turn: the tyres then carry the car sideways too, which a model of a straight road lacks."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING, RELEASED
from tasks.campaign.channel_validation import smooth_channel
from tasks.campaign.channels import BRAKE_SIGNALS
from tasks.campaign.run_names import list_names

TURNING = 4.0
"""Acceleration to the side from which the tyres of a road car brake noticeably less: by 8 % on a dry road [m/s^2]."""
LEAST_DECELERATION = 1.0
"""Deceleration above which a sample counts as braking [m/s^2]."""
SHORTEST_TURN = 0.3
"""Time that a brake is applied in a turn from which the run is told [s]; a correction of the steering is shorter."""


def describe_turning(runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float) -> list[str]:
    """Return a sentence that lists the runs in which the car brakes while it turns; none if there is no such run.

    Parameters
    ----------
    runs : channels of each run by name, each float64 [N], in campaign units
    interval : of their clock [s]
    """
    found = {run: _measure_turn(columns, interval) for run, columns in runs.items()}
    turns = [
        f"{run} (up to {turn[1]:.3g} m/s^2 to the side, from {turn[0]:.2f} s into the run)"
        for run, turn in found.items()
        if turn is not None
    ]
    if not turns:
        return []
    return [
        f"the car brakes while it turns in {len(turns)} of {len(runs)} runs: {list_names(turns)}; the"
        " model drives straight on, and what the tyres lose to the turn reads as a brake that is late or weak: end"
        " such a run at turn-in"
    ]


def _measure_turn(columns: Mapping[str, NDArray[np.float64]], interval: float) -> tuple[float, float] | None:
    """Return when the car first brakes in a turn, from the run's first sample [s], and its largest acceleration to the
    side from then on [m/s^2]; None where it does not, or no channel tells it."""
    brake = next((name for name in BRAKE_SIGNALS if name in columns), None)
    sideways = _find_sideways(columns)
    if brake is None or sideways is None or "speed" not in columns:
        return None
    pressed, speed = smooth_channel(columns[brake], interval), smooth_channel(columns["speed"], interval)
    sideways = np.abs(smooth_channel(sideways, interval))
    braking = (speed > MOVING) & (pressed > RELEASED * float(np.max(pressed)))
    braking &= np.gradient(speed, interval) < -LEAST_DECELERATION
    turning = np.flatnonzero(braking & (sideways > TURNING))
    if len(turning) * interval < SHORTEST_TURN:
        return None
    centre = 0.5 * (len(columns[brake]) - len(pressed))
    return float((turning[0] + centre) * interval), float(np.max(sideways[turning]))


def _find_sideways(columns: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64] | None:
    """Return the acceleration to the side, float64 [N] [m/s^2]: measured, else of speed and yaw rate; None without."""
    if "lateral_acceleration" in columns:
        return columns["lateral_acceleration"]
    if {"speed", "yaw_rate"} <= columns.keys():
        return np.asarray(columns["speed"] * np.radians(columns["yaw_rate"]))
    return None
