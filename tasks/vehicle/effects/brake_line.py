"""From the commanded pressure to what the pads make of it: dead time, lag, push-out, pad friction, fade.

With every number 0 the acting pressure is the commanded one, bit for bit.
"""

from math import exp

from numba import njit

from tasks.vehicle.effects.chassis import ChassisEffects

DISC_CAPACITY = 12000.0
"""Heat capacity of all discs: 26 kg of cast iron at 460 J/(kg K) (Limpert, SAE R-398) [J/K]."""
DISC_COOLING = 60.0
"""Convective loss of all discs [W/K]."""


@njit(cache=True, nogil=True)
def line_after(line: float, commanded: float, step: float, effects: ChassisEffects) -> float:
    """Pressure at the pads one step on: first-order lag behind the command, exact for a constant one [MPa].

    Parameters
    ----------
    line : pressure at the pads now [MPa]
    commanded : at the end of the step, dead time taken off [MPa]
    step : [s]
    effects : the numbers
    """
    if effects.lag <= 0.0:
        return commanded
    return line + (1.0 - exp(-step / effects.lag)) * (commanded - line)


@njit(cache=True, nogil=True)
def acting_pressure(line: float, speed: float, disc_rise: float, effects: ChassisEffects) -> float:
    """Pressure that would give the same torque under the linear law of the paper [MPa].

    Parameters
    ----------
    line : pressure at the pads [MPa]
    speed : of the vehicle [m/s]
    disc_rise : temperature of the discs above ambient [K]
    effects : the numbers
    """
    factor = 1.0 + effects.pressure_curve * line
    factor *= 1.0 - effects.fade * disc_rise / 100.0
    factor *= 1.0 - effects.pad_speed * (speed - effects.pad_speed_reference)
    return max(line - effects.push_out, 0.0) * max(factor, 0.0)


@njit(cache=True, nogil=True)
def disc_rise_after(disc_rise: float, power: float, step: float) -> float:
    """Temperature of the discs above ambient one step on [K].

    Parameters
    ----------
    disc_rise : now [K]
    power : that the brakes turn into heat [W]
    step : [s]
    """
    return disc_rise + step * (power - DISC_COOLING * disc_rise) / DISC_CAPACITY
