"""Input of the driver: a brake command, or brake pressure and engine torque as they were measured."""

from math import inf
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from tasks.vehicle.brake import PressureProfile, compute_brake_pressure

NO_TRACE = np.empty(0)
NO_COMMAND = PressureProfile(0.0, 0.0, inf, 0.0, inf, inf)


class BrakeInput(NamedTuple):
    """The brake's input in the form that the kernels take; `make_command_input` and `make_trace_input` make it.

    Parameters
    ----------
    profile : the brake command; used where there is no trace
    trace : float64 [N] pressure at samples, linear between them and held beyond the last; empty for a command [MPa]
    interval : time between the samples [s]
    hold_speed : keep the speed until the command's onset
    engine : float64 [N] torque of the engine at the wheels at the samples, driving positive; empty for none [N m]
    begin : time of the first sample, which holds before it too [s]
    """

    profile: PressureProfile
    trace: NDArray[np.float64]
    interval: float
    hold_speed: bool
    engine: NDArray[np.float64]
    begin: float = 0.0


def make_command_input(profile: PressureProfile, *, hold_speed: bool = False) -> BrakeInput:
    """Return a brake command as an input.

    Parameters
    ----------
    profile : brake command
    hold_speed : keep the speed until its onset
    """
    return BrakeInput(profile, NO_TRACE, 1.0, hold_speed, NO_TRACE)


def make_trace_input(
    pressure: NDArray[np.float64], interval: float, engine: NDArray[np.float64] | None = None
) -> BrakeInput:
    """Return a measured pressure as an input, with the engine's torque where that was measured.

    Parameters
    ----------
    pressure : float64 [N] pressure at the samples [MPa]
    interval : time between samples [s]
    engine : float64 [N] torque at the wheels, driving positive [N m]
    """
    return BrakeInput(NO_COMMAND, pressure, interval, False, NO_TRACE if engine is None else engine)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_input_pressure(time: float, onset: float, delay: float, drive: BrakeInput) -> float:
    """Return the pressure that the driver gives, after a delay [MPa].

    Parameters
    ----------
    time : time since the start of the run [s]
    onset : onset of the brake command [s]
    delay : delay of the pressure [s]
    drive : input of the driver
    """
    if len(drive.trace) == 0:
        return compute_brake_pressure(time - onset - delay, drive.profile)
    return interpolate_trace(time - delay - drive.begin, drive.trace, drive.interval)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def interpolate_trace(time: float, trace: NDArray[np.float64], interval: float) -> float:
    """Return the value of a trace, linear between its samples and held beyond both ends [unit of the trace].

    Parameters
    ----------
    time : time since the first sample [s]
    trace : float64 [N], at least one sample [unit of the trace]
    interval : time between the samples [s]
    """
    last = len(trace) - 1
    u = max(time, 0.0) / interval
    k = int(u)
    if k >= last:
        return float(trace[last])
    return float(trace[k] + (u - k) * (trace[k + 1] - trace[k]))
