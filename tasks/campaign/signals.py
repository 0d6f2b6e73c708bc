"""A logged signal on its own clock, its conversion by the channel map, and its resampling on a common clock."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.channels import BRAKE_SIGNALS, CHANNELS_BY_NAME, unit_factor

TIME_ROUNDING = 8.0
"""Spacings of a time's floating-point number by which a logged time and the clock's may differ for one instant [1]."""


@dataclass(frozen=True, kw_only=True)
class Signal:
    """Samples with the times at which they were taken.

    Parameters
    ----------
    time : float64 [N] as logged [s]
    values : float64 [N] [unit]
    unit : unit that the file itself states; empty if it states none
    """

    time: NDArray[np.float64]
    values: NDArray[np.float64]
    unit: str = ""

    def cut_window(self, start: float, end: float) -> "Signal":
        """Return the samples from ``start`` on and before ``end`` [s], so that windows that touch share none."""
        inside = (self.time >= start) & (self.time < end)
        return Signal(time=self.time[inside], values=self.values[inside], unit=self.unit)


@dataclass(frozen=True, kw_only=True)
class Gain:
    """A constant that turns one quantity into another, such as wheel torque into brake pressure.

    Parameters
    ----------
    value : of one unit of ``source_unit`` [target_unit / source_unit]
    source_unit, target_unit : units on both sides
    """

    value: float
    source_unit: str
    target_unit: str


@dataclass(frozen=True, kw_only=True)
class ChannelRule:
    """Rule that makes one channel of a campaign from a logger's signals.

    Parameters
    ----------
    channel : name in the campaign
    sources : names of the logged signals; of several the mean is taken
    unit : unit of the signals
    sign : -1 where the logger's positive direction is the opposite one
    scale : correction of the sensor's gain [1]
    offset : added last [the channel's unit]
    delay : delay of the logger's time stamp [s]
    gain : change of quantity, or None
    """

    channel: str
    sources: tuple[str, ...]
    unit: str
    sign: int = 1
    scale: float = 1.0
    offset: float = 0.0
    delay: float = 0.0
    gain: Gain | None = None

    @property
    def factor(self) -> float:
        """Factor from a logged value to the channel's unit.

        Raises
        ------
        InputError
            If the units do not lead to the channel's.
        """
        target = CHANNELS_BY_NAME[self.channel].unit
        if self.gain is None:
            return self.sign * self.scale * unit_factor(self.unit, target)
        inward = unit_factor(self.unit, self.gain.source_unit)
        return self.sign * self.scale * inward * self.gain.value * unit_factor(self.gain.target_unit, target)

    def describe_pressure(self, pressure: float) -> str:
        """Return a pressure [MPa] as this signal of the brake was logged, such as 15 % (taken for 1.5 MPa)."""
        if self.channel == "brake_pressure" and self.gain is None:
            return f"{pressure:.3g} MPa"
        logged = (pressure / BRAKE_SIGNALS[self.channel] - self.offset) / self.factor
        return f"{logged:.3g}{'' if self.unit == '1' else f' {self.unit}'} (taken for {pressure:.3g} MPa)"


def convert_to_channel(signal: Signal, rule: ChannelRule) -> Signal:
    """Convert a signal to the channel's unit, direction and true times.

    Parameters
    ----------
    signal : as logged
    rule : from the channel map
    """
    return Signal(
        time=signal.time - rule.delay,
        values=rule.factor * signal.values + rule.offset,
        unit=CHANNELS_BY_NAME[rule.channel].unit,
    )


def average_sources(signals: Mapping[str, Signal], rule: ChannelRule) -> Signal:
    """Return the mean of a channel's sources in its unit, at the true times of the first; empty where one is.

    Parameters
    ----------
    signals : logged signals by name
    rule : from the channel map
    """
    first, *others = (convert_to_channel(signals[name], rule) for name in rule.sources)
    if not others:
        return first
    if not all(len(signal.time) for signal in (first, *others)):
        return Signal(time=np.empty(0), values=np.empty(0), unit=first.unit)
    beside = [np.interp(first.time, signal.time, signal.values) for signal in others]
    return Signal(time=first.time, values=np.mean([first.values, *beside], axis=0), unit=first.unit)


def resample_on_clock(signal: Signal, clock: NDArray[np.float64]) -> NDArray[np.float64]:
    """Resample a signal at the times of a uniform clock.

    A slower signal is linear between its samples, and equal to a sample that falls on the clock. A faster one is
    averaged over the clock's interval, so that frequencies above the clock's limit do not alias.

    Parameters
    ----------
    signal : finite, with ascending times
    clock : float64 [M] uniform and within the signal's times [s]
    """
    interval = float(clock[1] - clock[0])
    if float(np.median(np.diff(signal.time))) > 0.55 * interval:
        return _interpolate_samples(signal, clock)
    steps = np.diff(signal.time)
    area = np.concatenate(([0.0], np.cumsum(0.5 * (signal.values[1:] + signal.values[:-1]) * steps)))
    first, last = float(signal.time[0]), float(signal.time[-1])
    left = np.maximum(clock - 0.5 * interval, first)
    right = np.minimum(clock + 0.5 * interval, last)
    # the integral is interpolated linearly between samples: accurate enough with more than two of them
    return (np.interp(right, signal.time, area) - np.interp(left, signal.time, area)) / (right - left)


def _interpolate_samples(signal: Signal, clock: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values between samples, and the sample itself where a sample falls on the clock within rounding."""
    after = np.clip(np.searchsorted(signal.time, clock), 1, len(signal.time) - 1)
    nearest = after - (clock - signal.time[after - 1] < signal.time[after] - clock)
    rounding = TIME_ROUNDING * np.spacing(np.abs(clock))
    on_clock = np.abs(signal.time[nearest] - clock) <= rounding
    return np.where(on_clock, signal.values[nearest], np.interp(clock, signal.time, signal.values))


def make_common_clock(signals: list[Signal], rate: float) -> NDArray[np.float64]:
    """Return times at ``rate`` [Hz] over the span that all signals cover [s]; empty for fewer than two samples.

    Parameters
    ----------
    signals : at least one, none empty
    rate : [Hz]
    """
    start = max(float(signal.time[0]) for signal in signals)
    end = min(float(signal.time[-1]) for signal in signals)
    count = int(np.floor((end - start) * rate + 1e-9)) + 1
    return start + np.arange(max(count, 0) if count > 1 else 0) / rate
