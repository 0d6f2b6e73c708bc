"""What checks look at: clocks, recordings, a logged signal, the signals of a run, the run, and all runs."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import MASKED_SPEED
from tasks.campaign.channels import BRAKE_SIGNALS, CHANNELS_BY_NAME
from tasks.campaign.checks import Channelled, Channels
from tasks.campaign.signals import ChannelRule, Signal

STAND_IN = "brake_stand_in"
"""Name of the brake pressure in a `MeasuredRun` where another quantity stands in for it, whose scale nobody knows."""
BRAKES = (*BRAKE_SIGNALS, STAND_IN)
"""Channels that say when the driver brakes, the best first."""
SMOOTHING = 0.2
"""Width of the mean over which two channels are compared [s]."""


@dataclass(frozen=True, kw_only=True)
class Clock(Channelled):
    """The clock of a recording as it is read.

    Parameters
    ----------
    time : float64 [N]; NaN where a row holds no time [s]
    kind, where, first : what its instants are called, where they are counted, and the number of the first one
    """

    time: NDArray[np.float64]
    kind: str = "sample"
    where: str = ""
    first: int = 1


@dataclass(frozen=True, kw_only=True)
class Recordings(Channelled):
    """Recordings as they were logged, before runs are looked for.

    Parameters
    ----------
    signals : by name, of each recording
    rules : the channel map
    clock_unit : in which the clock was taken to be
    """

    signals: Sequence[Mapping[str, Signal]]
    rules: Sequence[ChannelRule]
    clock_unit: str = "s"

    @property
    def names(self) -> Collection[str]:
        """Return the channels of the map."""
        return [rule.channel for rule in self.rules]


@dataclass(frozen=True, kw_only=True)
class LoggedSignal(Channelled):
    """A signal of a channel within a run.

    Parameters
    ----------
    channel, source : name of the channel and of the signal
    logged : as the logger wrote it
    converted : the same in the channel's unit, at its true times
    others : all signals of the channel by name, converted; a channel is the mean of them
    speed : of the car [m/s]; None where it was not measured
    span : lowest and largest value of a road car [the channel's unit]
    unit : in which the logged values were taken to be
    stands_in : for another quantity, so that nobody knows its scale
    """

    channel: str
    source: str = ""
    logged: Signal
    converted: Signal
    others: Mapping[str, Signal] = field(default_factory=dict)
    speed: Signal | None = None
    span: tuple[float, float] = (-inf, inf)
    unit: str = ""
    stands_in: bool = False

    @property
    def names(self) -> Collection[str]:
        """Return its channel."""
        return (self.channel,)


@dataclass(frozen=True, kw_only=True)
class Stretch(Channelled):
    """The signals of a run before they are put on one clock.

    Parameters
    ----------
    signals : by channel
    rate : of the clock [Hz]
    """

    signals: Mapping[str, Sequence[LoggedSignal]]
    rate: float

    @property
    def names(self) -> Collection[str]:
        """Return the channels."""
        return self.signals.keys()


@dataclass(frozen=True, kw_only=True)
class MeasuredRun(Channelled):
    """A run on its clock, with values between the samples of a slow channel.

    Parameters
    ----------
    name : of the run
    columns : channels by name, each float64 [N], in campaign units
    interval : of the clock [s]
    units : that the values were taken to be in, by channel; campaign units where none is given
    spans : lowest and largest value that a channel of a road car has, by name
    slippery : the road is not dry
    over_feature : the road has a feature, whose place counts from the first sample
    """

    name: str = ""
    columns: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    interval: float
    units: Mapping[str, str] = field(default_factory=dict)
    spans: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    slippery: bool = False
    over_feature: bool = False

    @property
    def names(self) -> Collection[str]:
        """Return the channels."""
        return self.columns.keys()

    def unit_of(self, channel: str) -> str:
        """Return the unit that a channel was taken to be in."""
        return self.units.get(channel) or CHANNELS_BY_NAME[channel].unit

    @cached_property
    def smooth(self) -> dict[str, NDArray[np.float64]]:
        """Moving means of the channels, each float64 [M]."""
        return {name: smooth_channel(values, self.interval) for name, values in self.columns.items()}

    @cached_property
    def rate(self) -> NDArray[np.float64]:
        """Rate of the smooth speed, float64 [M] [m/s^2]."""
        return np.gradient(self.smooth["speed"], self.interval)

    @cached_property
    def moving(self) -> NDArray[np.bool_]:
        """Whether the car moves, bool [M]."""
        return self.smooth["speed"] > MASKED_SPEED


@dataclass(frozen=True, kw_only=True)
class Session(Channelled):
    """All runs of a campaign, at one interval."""

    runs: Sequence[MeasuredRun]

    def having(self, channels: Channels) -> Self | None:
        """Return the runs that have some channels; None where no run has."""
        runs = [run for run in self.runs if run.having(channels) is not None]
        return replace(self, runs=runs) if runs else None


def smooth_channel(values: NDArray[np.float64], interval: float) -> NDArray[np.float64]:
    """Return the mean of a channel over `SMOOTHING`, or half of a shorter run, where the whole window lies within it.

    That is float64 [M], of which a run of two samples and more has two.

    Parameters
    ----------
    values : float64 [N]
    interval : of their clock [s]
    """
    width = max(min(round(SMOOTHING / interval), len(values) // 2), 1)
    return np.convolve(values, np.ones(width) / width, mode="valid")
