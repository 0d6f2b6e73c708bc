"""Clocks of loggers in seconds, also of the digits of a time of day: 73059.95 is 7:30:59.95; falls of a speed."""

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.channels import unit_factor

TIME_OF_DAY = "HHMMSS"
"""Unit of such a clock in a channel map."""
DAY = 86400.0
"""Length of a day [s]."""


def convert_to_seconds(stamps: NDArray[np.float64], unit: str) -> NDArray[np.float64]:
    """Return the times of a logger in seconds, float64 [N] [s].

    Parameters
    ----------
    stamps : float64 [N] [``unit``]
    unit : of time, or `TIME_OF_DAY`; days, as of a spreadsheet or MATLAB's datenum, count from the first one's midnight
    """
    if unit == "d":
        known = stamps[np.isfinite(stamps)]
        return (stamps - np.floor(known[0] if known.size else 0.0)) * DAY
    return read_time_of_day(stamps) if unit == TIME_OF_DAY else stamps * unit_factor(unit, "s")


def read_time_of_day(stamps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the time since the midnight before the first stamp, float64 [N] [s].

    Parameters
    ----------
    stamps : float64 [N] digits of hours, minutes and seconds [1]; NaN where a row holds no time
    """
    hours, minutes = np.floor(stamps / 1e4), np.floor(stamps / 1e2) % 100.0
    return pass_midnight(np.asarray(3600.0 * hours + 60.0 * minutes + stamps % 100.0))


def pass_midnight(time: NDArray[np.float64], period: float = DAY) -> NDArray[np.float64]:
    """Return times of a clock that begins again after each period, as they go on, float64 [N] [s].

    Parameters
    ----------
    time : float64 [N]; NaN where a row holds no time [s]
    period : [s]
    """
    passed = time.copy()
    known = np.isfinite(time)
    passed[known] += period * np.cumsum(np.diff(time[known], prepend=time[known][:1]) < -0.5 * period)
    return passed


def has_digits_of_day(stamps: NDArray[np.float64]) -> bool:
    """Return whether all stamps can be times of day: no minute and no second reaches 60, no hour 24.

    Parameters
    ----------
    stamps : float64 [N] [1]
    """
    known = stamps[np.isfinite(stamps)]
    below = (known >= 0.0) & (known < 24e4) & (known % 1e4 < 6e3) & (known % 1e2 < 60.0)
    return bool(below.all())


def looks_like_time_of_day(time: NDArray[np.float64]) -> bool:
    """Return whether a clock that is taken for seconds jumps by 40 at a minute, and goes on as usual there.

    Parameters
    ----------
    time : float64 [N], N at least 2, ascending [s]
    """
    crossings = np.diff(np.floor(time / 1e2)) != 0.0
    if not crossings.any() or not has_digits_of_day(time):
        return False
    steps = np.diff(read_time_of_day(time))
    return bool(np.any(steps[crossings] < 2.0 * np.median(steps)))


def measure_fall(
    time: NDArray[np.float64], speed: NDArray[np.float64], *, least_fall: float, rare: float
) -> float | None:
    """Return how fast the speed falls in its far falls [m/s^2]; None where there are none.

    A lost sample, or a few, makes no fall: a share of the samples falls so far in the least number of steps that is
    looked at.

    Parameters
    ----------
    time : float64 [N] ascending [s]
    speed : float64 [N] [m/s]
    least_fall : of the speed from which its rate shows its unit, and that of the clock [m/s]
    rare : share of the samples that must belong to such a fall [1]
    """
    step = 1
    while step < len(speed):
        fallen = speed[:-step] - speed[step:]
        far = fallen > least_fall
        if np.count_nonzero(far) > rare * len(speed):
            rates = fallen[far] / np.maximum(time[step:] - time[:-step], 1e-12)[far]
            return float(np.median(rates))
        step *= 2
    return None
