"""Slopes of the road that no map names: an accelerometer reads gravity along them, and the rate of speed does not.

Scale, dive and delay of the two are the same in all runs, and a slope is not. The median over the runs of what the
accelerometer reads too much is its zero, and what a run reads beyond it is the slope of that run, as far as runs
scatter more than a zero drifts.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING
from tasks.campaign.channels import GRAVITY
from tasks.campaign.speed_by_acceleration import pair_samples, relate_speed_to_acceleration

DRIFT = 0.03
"""Standard deviation over the runs of a session of an accelerometer's zero [m/s^2]; on flat roads runs of five
simulators scatter by 0.002 to 0.02, on slopes of 1 to 2 % by 0.06 to 0.2."""
TOLD = 2.0
"""Drifts by which runs must scatter for their slopes to be told [1]."""
FEWEST_RUNS = 3
"""Runs of which a deviation is told [1]."""
STEEPEST = 0.2
"""Sine beyond which no slope is believed: the accelerometer is off by something else [1]."""
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
    apart = {run: zero for run, (zero, _) in measure_apart(runs, interval).items()}
    if not estimate_slopes(runs, interval) or float(np.std(list(apart.values()))) <= TOLD * DRIFT:
        return []
    low, high = min(apart, key=lambda run: apart[run]), max(apart, key=lambda run: apart[run])
    return [
        f"channel longitudinal_acceleration differs from the rate of speed by {apart[low]:.2f} ({low}) to"
        f" {apart[high]:.2f} m/s^2 ({high}) from run to run, besides what braking gives, as on slopes of"
        f" {100.0 * apart[low] / GRAVITY:.1f} to {100.0 * apart[high] / GRAVITY:.1f} %: close-loop takes each run"
        " for one slope; map road_slope, from altitude or the satellite receiver, for slopes that change within a run"
    ]


def estimate_slopes(
    runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float
) -> dict[str, float]:
    """Return the slope of the road in each run, uphill positive, by what its accelerometer reads [rad].

    The zeros of the runs scatter by slopes, by drift and by their errors; only the share of the slopes in that counts
    (James and Stein 1961). No run has a slope where there are fewer than three, or where they scatter no more than
    drift and errors explain.

    Parameters
    ----------
    runs : as in `describe_slopes`
    interval : of their clock [s]
    """
    apart = measure_apart(runs, interval)
    if len(apart) < FEWEST_RUNS:
        return {}
    zeros, errors = np.array(list(apart.values())).T
    share = 1.0 - (DRIFT**2 + float(np.mean(errors**2))) / max(float(np.var(zeros)), DRIFT**2)
    if share <= 0.0:
        return {}
    sines = share * (zeros - np.median(zeros)) / GRAVITY
    return dict(zip(apart, np.arcsin(np.clip(sines, -STEEPEST, STEEPEST)).tolist(), strict=True))


def measure_apart(
    runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float
) -> dict[str, tuple[float, float]]:
    """Return by how much the acceleration of each run differs from the rate of speed, and how surely [m/s^2].

    The road's slope is positive uphill. Runs without both channels, without motion, or with a mapped slope are left
    out.

    Parameters
    ----------
    runs : channels of each run by name, each float64 [N], in campaign units
    interval : of their clock [s]
    """
    both = {
        run: (columns["speed"], columns["longitudinal_acceleration"])
        for run, columns in runs.items()
        if {"speed", "longitudinal_acceleration"} <= columns.keys() and "road_slope" not in columns
    }
    pairs = {
        run: pair_samples(speed, felt, interval)[: find_stop(speed)] for run, (speed, felt) in both.items()
    }
    pairs = {run: pair for run, pair in pairs.items() if len(pair) * interval >= SHORTEST_RUN}
    found = relate_speed_to_acceleration(list(pairs.values()))
    if found is None:
        return {}
    return {
        run: (float(zero), float(error))
        for run, zero, error in zip(pairs, found.zeros, found.errors, strict=True)
        if np.isfinite(zero)
    }


def find_stop(speed: NDArray[np.float64]) -> int:
    """Return the number of samples until the car no longer moves.

    Parameters
    ----------
    speed : float64 [N] [m/s]
    """
    slow = np.flatnonzero(speed <= MOVING)
    return int(slow[0]) if slow.size else len(speed)
