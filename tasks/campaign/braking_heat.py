"""Heat of the discs as a run begins, estimated from the drive before it where nobody measured their temperature."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import exp

import numpy as np
from scipy.ndimage import median_filter

from tasks.campaign.campaign import Campaign
from tasks.campaign.channels import BRAKE_SIGNALS
from tasks.campaign.held_inputs import take_samples
from tasks.campaign.segments import find_brake_rule
from tasks.campaign.signals import ChannelRule, Signal, average_sources
from tasks.campaign.torque_validation import RELEASED_PRESSURE
from tasks.vehicle.effects.brake_line import DISC_CAPACITY_F, DISC_CAPACITY_R, DISC_COOLING

APPLIED = 0.05
"""Share of the range of a brake signal, above its rest, from which the brake is applied [1]."""
RESTING = 0.05
"""Quantile of a brake signal that counts as its rest: no car brakes for so much of a drive [1]."""
SPIKE = 5
"""Samples of which the middle value counts, so that two wrong ones in a row are no energy."""
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
    instants : in the logger's time [s]
    """
    brake, by_channel = find_brake_rule(rules), {rule.channel: rule for rule in rules}
    if brake is None or "speed" not in by_channel:
        return [0.0] * len(instants)
    taken = {name: take_samples(rule.channel, signals[name]) for rule in rules for name in rule.sources}
    speed, applied = (_drop_gaps(average_sources(taken, rule)) for rule in (by_channel["speed"], brake))
    if not len(speed.time) or not len(applied.time):
        return [0.0] * len(instants)
    pressure = replace(applied, values=BRAKE_SIGNALS[brake.channel] * applied.values)
    heat = compute_braking_heat(speed, pressure)
    return np.interp(instants, heat.time, heat.values).tolist()


def _drop_gaps(signal: Signal) -> Signal:
    """Return a signal without the samples that are no numbers, as a receiver without a fix has them."""
    finite = np.isfinite(signal.values)
    return replace(signal, time=signal.time[finite], values=signal.values[finite])


def compute_braking_heat(speed: Signal, pressure: Signal) -> Signal:
    """Return the heat in the discs over a drive that begins with cold ones, per mass of the car [J/kg].

    While the brake is applied, what the car loses of its kinetic energy heats the discs, which the air cools.

    Parameters
    ----------
    speed : of the whole drive [m/s]
    pressure : of the brake over the same drive, or what stands for it [MPa]
    """
    pressed = median_filter(pressure.values, SPIKE, mode="nearest")
    rest, hardest = float(np.quantile(pressed, RESTING)), float(np.max(pressed))
    threshold = rest + max(APPLIED * (hardest - rest), RELEASED_PRESSURE)
    applied = np.interp(speed.time, pressure.time, pressed) > threshold
    energy = 0.5 * median_filter(speed.values, SPIKE, mode="nearest") ** 2
    gained = np.where(applied, -np.diff(energy, prepend=energy[0]), 0.0)
    cooling = 2.0 * DISC_COOLING / (DISC_CAPACITY_F + DISC_CAPACITY_R)
    relative = np.maximum((np.abs(speed.values) / COOLING_SPEED) ** COOLING_EXPONENT, STANDING)
    lost = cooling * relative * np.maximum(np.diff(speed.time, prepend=speed.time[0]), 0.0)
    heat = np.zeros(len(speed.time))
    for i in range(1, len(heat)):
        heat[i] = heat[i - 1] * exp(-lost[i]) + gained[i]
    return Signal(time=speed.time, values=np.maximum(heat, 0.0))


def estimate_disc_temperatures(campaign: Campaign, mass: float) -> Campaign:
    """Return a campaign whose runs begin with discs as hot as the braking before them made those of the model.

    Parameters
    ----------
    campaign : measured runs
    mass : of the car [kg]
    """
    capacity = DISC_CAPACITY_F + DISC_CAPACITY_R
    runs = (
        replace(run, disc_rise=run.disc_rise + run.braking_heat * mass / capacity) for run in campaign.runs
    )
    return replace(campaign, runs=tuple(runs))
