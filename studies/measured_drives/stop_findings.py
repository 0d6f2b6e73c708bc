"""Figures of a measured stop that the model cannot reproduce."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from studies.measured_drives.stop import REBOUND_S, Stop
from studies.measured_drives.stop_swing import STANDING
from tasks.vehicle.parameters import Vehicle

SMOOTHING_S = 0.1
NEAR_PEAK = 0.95
"""Share of the largest deceleration from which the tyres count as used up [1]."""
CYCLE_BAND = 0.02
"""A slip cycle swings at least this far up and down [1]."""


@dataclass(frozen=True, kw_only=True)
class Saturation:
    """Torque that goes on rising after the deceleration has stopped to.

    Parameters
    ----------
    torque_at_peak : bus torque where the deceleration first comes near its largest [N m]
    torque_largest : largest bus torque of the stop [N m]
    deceleration_at_peak, deceleration_then : at those two instants [m/s^2]
    share_used_before, share_used_then : deceleration times mass and radius over torque there [1]
    """

    torque_at_peak: float
    torque_largest: float
    deceleration_at_peak: float
    deceleration_then: float
    share_used_before: float
    share_used_then: float


@dataclass(frozen=True, kw_only=True)
class SlipCycles:
    """Swings of the front axle's braking slip while the tyres are near their limit.

    Parameters
    ----------
    cycles_per_s : [1/s]
    median, p95 : of the slip [1]
    """

    cycles_per_s: float
    median: float
    p95: float


@dataclass(frozen=True, kw_only=True)
class Rebound:
    """The body's swing after the stop, about its pitch at rest.

    Parameters
    ----------
    back : lowest pitch after the stop [deg]
    forth : highest pitch after that [deg]
    """

    back: float
    forth: float


@dataclass(frozen=True, kw_only=True)
class AfterStop:
    """The body's acceleration from its own standstill on, so that no error of the stop's time enters.

    Parameters
    ----------
    measured_peak, predicted_peak : largest forward acceleration [m/s^2]
    rmse : over 0.8 s [m/s^2]
    """

    measured_peak: float
    predicted_peak: float
    rmse: float


def after_stop(stop: Stop, predicted: Mapping[str, NDArray[np.float64]]) -> AfterStop:
    """Compare what follows the standstill, each from its own.

    Parameters
    ----------
    stop : measured; it comes to rest
    predicted : speed and longitudinal_acceleration of a prediction that comes to rest
    """
    count = round(REBOUND_S / stop.interval)

    def cut(columns: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        start = int(np.argmax(columns["speed"] <= STANDING))
        return columns["longitudinal_acceleration"][start : start + count]

    measured, found = cut(stop.columns), cut(predicted)
    shared = min(len(measured), len(found))
    error = found[:shared] - measured[:shared]
    return AfterStop(
        measured_peak=float(measured.max()),
        predicted_peak=float(found.max()),
        rmse=float(np.sqrt(np.mean(error**2))),
    )


def measure_saturation(stop: Stop, vehicle: Vehicle) -> Saturation:
    """How much of the bus's torque reaches the road.

    Parameters
    ----------
    stop : with brake_torque and longitudinal_acceleration
    vehicle : its mass and wheel radius
    """
    braking = slice(stop.onset, stop.slow)
    torque = stop.columns["brake_torque"][braking]
    deceleration = -_smoothed(stop.columns["longitudinal_acceleration"], stop.interval)[braking]
    peak = int(np.argmax(deceleration >= NEAR_PEAK * deceleration.max()))
    most = int(np.argmax(torque))
    lever = vehicle.mass * vehicle.wheel_radius
    return Saturation(
        torque_at_peak=float(torque[peak]),
        torque_largest=float(torque[most]),
        deceleration_at_peak=float(deceleration[peak]),
        deceleration_then=float(deceleration[most]),
        share_used_before=float(deceleration[peak] * lever / torque[peak]),
        share_used_then=float(deceleration[most] * lever / torque[most]),
    )


def slip_cycles(
    stop: Stop, columns: Mapping[str, NDArray[np.float64]], vehicle: Vehicle, parameters: Mapping[str, float]
) -> SlipCycles:
    """Slip of the front axle from speed and wheel speed, the wheel's sensor corrected.

    Parameters
    ----------
    stop : gives the window
    columns : measured or predicted speed and wheel_speed_front
    vehicle : its wheel radius
    parameters : wheel_radius (relative) and wheel_speed_delay [s] as fitted
    """
    radius = vehicle.wheel_radius * (1.0 + parameters.get("wheel_radius", 0.0))
    late = parameters.get("wheel_speed_delay", 0.0) / stop.interval
    index = np.arange(len(columns["speed"]), dtype=np.float64)
    wheel = np.interp(index + late, index, columns["wheel_speed_front"])
    slip = 1.0 - radius * wheel / np.maximum(columns["speed"], 0.5)
    inside = slice(stop.onset, stop.slow)
    swing, turns, last = slip[inside], 0, 0.0
    rising = True
    for value in swing:
        # a turn counts once the slip has come back from its extreme by the band
        if rising:
            last = max(last, float(value))
            if value < last - CYCLE_BAND:
                rising, last, turns = False, float(value), turns + 1
        else:
            last = min(last, float(value))
            if value > last + CYCLE_BAND:
                rising, last = True, float(value)
    seconds = len(swing) * stop.interval
    return SlipCycles(
        cycles_per_s=turns / seconds, median=float(np.median(swing)), p95=float(np.percentile(swing, 95))
    )


def measure_rebound(stop: Stop, pitch: NDArray[np.float64]) -> Rebound:
    """The swing back and forth after the stop, about the pitch at the end of the record.

    Parameters
    ----------
    stop : gives the window
    pitch : measured or predicted, float64 [N] [deg]
    """
    watched = pitch[stop.slow : stop.slow + round(2 * REBOUND_S / stop.interval)]
    if len(watched) < 3:
        return Rebound(back=nan, forth=nan)
    rest = float(np.mean(pitch[-round(0.3 / stop.interval) :]))
    low = int(np.argmin(watched))
    return Rebound(back=float(watched[low]) - rest, forth=float(np.max(watched[low:])) - rest)


def _smoothed(values: NDArray[np.float64], interval: float) -> NDArray[np.float64]:
    width = 2 * round(0.5 * SMOOTHING_S / interval) + 1
    half = width // 2
    return np.convolve(np.pad(values, half, mode="edge"), np.ones(width) / width, mode="valid")
