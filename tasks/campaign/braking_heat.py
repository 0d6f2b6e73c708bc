"""Heat of the discs as a run begins, estimated from the drive before it where nobody measured their temperature."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import BRAKING_PRESSURE, Campaign
from tasks.campaign.channels import BRAKE_SIGNALS
from tasks.campaign.segments import find_brake_rule
from tasks.campaign.signals import ChannelRule, Signal, average_sources
from tasks.campaign.slow_channels import take_samples
from tasks.conventions import GRAVITY
from tasks.vehicle.effects.brake_line import DISC_CAPACITY_F, DISC_CAPACITY_R, DISC_COOLING

APPLIED = 0.05
"""Share of the range of a brake signal, above its rest, from which the brake is applied [1]."""
RESTING = 0.05
"""Quantile of a brake signal that counts as its rest: for a twentieth of a drive at least no car brakes [1]."""
SPIKE = 5
"""Samples of which the middle value counts, so that two wrong ones in a row are no energy [1]."""
SPIKE_TIME = 0.2
"""Time between samples up to which five of them are less than a stop [s]."""
COOLING_SPEED = 14.0
"""Speed at which the air takes what `DISC_COOLING` says [m/s]: half of the speed from which a stop begins."""
COOLING_EXPONENT = 0.8
"""Of the loss over speed: turbulent air over a disc (Limpert, SAE R-398) [1]."""
STANDING = 0.2
"""Least share of `DISC_COOLING`, while the car stands [1]: declared."""


def measure_braking_heat(
    signals: Mapping[str, Signal], rules: Sequence[ChannelRule], instants: Sequence[float]
) -> list[float]:
    """Return the heat in the discs at some instants of a recording, per mass of the car [J/kg].

    Parameters
    ----------
    signals : logged signals by name
    rules : the channel map
    instants : in the logger's time, delays taken off [s]
    """
    brake, by_channel = find_brake_rule(rules), {rule.channel: rule for rule in rules}
    if brake is None or "speed" not in by_channel:
        return [0.0] * len(instants)

    def take(rule: ChannelRule) -> Signal:
        taken = {name: take_samples(rule.channel, signals[name]) for name in rule.sources}
        return _drop_gaps(average_sources(taken, rule))

    speed, applied = take(by_channel["speed"]), take(brake)
    if not len(speed.time) or not len(applied.time):
        return [0.0] * len(instants)
    slope = np.zeros(len(speed.time))
    if "road_slope" in by_channel and len((road := take(by_channel["road_slope"])).time):
        slope = np.radians(np.interp(speed.time, road.time, road.values))
    pressure = np.interp(speed.time, applied.time, BRAKE_SIGNALS[brake.channel] * _hide_spikes(applied))
    clean = replace(speed, values=_hide_spikes(speed))
    return compute_braking_heat(clean, pressure, slope, np.asarray(instants)).tolist()


def _drop_gaps(signal: Signal) -> Signal:
    """Return a signal without the samples that are no numbers, as a receiver without a fix has them."""
    finite = np.isfinite(signal.values)
    return replace(signal, time=signal.time[finite], values=signal.values[finite])


def _hide_spikes(signal: Signal) -> NDArray[np.float64]:
    """Return the values with the middle one of `SPIKE` in the place of each, where a stop has many."""
    if len(signal.time) < SPIKE or float(np.median(np.diff(signal.time))) > SPIKE_TIME:
        return signal.values
    padded = np.pad(signal.values, SPIKE // 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, SPIKE), axis=-1))


def compute_braking_heat(
    speed: Signal, pressure: NDArray[np.float64], slope: NDArray[np.float64], instants: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the heat in the discs at some instants of a drive that begins with cold ones, float64 [I] [J/kg].

    What the car loses of its kinetic and potential energy while the brake is applied heats the discs, which cool from
    then on. Resistances and a motor that brakes beside them are not taken off.

    Parameters
    ----------
    speed : of the whole drive [m/s], N samples
    pressure : of the brake, or what stands for it, float64 [N] [MPa]
    slope : of the road, uphill positive, float64 [N] [rad]
    instants : float64 [I] [s]
    """
    time, v = speed.time, speed.values
    rest, hardest = float(np.quantile(pressure, RESTING)), float(np.max(pressure))
    applied = pressure > rest + max(APPLIED * (hardest - rest), BRAKING_PRESSURE)
    edges = np.flatnonzero(np.diff(applied.astype(np.int8), prepend=0, append=0))
    before, last = np.maximum(edges[::2] - 1, 0), edges[1::2] - 1
    energy = 0.5 * v**2 + GRAVITY * _integrate(v * np.sin(slope), time)
    gained = np.maximum(energy[before] - energy[last], 0.0)
    rate = 2.0 * DISC_COOLING / (DISC_CAPACITY_F + DISC_CAPACITY_R)
    relative = np.maximum((np.abs(v) / COOLING_SPEED) ** COOLING_EXPONENT, STANDING)
    cooled = _integrate(rate * relative, time)
    since = np.interp(instants, time, cooled)[:, np.newaxis] - cooled[last]
    at = instants[:, np.newaxis]
    so_far = np.maximum(energy[before] - np.interp(instants, time, energy)[:, np.newaxis], 0.0)
    under_way = np.where((time[before] <= at) & (at < time[last]), so_far, 0.0)
    return np.asarray(np.where(time[last] <= at, np.exp(-since), 0.0) @ gained + under_way.sum(axis=1))


def _integrate(rate: NDArray[np.float64], time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integral of a rate from the first instant on, float64 [N]."""
    return np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))))


def estimate_disc_temperatures(campaign: Campaign, mass: float) -> Campaign:
    """Return a campaign whose runs begin with discs as hot as the braking before them made those of the model.

    A run whose temperature is known keeps it.

    Parameters
    ----------
    campaign : measured runs
    mass : of the car [kg]
    """
    capacity = DISC_CAPACITY_F + DISC_CAPACITY_R
    runs = (
        replace(run, disc_rise=run.disc_rise or run.braking_heat * mass / capacity) for run in campaign.runs
    )
    return replace(campaign, runs=tuple(runs))
