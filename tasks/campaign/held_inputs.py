"""An input that a table holds between the updates of a slower bus: its updates are told by their clock.

A brake pressure that a bus sends at 10 Hz stands in a table of 100 Hz as ten equal rows. A model that brakes with such
a staircase brakes half an interval late, which hides a true lag of the brake.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.campaign.signals import ChannelRule, Signal
from tasks.campaign.slow_channels import SLOW, take_updates

FEWEST_CHANGES = 10
"""Changes of value from which an input shows its clock [1]; fewer may be the steps of a manoeuvre."""
LONGEST_PERIOD = 0.5
"""From update to update of a bus [s]; steps that are further apart are held by the one who gives the command."""
LEAST_ODDS = 1e6
"""Against changes at any rows that fall on one clock by chance [1]."""


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


def describe_held_inputs(
    recordings: Sequence[Mapping[str, Signal]], rules: Sequence[ChannelRule]
) -> list[str]:
    """Return a sentence for each input whose updates were taken, because a command may be meant as it is held.

    Parameters
    ----------
    recordings : logged signals by name, of each recording
    rules : the channel map
    """
    rates: dict[str, float] = {}
    for rule in rules:
        for signal in (recording[name] for recording in recordings for name in rule.sources):
            updates = signal if rule.channel in CHANNELS else take_input_updates(signal)
            if updates is not signal:
                rates[rule.channel] = 1.0 / float(np.median(np.diff(updates.time)))
    return [
        f"channel {channel} holds each value until the next update of {rate:.3g} Hz: it is taken as linear between its"
        " updates, which is wrong only for a command that the brake or the engine receives in such steps"
        for channel, rate in rates.items()
    ]


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
