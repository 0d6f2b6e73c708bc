"""Validation of the channel that says how hard the driver brakes: constant, turned over, or no brake at all."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.channels import BRAKE_SIGNALS

MOVING = 2.0
"""Speed above which the vibration of a car changes every sensor's value [m/s]."""
WITHOUT_BRAKE = 3.0
"""Deceleration that drag, an engine or a generator gives without brake pressure at most [m/s^2]."""
APPLIED, RELEASED = 0.5, 0.1
"""Share of a brake signal's largest value above which the brake is applied, and below which it is released [1]."""
SLOWEST_STOP, LEAST_FALL, BRAKING_PRESSURE = 0.1, 5.0, 1.0
"""A speed that falls by so much [m/s] under such a pressure [MPa] falls faster than this at some time [m/s^2]."""
LEAST_SAMPLES = 20
"""Samples of an applied and of a released brake from which their decelerations are compared [1]."""


def find_brake_problems(
    columns: Mapping[str, NDArray[np.float64]],
    smooth: Mapping[str, NDArray[np.float64]],
    interval: float,
    *,
    stands_in: bool,
) -> list[str]:
    """Return the problems of each signal of the brake, beside what the speed says.

    Parameters
    ----------
    columns : channels on a common clock, each float64 [N], in campaign units
    smooth : their moving means, each float64 [M]
    interval : of the clock [s]
    stands_in : the brake pressure is another signal in its place, whose scale nobody knows
    """
    rate = np.gradient(smooth["speed"], interval) if "speed" in smooth else None
    found: list[str | None] = []
    if "brake_pressure" in columns and not stands_in:
        motor_brakes = bool(np.any(columns.get("engine_torque", np.zeros(1)) < 0.0))
        found.append(_find_slow_clock_problem(smooth["brake_pressure"], smooth.get("speed"), rate))
        width = len(columns["brake_pressure"]) - len(smooth["brake_pressure"]) + 1
        found.append(_find_constant_problem(columns["brake_pressure"], None if motor_brakes else rate, width))
    if rate is not None:
        moving = smooth["speed"] > MOVING
        found += [
            _find_effect_problem(name, smooth[name], moving, rate) for name in BRAKE_SIGNALS if name in smooth
        ]
    return [problem for problem in found if problem is not None]


def _find_constant_problem(
    pressure: NDArray[np.float64], rate: NDArray[np.float64] | None, width: int
) -> str | None:
    """Return the problem of a constant pressure, or of a pressure of 0 while the car brakes.

    Parameters
    ----------
    pressure : float64 [N] [MPa]
    rate : of speed, float64 [M] [m/s^2]; None where it says nothing, as a motor that brakes needs no pressure
    width : samples of a moving mean [1]
    """
    if np.ptp(pressure) > 0:
        return None
    if pressure[0] != 0.0:
        return (
            f"channel brake_pressure is frozen: it holds {pressure[0]:.4g} MPa over the whole run; record it anew, or"
            " leave the run out"
        )
    lost = 0.0 if rate is None else -float(np.mean(np.sort(rate)[:width]))
    if lost <= WITHOUT_BRAKE:
        return None
    return (
        f"channel brake_pressure is 0 over the whole run while speed falls at {lost:.1f} m/s^2, which needs the brake"
        f" beyond {WITHOUT_BRAKE:g}: record it anew, or leave the run out"
    )


def _find_slow_clock_problem(
    pressure: NDArray[np.float64], speed: NDArray[np.float64] | None, rate: NDArray[np.float64] | None
) -> str | None:
    """Return the problem of a stop that takes hours: a time in ms that was taken for s.

    Parameters
    ----------
    pressure, speed : moving means, float64 [M] [MPa], [m/s]
    rate : of speed, float64 [M] [m/s^2]
    """
    if speed is None or rate is None or pressure.max() < BRAKING_PRESSURE or np.ptp(speed) < LEAST_FALL:
        return None
    if (fastest := float(np.max(np.abs(rate)))) >= SLOWEST_STOP:
        return None
    return (
        f"channel speed changes by {np.ptp(speed):.3g} m/s under the brake, and never faster than {fastest:.2g} m/s^2:"
        " correct the unit of time"
    )


def _find_effect_problem(
    name: str, brake: NDArray[np.float64], moving: NDArray[np.bool_], rate: NDArray[np.float64]
) -> str | None:
    """Return the problem of a signal with which the car slows when it is negative, or when it is released.

    Parameters
    ----------
    name : channel
    brake : moving mean, float64 [M] [the channel's unit]
    moving : whether the car moves, bool [M]
    rate : of speed, float64 [M] [m/s^2]
    """
    size = np.abs(brake)
    applied, released = moving & (size > APPLIED * size.max()), moving & (size < RELEASED * size.max())
    if min(np.count_nonzero(applied), np.count_nonzero(released)) < LEAST_SAMPLES:
        return None
    with_brake, without = -float(np.mean(rate[applied])), -float(np.mean(rate[released]))
    negative = float(np.mean(brake[applied])) < 0.0
    if negative and with_brake > without + WITHOUT_BRAKE:
        return f"channel {name} is negative while the car brakes: turn its sign over"
    if not negative and without > with_brake + WITHOUT_BRAKE:
        return (
            f"channel {name} is no brake: the car slows by {with_brake:.3g} m/s^2 while it is high and by {without:.3g}"
            " while it is low: correct its source, which may be swapped with another channel's"
        )
    return None
