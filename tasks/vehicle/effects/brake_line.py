"""The brake line: from the commanded pressure to the acting one, by dead time, lag, push-out, pad friction and fade.

With every number 0 the acting pressure is the commanded one, bit for bit.
"""

from math import exp

from numba.extending import register_jitable

from tasks.vehicle.effects.equations import compute_brake_factor
from tasks.vehicle.effects.table import EffectValues

DISC_CAPACITY_F, DISC_CAPACITY_R = 7400.0, 4600.0
"""Heat capacity of an axle's discs: 16 and 10 kg of cast iron at 460 J/(kg K) (Limpert, SAE R-398) [J/K]."""
DISC_COOLING = 30.0
"""Convective loss of an axle's discs [W/K]."""


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_line_pressure(
    line: float, before: float, after: float, step: float, effects: EffectValues
) -> float:
    """Return the pressure at the pads after one step [MPa]: a first-order lag behind the command.

    The solution is exact for a command that is linear within the step.

    Parameters
    ----------
    line : pressure at the pads before the step [MPa]
    before, after : commanded at both ends of the step, dead time taken off [MPa]
    step : length of the step [s]
    effects : numbers of the vehicle's effects
    """
    if effects.lag <= 0.0:
        return after
    behind = (after - before) / step * effects.lag
    return after - behind + (line - before + behind) * exp(-step / effects.lag)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_acting_pressure(line: float, speed: float, disc_rise: float, effects: EffectValues) -> float:
    """Return the pressure that would give the same torque under the linear law of the paper [MPa].

    Parameters
    ----------
    line : pressure at the pads [MPa]
    speed : speed of the vehicle [m/s]
    disc_rise : temperature of the discs above ambient [K]
    effects : numbers of the vehicle's effects
    """
    return max(line - effects.push_out, 0.0) * compute_brake_factor(effects, line, speed, disc_rise)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_disc_temperature_rate(disc_rise: float, power: float, capacity: float) -> float:
    """Return the rate of the temperature of an axle's discs [K/s].

    Parameters
    ----------
    disc_rise : temperature of the discs above ambient [K]
    power : heating power of the brakes [W]
    capacity : heat capacity of the discs [J/K]
    """
    return (power - DISC_COOLING * disc_rise) / capacity
