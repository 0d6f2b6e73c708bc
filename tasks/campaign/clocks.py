"""Clocks of recordings: those that begin again, and those in another unit than the map says."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.channels import UNITS
from tasks.campaign.signals import Signal

RESTART = 1.0
"""Step back from which a clock has begun again, and does not merely stumble [s]."""
LEAST_FALL = 5.0
"""Of a speed from which its rate tells of its unit, and of the clock's [m/s]."""
RARE = 50
"""Samples of which one must belong to such a fall [1]."""
LIKE_UNITS_OF_SPEED = 4.0
"""Ratio of rates that two units of speed explain at most; more is a clock's [1]."""
SLOWEST_FALL = 0.02
"""Rate of a speed that falls so far: a fifth of what the rolling resistance of a car gives [m/s^2]."""
USUAL_FALL, LIKE = 4.0, 8.0
"""Deceleration of a stop [m/s^2], and the ratio to it within which a unit of time is likely [1]."""


def describe_restarts(time: NDArray[np.float64], table_row: int | None = None) -> str:
    """Return the problem of a clock that begins again, so that its times stand for several stretches; empty without.

    Parameters
    ----------
    time : float64 [N]; NaN where a row holds no time [s]
    table_row : number of the first row below the names; None where samples are counted
    """
    told = np.flatnonzero(np.isfinite(time))
    back = np.flatnonzero(np.diff(time[told]) < -RESTART)
    if not back.size:
        return ""
    kind, first = ("sample", 1) if table_row is None else ("row", table_row)
    numbers = [str(told[k + 1] + first) for k in back]
    shown = ", ".join(numbers[:5]) + (f" and {len(numbers) - 5} more" if len(numbers) > 5 else "")
    return (
        f"begins again at {kind}{'s' if len(numbers) > 1 else ''} {shown}{' below the names' if table_row else ''},"
        f" first from {time[told[back[0]]]:.3f} to {time[told[back[0] + 1]]:.3f} s: the same times stand for several"
        f" stretches, so cut the file before {'that' if len(numbers) == 1 else 'each such'} {kind}"
        " into files of their own"
    )


def measure_fall(time: NDArray[np.float64], speed: NDArray[np.float64]) -> float | None:
    """Return how fast the speed falls in its falls, over `LEAST_FALL` each [m/s^2]; None where there are none.

    A lost sample, or a few, makes no fall: one samples in `RARE` falls so far in the least number of steps that is
    looked at.

    Parameters
    ----------
    time : float64 [N] ascending [s]
    speed : float64 [N] [m/s]
    """
    step = 1
    while step < len(speed):
        fallen = speed[:-step] - speed[step:]
        far = fallen > LEAST_FALL
        if np.count_nonzero(far) * RARE > len(speed):
            rates = fallen[far] / np.maximum(time[step:] - time[:-step], 1e-12)[far]
            return float(np.median(rates))
        step *= 2
    return None


def describe_clock_scale(
    signals: Sequence[Signal], speed: Signal | None, taken: str, *, deceleration: float, shortest: float
) -> str:
    """Return the problem of a clock in another unit than it is taken to be in; empty where none is seen.

    Parameters
    ----------
    signals : of a recording
    speed : of the car [m/s]; None where it was not measured
    taken : unit of the clock in the map
    deceleration : that no road car exceeds [m/s^2]
    shortest : time between samples of a recording [s]
    """
    steps = [float(np.median(np.diff(signal.time))) for signal in signals if len(signal.time) > 1]
    step = min((step for step in steps if step > 0.0), default=0.0)
    fall = None if speed is None else measure_fall(speed.time, speed.values)
    fast = fall is not None and fall > LIKE_UNITS_OF_SPEED * deceleration
    slow = fall is not None and fall < SLOWEST_FALL
    if not step or not (step < shortest or fast or slow):
        return ""
    fits = {
        unit: abs(np.log(fall * UNITS[taken][1] / factor / USUAL_FALL))
        for unit, (kind, factor) in UNITS.items()
        if fall is not None and kind == "time" and unit != taken
    }
    near = min(fits, key=fits.__getitem__, default="")
    hint = f", it looks like {near}" if near and fits[near] < np.log(LIKE) else ""
    falls = f" and the speed falls by {fall:.2g} m/s^2" if fast or slow else ""
    return (
        f"samples come every {_write_time(step)}{falls}: the clock is not in {taken}{hint}: correct the unit of time in"
        " the map"
    )


def _write_time(seconds: float) -> str:
    """Return a time with a unit that makes it easy to read."""
    return f"{seconds:.3g} s" if seconds >= 0.1 else f"{1e3 * seconds:.3g} ms"
