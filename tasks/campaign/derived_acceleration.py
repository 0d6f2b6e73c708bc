"""An accelerometer that is none: the logger computed its signal from the speed.

As a second measurement it would count the noise of the speed twice, and hide what an accelerometer tells: pitch and
slope. Receivers of satellites log such a signal beside the speed.
"""

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING
from tasks.campaign.channel_validation import ROUNDING_STEP
from tasks.campaign.signals import Signal

LIKE_ROUNDING = 1.2
"""Deviation from the rate of speed over that which rounding of both explains, up to which they are one signal [1]."""
FINE = 0.05
"""Deviation by rounding up to which an accelerometer of its own is seen: slope and pitch add more [m/s^2]."""
EXACT = 0.6
"""Deviation over `FINE` up to which an acceleration is the rate of a coarser speed as logged, rounded itself [1]."""
ON_GRID = 0.01
"""Share of its resolution by which a rounded value misses a multiple of it at most [1]."""
CHANGING = 10.0
"""Standard deviation of the rate of speed over that deviation from which there is something to compare [1]."""
FEWEST_SAMPLES = 20
"""Samples of a moving car that are compared [1]."""
EVEN = 1.5
"""Steps of the clock up to which a rate is taken across them, in median steps [1]."""


def is_rate_of_speed(acceleration: Signal, speed: Signal) -> bool:
    """Return whether an acceleration equals a difference of the speed to rounding.

    Parameters
    ----------
    acceleration : on the logger's time, without correction of a delay [m/s^2]
    speed : on the same time [m/s]
    """
    if min(len(acceleration.time), len(speed.time)) < FEWEST_SAMPLES:
        return False
    step = np.diff(speed.time)
    usual = float(np.median(step))
    slope = np.diff(speed.values) / step
    even = (step < EVEN * usual) & (speed.values[1:] > MOVING)
    centred = (speed.values[2:] - speed.values[:-2]) / (speed.time[2:] - speed.time[:-2])
    rates = (
        (speed.time[1:-1], centred, even[1:] & even[:-1], 2.0 * usual),
        (speed.time[1:], slope, even, usual),
        (speed.time[:-1], slope, even, usual),
    )
    return any(_is_equal_to_rounding(acceleration, speed, *rate) for rate in rates)


def _is_equal_to_rounding(
    acceleration: Signal,
    speed: Signal,
    time: NDArray[np.float64],
    rate: NDArray[np.float64],
    usable: NDArray[np.bool_],
    span: float,
) -> bool:
    """Return whether an acceleration is a rate of speed that was taken over ``span`` [s], float64 [N] [m/s^2].

    It may be the rate of a finer speed than the logged one, where the rounding of the logged one is small. An
    accelerometer beside a speed of coarser rounding deviates by that rounding at least, and the rate of the logged
    speed itself by its own rounding alone. The rate of a finer speed is not told there: an inertial navigation system
    integrates its speed, so that its acceleration deviates by the rounding of the speed too.
    """
    if np.count_nonzero(usable) < FEWEST_SAMPLES:
        return False
    logged = np.interp(time[usable], acceleration.time, acceleration.values)
    rounding = float(
        np.hypot(
            _find_resolution(acceleration.values) / np.sqrt(12.0),
            _find_resolution(speed.values) / span / np.sqrt(6.0),
        )
    )
    rounding = max(rounding, ROUNDING_STEP * float(np.max(np.abs(rate[usable]))))
    allowed = LIKE_ROUNDING * rounding if rounding < FINE else EXACT * FINE
    deviation = float(np.sqrt(np.mean((logged - rate[usable]) ** 2)))
    enough = float(np.std(rate[usable])) > CHANGING * min(rounding, FINE)
    return enough and deviation <= allowed


def _find_resolution(values: NDArray[np.float64]) -> float:
    """Return the step of which all values of a signal are multiples; 0 where they are not rounded."""
    distinct = np.unique(values)
    steps = np.diff(distinct)
    steps = steps[steps > ROUNDING_STEP * float(np.max(np.abs(values)))]
    if not steps.size:
        return 0.0
    multiples = (distinct - distinct[0]) / np.min(steps)
    return float(np.min(steps)) if np.all(np.abs(multiples - np.round(multiples)) < ON_GRID) else 0.0
