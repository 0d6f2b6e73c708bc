"""Brake signal and throttle at rest: a gauge that reads more than 0 while nobody brakes, a command that idles above 0.

The model would brake with that pressure, and a fit would find a brake that does nothing below it. A run that seems to
brake from its first sample on does not tell what drove it before.

Throttle plates and pedals of many cars idle at 0.1 to 0.2 while the driver's foot is on the brake. Taken as logged, the
engine would drive the car through every stop, and a fit would find an engine that holds it back.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import MASKED_SPEED, Run
from tasks.campaign.gauge import RESTING_PRESSURE
from tasks.campaign.measured import smooth_channel

RELEASED = 0.1
"""Share of the run's range of pressure, from its lowest, within which the brake is taken to be released [1]."""
LOWEST = 0.05
"""Quantile of the pressure of a moving car that counts as its lowest [1]."""
SHORTEST_REST = 0.5
"""Time before the first application in which the pressure must rest [s]."""
STEADY = 0.02
"""Interquartile range of a pressure that rests at most; a foot on the pedal varies more [MPa]."""
ROLLING = 1.0
"""Deceleration of a car that rolls, in gear or on a slope, at most; 0.4 MPa of brake pressure give as much [m/s^2]."""
FEWEST_RUNS = 2
"""Runs that rest at one level from which it is the gauge's and not the driver's [1]."""
BRAKED = 0.5
"""Share of a run's range of pressure, from its lowest, above which its brake is applied [1]."""
LEAST_RANGE = 0.1
"""Range of pressure from which a run brakes at all [MPa]."""
LEAST_THROTTLE, MOST_THROTTLE = 0.02, 0.3
"""Throttle from which and up to which it may rest: sensors are off by less, a foot on both pedals reads more [1]."""


def measure_resting_levels(
    runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float
) -> dict[str, float]:
    """Return the pressure that the signal says before the first application, for each run in which it rests [MPa].

    Parameters
    ----------
    runs : channels of each run by name, each float64 [N], in campaign units
    interval : of their clock [s]
    """
    levels = {run: _measure_level(columns, interval) for run, columns in runs.items()}
    return {run: level for run, level in levels.items() if level is not None}


def find_brake_rest(levels: Mapping[str, float]) -> float:
    """Return what a signal says while nobody brakes: one level at which all runs rest; 0 where they differ [MPa].

    Pads that needed just that pressure to touch would brake by the same torque, so nothing is lost by taking it off.

    Parameters
    ----------
    levels : pressure at rest by run [MPa]
    """
    if len(levels) < FEWEST_RUNS:
        return 0.0
    values = np.array(list(levels.values()))
    level = float(np.median(values))
    return level if level > RESTING_PRESSURE and float(np.ptp(values)) <= RESTING_PRESSURE else 0.0


def _measure_level(columns: Mapping[str, NDArray[np.float64]], interval: float) -> float | None:
    """Return the pressure before the first application [MPa]; None where it does not rest there."""
    if not {"brake_pressure", "speed"} <= columns.keys():
        return None
    pressure = smooth_channel(columns["brake_pressure"], interval)
    speed = smooth_channel(columns["speed"], interval)
    moving = np.flatnonzero(speed > MASKED_SPEED)
    if not moving.size:
        return None
    lowest, highest = float(np.quantile(pressure[moving], LOWEST)), float(np.max(pressure[moving]))
    applied = np.flatnonzero(pressure > lowest + max(RELEASED * (highest - lowest), STEADY))
    before = moving[moving < (applied[0] if applied.size else len(pressure))]
    if len(before) * interval < SHORTEST_REST:
        return None
    low, level, high = np.quantile(pressure[before], (0.25, 0.5, 0.75))
    if high - low > STEADY:
        return None
    slower = float(speed[before[0]] - speed[before[-1]]) / (len(before) * interval)
    return float(level) if slower < ROLLING else None


def find_throttle_rest(runs: Sequence[Run]) -> float:
    """Return what the throttle reads while the brake is applied, the median over runs; 0 if it does not rest [1].

    Parameters
    ----------
    runs : that may be looked at
    """
    read = []
    for run in runs:
        lowest, span = float(np.min(run.pressure)), float(np.ptp(run.pressure))
        if run.throttle is not None and span > LEAST_RANGE:
            read.append(float(np.median(run.throttle[run.pressure > lowest + BRAKED * span])))
    rest = float(np.median(read)) if read else 0.0
    return rest if LEAST_THROTTLE < rest <= MOST_THROTTLE else 0.0
