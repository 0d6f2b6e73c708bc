"""A channel that is slower than its run: it has no value between its samples, and noise belongs to its samples only.

A run's file holds NaN (in Parquet also null) where such a channel has no sample. Values made up between samples are for
the eye and for checks: as evidence they would count noise several times, and their corners would look like an effect.

A brake pressure that a bus sends at 10 Hz stands in a table of 100 Hz as ten equal rows. A model that brakes with such
a staircase brakes half an interval late, which hides a true lag of the brake.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.campaign.signals import Signal

SLOW = 2
"""Instants from sample to sample from which a channel is slow; a faster one misses single samples, which is a gap."""
NEARLY = 0.9
"""Share of `SLOW` that a logger's own clock may be off [1]."""
FEWEST_UPDATES, ALIKE = 20, 0.8
"""Updates from which a held signal can be detected, and the share of holds of the usual length."""
SHORTEST_UNEVEN = 4
"""Samples of a hold from which one sample more or less is the logger's jitter."""
FEWEST_CHANGES = 10
"""Changes of value from which an input shows its clock [1]; fewer may be the steps of a manoeuvre."""
LONGEST_PERIOD = 0.5
"""From update to update of a bus [s]; steps that are further apart are held by the one who gives the command."""
LEAST_ODDS = 1e6
"""Against changes at any rows that fall on one clock by chance [1]."""


def mark_samples(name: str, values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the instants at which a channel has a sample, bool [N]; all of them where the channel is not slow.

    Parameters
    ----------
    name : channel; inputs such as the brake pressure must have a value at every instant
    values : float64 [N], NaN where there is no sample
    """
    found = np.isfinite(values)
    rows = np.flatnonzero(found)
    slow = name in CHANNELS and len(rows) > 1 and float(np.median(np.diff(rows))) >= SLOW
    return found if slow else np.ones(len(values), dtype=bool)


def fill_between_samples(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a channel linear between its samples, and constant before the first and after the last.

    Parameters
    ----------
    name : channel
    values : float64 [N], NaN where there is no sample
    """
    found = mark_samples(name, values)
    if found.all():
        return values
    return np.interp(np.arange(len(values)), np.flatnonzero(found), values[found])


def collect_samples(columns: Mapping[str, NDArray[np.float64]]) -> NDArray[np.bool_] | None:
    """Return where the channels of a run have samples, bool [N, 7]; None where all have one at every instant.

    Parameters
    ----------
    columns : channels of a run by name, each float64 [N]; one that is absent was not measured
    """
    count = len(next(iter(columns.values())))
    everywhere = np.ones(count, dtype=bool)
    found = [mark_samples(name, columns[name]) if name in columns else everywhere for name in CHANNELS]
    sampled = np.column_stack(found)
    return None if sampled.all() else sampled


def measure_slow_rates(runs: Sequence[Mapping[str, NDArray[np.float64]]], rate: float) -> dict[str, float]:
    """Return the rate at which each slow channel was sampled, to a tenth [Hz].

    Parameters
    ----------
    runs : channels of each run by name, float64 [N], NaN where there is no sample
    rate : of the runs [Hz]
    """
    steps: dict[str, list[NDArray[np.int64]]] = {}
    for columns in runs:
        for name, values in columns.items():
            if not (found := mark_samples(name, values)).all():
                steps.setdefault(name, []).append(np.diff(np.flatnonzero(found)))
    return {name: round(rate / float(np.mean(np.concatenate(own))), 1) for name, own in steps.items()}


def clear_between_samples(
    name: str, values: NDArray[np.float64], signals: Sequence[Signal], clock: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return a channel with NaN wherever no sample of its signals is nearest; unchanged where it is not slow.

    Parameters
    ----------
    name : channel
    values : float64 [N] on the clock
    signals : that the channel was made of; of several the slowest counts
    clock : float64 [N] uniform [s]
    """
    interval = float(clock[1] - clock[0])
    slowest = max(signals, key=lambda signal: float(np.median(np.diff(signal.time))))
    if name not in CHANNELS or float(np.median(np.diff(slowest.time))) < NEARLY * SLOW * interval:
        return values
    rows = np.round((slowest.time - clock[0]) / interval).astype(np.int64)
    rows = rows[(rows >= 0) & (rows < len(clock))]
    cleared = np.full(len(values), np.nan)
    cleared[rows] = values[rows]
    return cleared


def take_updates(signal: Signal) -> Signal:
    """Return a signal without the rows that repeat a sample, where the logger does so for a fixed number of rows.

    A table with one row per 10 ms holds a receiver's 10 Hz as ten equal rows. A coarse sensor repeats values too, but
    not for the same number of rows each time, and by one step of its resolution. An input rests and is
    held by the driver, so it has a rule of its own, `take_input_updates`.

    Parameters
    ----------
    signal : as logged
    """
    updates = np.flatnonzero(np.diff(signal.values) != 0.0) + 1
    holds = np.diff(updates)
    if len(holds) < FEWEST_UPDATES:
        return signal
    usual = int(np.median(holds))
    jitter = 1 if usual >= SHORTEST_UNEVEN else 0
    multiples = np.maximum(np.round(holds / usual), 1.0)
    steps = np.abs(np.diff(signal.values)[updates - 1])
    is_coarse = np.mean(steps < 1.5 * steps.min()) > ALIKE
    uneven = np.any(np.abs(holds - usual * multiples) > jitter * multiples)
    if usual < SLOW or is_coarse or uneven or np.mean(multiples == 1.0) < ALIKE:
        return signal
    starts = [
        updates[i] + np.round(np.arange(n) * holds[i] / n).astype(np.int64)
        for i, n in enumerate(multiples.astype(np.int64))
    ]
    before = np.arange(updates[0] - usual, -1, -usual)[::-1]
    after = np.arange(updates[-1], len(signal.values), usual)
    rows = np.concatenate((before, *starts, after))
    return Signal(time=signal.time[rows], values=signal.values[rows], unit=signal.unit)


def take_samples(channel: str, signal: Signal) -> Signal:
    """Return the samples of a logged signal, without the rows that repeat them where a table holds a slower one.

    Parameters
    ----------
    channel : that the signal becomes
    signal : as logged
    """
    return take_updates(signal) if channel in CHANNELS else take_input_updates(signal)


def take_input_updates(signal: Signal) -> Signal:
    """Return an input at the updates of its bus; unchanged where its changes follow no clock slower than its rows.

    An input rests and is held, so that many updates bring the same value, and the holds are of many lengths. All are
    multiples of one period. A value that stays has an update at each period, so that the next change begins there.

    Parameters
    ----------
    signal : as logged
    """
    changes = np.flatnonzero(np.diff(signal.values) != 0.0) + 1
    if len(changes) < FEWEST_CHANGES:
        return signal
    holds = np.diff(changes)
    period = _find_period(holds)
    if period < SLOW or period * float(np.median(np.diff(signal.time))) > LONGEST_PERIOD:
        return signal
    order = np.concatenate(([0], np.cumsum(_count_periods(holds, period))))
    period, first = (float(x) for x in np.polyfit(order, changes, 1))
    rows_of_one = 1.0 + 2.0 * float(np.max(np.abs(changes - first - period * order)))
    if len(holds) * np.log(period / rows_of_one) < np.log(LEAST_ODDS):
        return signal
    before = int(max(first, 0.0) // period)
    after = int(max(len(signal.values) - 1 - first - period * order[-1], 0.0) // period)
    rows = np.round(first + period * np.arange(-before, order[-1] + after + 1)).astype(np.int64)
    rows[order + before] = changes
    return Signal(time=signal.time[rows], values=signal.values[rows], unit=signal.unit)


def _find_period(holds: NDArray[np.int64]) -> float:
    """Return the rows from update to update: first of the most frequent hold, then of longer and longer ones."""
    period, reach = float(np.argmax(np.bincount(holds))), 1.0
    while reach * period < 2.0 * float(holds.max()):
        near = holds < (reach + 0.5) * period
        period = float(np.sum(holds[near]) / np.sum(_count_periods(holds[near], period)))
        reach *= 2.0
    return period


def _count_periods(holds: NDArray[np.int64], period: float) -> NDArray[np.int64]:
    return np.maximum(np.round(holds / period), 1.0).astype(np.int64)
