"""Slopes of the road that no map names: an accelerometer reads gravity along them, and the rate of speed does not.

The accelerometer sits on the body and reads gravity along the dive as well, about 3 % of the deceleration, and its
scale may be off by as much. Both follow the deceleration within each run, and a slope does not; a speed that is late
follows the change of acceleration. Only what is left of the difference in each run is compared.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING
from tasks.campaign.channel_validation import smooth_channel
from tasks.campaign.channels import GRAVITY

LEAST_SPREAD = 0.2
"""Standard deviation over runs from which slopes are told [m/s^2]: 2 % of slope; an accelerometer drifts by 0.1."""
FEWEST_RUNS = 3
"""Runs of which a deviation is told [1]."""
SHORTEST_RUN = 1.0
"""Time in motion that a run needs to tell its mean [s]."""


def describe_slopes(runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float) -> list[str]:
    """Return a sentence if the acceleration is off the rate of speed by another amount in each run; else none.

    Parameters
    ----------
    runs : channels of each run by name, each float64 [N], in campaign units; the acceleration must be measured, and
        not computed from the speed
    interval : of their clock [s]
    """
    apart = measure_apart(runs, interval)
    if len(apart) < FEWEST_RUNS or float(np.std(list(apart.values()))) <= LEAST_SPREAD:
        return []
    low, high = min(apart, key=lambda run: apart[run]), max(apart, key=lambda run: apart[run])
    return [
        f"channel longitudinal_acceleration differs from the rate of speed by {apart[low]:.2f} ({low}) to"
        f" {apart[high]:.2f} m/s^2 ({high}) from run to run, besides what braking gives, as on slopes of"
        f" {100.0 * apart[low] / GRAVITY:.1f} to {100.0 * apart[high] / GRAVITY:.1f} %, which the model does not"
        " know: map road_slope, from altitude or the satellite receiver"
    ]


def measure_apart(runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float) -> dict[str, float]:
    """Return by how much the acceleration of each run differs from the rate of speed without braking [m/s^2].

    The road's slope is positive uphill. Runs without both channels, without motion, or with a mapped slope are left
    out.

    Parameters
    ----------
    runs : channels of each run by name, each float64 [N], in campaign units
    interval : of their clock [s]
    """
    parts = {
        run: _compare(columns, interval)
        for run, columns in runs.items()
        if {"speed", "longitudinal_acceleration"} <= columns.keys() and "road_slope" not in columns
    }
    parts = {run: part for run, part in parts.items() if len(part) * interval >= SHORTEST_RUN}
    if not parts:
        return {}
    within = np.concatenate([part - part.mean(axis=0) for part in parts.values()])
    shares = np.linalg.lstsq(within[:, 1:], within[:, 0], rcond=None)[0]
    return {run: float(np.mean(part[:, 0] - part[:, 1:] @ shares)) for run, part in parts.items()}


def _compare(columns: Mapping[str, NDArray[np.float64]], interval: float) -> NDArray[np.float64]:
    """Return difference and rate of speed [m/s^2] and rate of acceleration [m/s^3] in motion, float64 [M, 3]."""
    speed, felt = (smooth_channel(columns[name], interval) for name in ("speed", "longitudinal_acceleration"))
    if len(speed) < 2:
        return np.empty((0, 3))
    rate = np.gradient(speed, interval)
    return np.column_stack((felt - rate, rate, np.gradient(felt, interval)))[speed > MOVING]
