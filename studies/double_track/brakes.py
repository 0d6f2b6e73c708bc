"""The car's brakes: hydraulics, pads and discs, and an anti-lock controller that builds, holds and dumps."""

from collections.abc import Mapping
from math import exp, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

OFF, DUMP, HOLD, BUILD = 0, 1, 2, 3
"""Phases of a wheel's valves."""
NO_CAP = 100.0
"""Pressure that a wheel whose controller is silent may reach [MPa]."""


@njit(error_model="numpy")
def pad_pressure(pressure: float, push_out: float, width: float) -> float:
    """Pressure beyond what the seals take back, with a round corner [MPa].

    Parameters
    ----------
    pressure : at the wheel [MPa]
    push_out : that moves the pads only [MPa]
    width : of the corner [MPa]
    """
    if push_out <= 0.0:
        return pressure
    over = pressure - push_out
    return max(
        0.5 * (over + sqrt(over * over + width * width)) - 0.5 * (sqrt(push_out**2 + width**2) - push_out),
        0.0,
    )


@njit(error_model="numpy")
def pad_factor(
    pressure: float,
    rim_speed: float,
    disc_rise: float,
    curve: float,
    fade: float,
    by_speed: float,
    reference: float,
) -> float:
    """Factor on the torque of the pads [1].

    Parameters
    ----------
    pressure : at the pads [MPa]
    rim_speed : radius times wheel speed [m/s]
    disc_rise : of the disc above ambient [K]
    curve : relative growth with pressure [1/MPa]
    fade : relative loss for 100 K [1]
    by_speed : relative loss for each m/s above the reference [s/m]
    reference : [m/s]
    """
    hot = 1.0 - fade * disc_rise / 100.0
    return max(exp(curve * pressure) * hot * (1.0 - by_speed * (rim_speed - reference)), 0.0)


def control_wheel(phase: int, slip: float, deceleration: float, thresholds: Mapping[str, float]) -> int:
    """Next phase of a wheel's valves.

    Parameters
    ----------
    phase : now
    slip : of the wheel [1]
    deceleration : of its rim [m/s2]
    thresholds : of the controller, as declared, and the target slip about which it is to cycle
    """
    target = thresholds["target_slip"]
    falling = deceleration > 0.0
    locks = slip > thresholds["slip_high"] * target or (
        deceleration > thresholds["wheel_deceleration"] and slip > target
    )
    if phase == DUMP:
        return DUMP if falling and slip > thresholds["slip_low"] * target else HOLD
    if locks and (falling or phase in (OFF, BUILD)):
        return DUMP
    if phase == HOLD:
        return BUILD if slip < thresholds["slip_low"] * target else HOLD
    return phase


def cap_rates(phases: NDArray[np.int64], thresholds: Mapping[str, float]) -> NDArray[np.float64]:
    """Relative rates at which the wheels' pressure limits move, float64 [4] [1/s].

    Parameters
    ----------
    phases : of the four wheels
    thresholds : of the controller, as declared
    """
    rates = np.zeros(4)
    rates[phases == DUMP] = -thresholds["dump_rate"]
    rates[phases == BUILD] = thresholds["build_rate"]
    return rates
