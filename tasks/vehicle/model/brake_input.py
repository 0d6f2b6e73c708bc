"""Input of the driver: a brake command, or brake pressure as it was measured."""

from math import inf
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.vehicle.brake import PressureProfile, brake_pressure

NO_TRACE = np.empty(0)
NO_COMMAND = PressureProfile(0.0, 0.0, inf, 0.0, inf, inf)


class BrakeInput(NamedTuple):
    """The brake's input as the kernels take it; made by `brake_command` or `measured_trace`.

    Parameters
    ----------
    profile : the brake command; used where there is no trace
    trace : float64 [N] pressure at samples, linear between them and held beyond the last; empty for a command [MPa]
    interval : between the samples [s]
    hold_speed : keep the speed until the command's onset
    """

    profile: PressureProfile
    trace: NDArray[np.float64]
    interval: float
    hold_speed: bool


def brake_command(profile: PressureProfile, *, hold_speed: bool = False) -> BrakeInput:
    """Return a brake command as an input.

    Parameters
    ----------
    profile : the command
    hold_speed : keep the speed until its onset
    """
    return BrakeInput(profile, NO_TRACE, 1.0, hold_speed)


def measured_trace(pressure: NDArray[np.float64], interval: float) -> BrakeInput:
    """Return a measured pressure as an input.

    Parameters
    ----------
    pressure : float64 [N] at the samples [MPa]
    interval : between them [s]
    """
    return BrakeInput(NO_COMMAND, pressure, interval, False)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def pressure_at(time: float, onset: float, delay: float, drive: BrakeInput) -> float:
    """Pressure that the driver gives, after a delay [MPa].

    Parameters
    ----------
    time : since the start of the run [s]
    onset : of the brake command [s]
    delay : by which the pressure is late [s]
    drive : the input
    """
    last = len(drive.trace) - 1
    if last < 0:
        return brake_pressure(time - onset - delay, drive.profile)
    u = max(time - delay, 0.0) / drive.interval
    k = int(u)
    if k >= last:
        return float(drive.trace[last])
    return float(drive.trace[k] + (u - k) * (drive.trace[k + 1] - drive.trace[k]))
