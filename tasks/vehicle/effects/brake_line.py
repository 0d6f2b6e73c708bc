"""From the commanded pressure to what the pads make of it: dead time, lag, push-out, pad friction, fade.

With every number 0 the acting pressure is the commanded one, bit for bit.
"""

from math import exp

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.vehicle.effects.exact import brake_factor
from tasks.vehicle.effects.ports import INDEX

DISC_CAPACITY_F, DISC_CAPACITY_R = 7400.0, 4600.0
"""Heat capacity of an axle's discs: 16 and 10 kg of cast iron at 460 J/(kg K) (Limpert, SAE R-398) [J/K]."""
DISC_COOLING = 30.0
"""Convective loss of an axle's discs [W/K]."""
_LAG, _PUSH = INDEX["lag"], INDEX["push_out"]


@njit(cache=True, nogil=True, error_model="numpy")
def line_after(line: float, before: float, after: float, step: float, theta: NDArray[np.float64]) -> float:
    """Pressure at the pads one step on: first-order lag behind the command, exact for a linear one [MPa].

    Parameters
    ----------
    line : pressure at the pads now [MPa]
    before, after : commanded at both ends of the step, dead time taken off [MPa]
    step : [s]
    theta : effects, in the order of `PARAMETERS`
    """
    if theta[_LAG] <= 0.0:
        return after
    behind = (after - before) / step * theta[_LAG]
    return after - behind + (line - before + behind) * exp(-step / theta[_LAG])


@njit(cache=True, nogil=True, error_model="numpy")
def acting_pressure(line: float, speed: float, disc_rise: float, theta: NDArray[np.float64]) -> float:
    """Pressure that would give the same torque under the linear law of the paper [MPa].

    Parameters
    ----------
    line : pressure at the pads [MPa]
    speed : of the vehicle [m/s]
    disc_rise : temperature of the discs above ambient [K]
    theta : effects, in the order of `PARAMETERS`
    """
    return max(line - theta[_PUSH], 0.0) * brake_factor(theta, line, speed, disc_rise)


@njit(cache=True, nogil=True, error_model="numpy")
def disc_rate(disc_rise: float, power: float, capacity: float) -> float:
    """Rate of the temperature of an axle's discs above ambient [K/s].

    Parameters
    ----------
    disc_rise : now [K]
    power : that the brakes turn into heat [W]
    capacity : of the discs [J/K]
    """
    return (power - DISC_COOLING * disc_rise) / capacity
