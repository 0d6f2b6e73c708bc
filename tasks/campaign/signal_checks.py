"""What checks measure of the signals of a run: samples, clocks, stuck sensors, and signals beside each other.

What the conditions of each function mean stands in ``catalogs/campaign_checks.yaml``.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import LEAST_SAMPLES, MASKED_SPEED
from tasks.campaign.channels import CHANNELS_BY_NAME, UNITS
from tasks.campaign.checks import Figure, Measure
from tasks.campaign.clocks import looks_like_time_of_day
from tasks.campaign.measured import LoggedSignal, Stretch
from tasks.campaign.signals import Signal, make_common_clock

ROUNDING_STEP = 1e-6
"""Share of the largest value below which a step is rounding of a resampled value, and no step of the sensor [1]."""
ON_GRID = 0.01
"""Share of its resolution by which a rounded value misses a multiple of it at most [1]."""


def _count_samples(signal: LoggedSignal) -> Iterator[Figure]:
    """Return the number of samples [1]."""
    yield Figure(value=len(signal.logged.time), channel=signal.channel)


def _count_not_finite(signal: LoggedSignal) -> Iterator[Figure]:
    """Return the number of samples that are not numbers [1]."""
    bad = ~np.isfinite(signal.logged.values)
    if bad.any():
        at = float(signal.logged.time[np.argmax(bad)])
        yield Figure(value=int(np.count_nonzero(bad)), channel=signal.channel, words={"at": at})


def _judge_digits(signal: LoggedSignal) -> Iterator[Figure]:
    """Return 1 for a clock of the digits of hours, minutes and seconds that is taken for seconds, else 0."""
    yield Figure(value=looks_like_time_of_day(signal.logged.time), channel=signal.channel)


def _count_steps_back(signal: LoggedSignal) -> Iterator[Figure]:
    """Return the number of steps of the clock that do not advance [1]."""
    time = signal.logged.time
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0)
    if not back.size:
        return
    todo = "cut the run there"
    if np.all(steps[back] == 0):
        todo = (
            f"give repeats: keep_first under time in the map if the logger stamps samples twice, else {todo}"
        )
    words = {"start": time[back[0]], "end": time[back[0] + 1], "todo": todo}
    yield Figure(value=back.size, channel=signal.channel, words=words)


def _measure_gap(signal: LoggedSignal) -> Iterator[Figure]:
    """Return the longest step of the clock over the median one [1]."""
    time = signal.logged.time
    steps = np.diff(time)
    usual = float(np.median(steps)) if steps.size else 0.0
    if usual > 0:
        at = int(np.argmax(steps))
        words = {"start": time[at], "end": time[at + 1], "usual": usual}
        yield Figure(value=float(steps[at]) / usual, channel=signal.channel, words=words)


def _count_outliers(signal: LoggedSignal, *, few: float) -> Iterator[Figure]:
    """Return the number of samples beyond what a road car does, where they are too few for a wrong unit [1]."""
    if signal.stands_in:
        return
    low, high = signal.span
    values = signal.converted.values
    beyond = np.isfinite(values) & ((values > high) | (values < min(low, -high)))
    if 0 < np.count_nonzero(beyond) <= few * len(beyond):
        at = int(np.argmax(beyond))
        span = f"{high:g} {CHANNELS_BY_NAME[signal.channel].unit}"
        words = {"at": signal.logged.time[at], "logged": signal.logged.values[at], "span": span}
        yield Figure(value=int(np.count_nonzero(beyond)), channel=signal.channel, words=words)


def _measure_hold(
    signal: LoggedSignal,
    *,
    shortest: float,
    shortest_of_steady: float,
    times_usual: float,
    coarse_step: float,
) -> Iterator[Figure]:
    """Return the longest hold of one value in a moving car over the longest that a sound sensor has [1].

    A coarse sensor holds a value until its next step; after a freeze the next step is larger. A locked wheel reads 0.
    """
    time, values = signal.converted.time, signal.converted.values
    if len(time) < 3:
        return
    moving = np.ones(len(time), dtype=bool)
    if signal.speed is not None and len(signal.speed.time) > 1:
        moving = np.interp(time, signal.speed.time, signal.speed.values) > MASKED_SPEED
    differences = np.abs(np.diff(values))
    changes = np.flatnonzero(differences > ROUNDING_STEP * float(np.max(np.abs(values))))
    edges = np.concatenate(([0], changes + 1, [len(time) - 1]))
    dwells, enough = np.diff(time[edges]), len(changes) > 2
    usual, most = np.quantile(dwells, (0.5, 0.95)) if enough else (0.0, np.inf)
    jumps = differences[changes]
    beside = np.maximum(np.concatenate(([0.0], jumps)), np.concatenate((jumps, [0.0])))
    step = max(float(jumps.min()), _find_smallest_step(values, changes)) if enough else 0.0
    locked = values[edges[:-1]] == 0.0
    longest = np.maximum(shortest, times_usual * usual)
    of_steady = np.where(locked, np.inf, np.maximum(shortest_of_steady, times_usual * most))
    over = dwells / np.minimum(longest, of_steady)
    over[(beside < coarse_step * step) | ~moving[edges[:-1]]] = 0.0
    at = int(np.argmax(np.where(over >= 1.0, dwells, 0.0)))
    wheel = bool(locked[at]) and signal.channel.startswith("wheel_speed")
    words = {
        "said": "stands still, as a locked wheel or a dead sensor does" if wheel else "is frozen",
        "level": values[edges[at]],
        "seconds": dwells[at],
        "at": time[edges[at]],
    }
    yield Figure(value=float(over[at]), channel=signal.channel, words=words)


def _find_smallest_step(values: NDArray[np.float64], changes: NDArray[np.int64]) -> float:
    """Return the smallest change of a sensor, where one that a resampling split between two samples counts as one.

    Parameters
    ----------
    values : float64 [N]
    changes : samples after which the value is another one, int64 [M]
    """
    follows = np.diff(changes) == 1
    pairs = np.abs(values[changes[:-1] + 2 * follows] - values[changes[:-1]])[follows]
    alone = ~np.concatenate(([False], follows)) & ~np.concatenate((follows, [False]))
    whole = (changes > 0) & (changes < len(values) - 2)  # a run may begin or end within a split step
    single = np.abs(values[changes + 1] - values[changes])[alone & whole]
    return float(np.min(np.concatenate((pairs, single)), initial=np.inf))


def _measure_dead_source(signal: LoggedSignal, *, moved: float) -> Iterator[Figure]:
    """Return the range of a source over that of the one of its channel that moves most [1].

    No torque is judged, for an axle may drive or brake alone.
    """
    ranges = {name: _measure_range(other) for name, other in signal.others.items()}
    most = max(ranges, key=lambda name: ranges[name], default="")
    if not ranges or UNITS[signal.unit][0] == "torque" or not np.isfinite(signal.converted.values).any():
        return
    if ranges[most] >= moved * signal.span[1]:
        level = float(np.nanmedian(signal.converted.values))
        unit = CHANNELS_BY_NAME[signal.channel].unit
        words = {"source": signal.source, "level": level, "unit": unit, "other": most, "moves": ranges[most]}
        yield Figure(
            value=_measure_range(signal.converted) / ranges[most], channel=signal.channel, words=words
        )


def _measure_range(signal: Signal) -> float:
    """Return the range of what is finite of a signal; 0 where nothing is."""
    values = signal.values[np.isfinite(signal.values)]
    return float(np.ptp(values)) if values.size else 0.0


def _measure_coverage(stretch: Stretch) -> Iterator[Figure]:
    """Return the share of a run that each channel covers, where its own last step at either end counts [1].

    A receiver of 1 Hz has its first and its last sample up to a second within the run.
    """
    clocks = {name: [one.converted.time for one in signals] for name, signals in stretch.signals.items()}
    starts = {name: max(float(time[0]) for time in own) for name, own in clocks.items()}
    ends = {name: min(float(time[-1]) for time in own) for name, own in clocks.items()}
    first, last = min(starts.values()), max(ends.values())
    for name, own in clocks.items():
        step = max(float(np.median(np.diff(time))) for time in own)
        covered = min(ends[name] + step, last) - max(starts[name] - step, first)
        words = {"start": starts[name], "end": ends[name], "first": first, "last": last}
        if last > first:
            yield Figure(value=covered / (last - first), channel=name, words=words)


def _measure_rate(stretch: Stretch) -> Iterator[Figure]:
    """Return the campaign's rate over that of the fastest signal [1]."""
    signals = [one for own in stretch.signals.values() for one in own]
    fastest = min(float(np.median(np.diff(one.converted.time))) for one in signals)
    words = {"fastest": 1.0 / fastest, "rate": stretch.rate}
    yield Figure(value=stretch.rate * fastest, words=words)


def _count_spare_samples(stretch: Stretch) -> Iterator[Figure]:
    """Return the samples that all channels share beyond those that a run needs [1]."""
    count = len(
        make_common_clock([one.converted for own in stretch.signals.values() for one in own], stretch.rate)
    )
    words = {
        "count": count,
        "rate": stretch.rate,
        "needed": LEAST_SAMPLES,
        "seconds": LEAST_SAMPLES / stretch.rate,
    }
    yield Figure(value=count - LEAST_SAMPLES, words=words)


def _measure_computed_acceleration(stretch: Stretch, **conditions: float) -> Iterator[Figure]:
    """Return the deviation of the acceleration from the rate of speed, on the logger's time, over its rounding [1]."""
    acceleration, speed = (
        Signal(time=one.logged.time, values=one.converted.values)
        for one in (stretch.signals[name][0] for name in ("longitudinal_acceleration", "speed"))
    )
    over = compare_with_rate_of_speed(acceleration, speed, **conditions)
    yield Figure(value=over, channel="longitudinal_acceleration")


def compare_with_rate_of_speed(
    acceleration: Signal,
    speed: Signal,
    *,
    like_rounding: float,
    fine: float,
    exact: float,
    changing: float,
    fewest_samples: float,
    even: float,
) -> float:
    """Return the deviation of an acceleration from a difference of the speed over what rounding explains [1].

    It may be the rate of a finer speed than the logged one, where the rounding of the logged one is small. An
    accelerometer beside a speed of coarser rounding deviates by that rounding at least, and the rate of the logged
    speed itself by its own rounding alone. The rate of a finer speed is not known there: an inertial navigation system
    integrates its speed, so that its acceleration deviates by the rounding of the speed too. Infinite where too little
    changes to tell.

    Parameters
    ----------
    acceleration : on the logger's time, without correction of a delay [m/s^2]
    speed : on the same time [m/s]
    like_rounding : deviation over that which rounding of both explains, up to which they are one signal [1]
    fine : deviation by rounding up to which an accelerometer of its own is seen; slope and pitch add more [m/s^2]
    exact : share of ``fine`` by which the rate of a coarser speed as logged, rounded itself, deviates at most [1]
    changing : deviation of the rate of speed over that of rounding from which there is something to compare [1]
    fewest_samples : of a moving car that are compared [1]
    even : steps of the clock up to which a rate is taken across them, in median steps [1]
    """
    if min(len(acceleration.time), len(speed.time)) < fewest_samples:
        return np.inf
    step = np.diff(speed.time)
    usual = float(np.median(step))
    slope = np.diff(speed.values) / step
    usable = (step < even * usual) & (speed.values[1:] > MASKED_SPEED)
    centred = (speed.values[2:] - speed.values[:-2]) / (speed.time[2:] - speed.time[:-2])
    rates = (
        (speed.time[1:-1], centred, usable[1:] & usable[:-1], 2.0 * usual),
        (speed.time[1:], slope, usable, usual),
        (speed.time[:-1], slope, usable, usual),
    )
    resolutions = [_find_resolution(signal.values) for signal in (acceleration, speed)]
    least = np.inf
    for time, rate, chosen, span in rates:
        if np.count_nonzero(chosen) < fewest_samples:
            continue
        logged = np.interp(time[chosen], acceleration.time, acceleration.values)
        rounding = float(np.hypot(resolutions[0] / np.sqrt(12.0), resolutions[1] / span / np.sqrt(6.0)))
        rounding = max(rounding, ROUNDING_STEP * float(np.max(np.abs(rate[chosen]))))
        allowed = like_rounding * rounding if rounding < fine else exact * fine
        if float(np.std(rate[chosen])) > changing * min(rounding, fine):
            deviation = float(np.sqrt(np.mean((logged - rate[chosen]) ** 2)))
            least = min(least, deviation / allowed)
    return least


def _find_resolution(values: NDArray[np.float64]) -> float:
    """Return the step of which all values of a signal are multiples; 0 where they are not rounded."""
    distinct = np.unique(values)
    steps = np.diff(distinct)
    steps = steps[steps > ROUNDING_STEP * float(np.max(np.abs(values)))]
    if not steps.size:
        return 0.0
    multiples = (distinct - distinct[0]) / np.min(steps)
    return float(np.min(steps)) if np.all(np.abs(multiples - np.round(multiples)) < ON_GRID) else 0.0


MEASURES: dict[str, Measure] = {
    "few_samples": _count_samples,
    "not_finite": _count_not_finite,
    "time_of_day": _judge_digits,
    "clock_advances": _count_steps_back,
    "gap": _measure_gap,
    "outliers": _count_outliers,
    "dead_source": _measure_dead_source,
    "frozen": _measure_hold,
    "coverage": _measure_coverage,
    "sample_rate": _measure_rate,
    "spare_samples": _count_spare_samples,
    "computed_acceleration": _measure_computed_acceleration,
}
"""Functions by the name of their check."""
