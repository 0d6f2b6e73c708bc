"""The drive of paper mode on a road, logged at every sample: speed by explicit Euler steps (paper, Appendix B)."""

from math import inf, isinf

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from tasks.vehicle.brake import PressureProfile, compute_brake_pressure, find_onset_by_position
from tasks.vehicle.history import write_row
from tasks.vehicle.paper.wheel_step import solve_wheel_speed
from tasks.vehicle.paper.wheels import Wheels, compute_axle_step, compute_transferred_loads
from tasks.vehicle.road import Climb, RoadFeature, compute_climb, compute_road_slope
from tasks.vehicle.tyres.contract import Tyre

DRIVE_COLUMNS = (
    "station", "speed", "longitudinal_acceleration", "braking_slip_f", "braking_slip_r", "wheel_speed_f",
    "wheel_speed_r", "tyre_force_f", "tyre_force_r", "tyre_load_f", "tyre_load_r", "brake_torque_f",
    "brake_torque_r", "abs_scale_f", "abs_scale_r", "brake_pressure_mpa", "road_force",
)  # fmt: skip
"""Columns of the log that ``simulate_drive`` returns."""
_WIDTH = len(DRIVE_COLUMNS)


@njit(cache=True, nogil=True)
def simulate_drive(
    initial_speed: float,
    hold_speed: bool,
    steps: int,
    step: float,
    profile: PressureProfile,
    road: RoadFeature,
    climb: Climb,
    loads: NDArray[np.float64],
    implicit_below: float,
    wheels: Wheels,
    tyre: Tyre,
) -> tuple[NDArray[np.float64], float, int, float]:
    """Drive, brake and stand on a road, and log every sample.

    Parameters
    ----------
    initial_speed : speed at the start [m/s]
    hold_speed : keep the speed until the brake onset
    steps : number of Euler steps
    step : Euler step [s]
    profile : brake command
    road : road feature
    climb : of the road's grade
    loads : half-car loads of the front and rear axle at each sample, shape (steps + 1, 2) [N]; with shape
        (0, 2) the analytic load transfer feeds the tyres
    implicit_below : speed below which the wheels take the implicit step and the stop lies between two samples;
        0 takes the explicit step throughout, and the stop is the sample after it [m/s]
    wheels, tyre : the vehicle on its surface

    Returns
    -------
    The log, shape (steps + 1, len(DRIVE_COLUMNS)); the brake onset [s], infinite if it never comes; the sample
    of the stop, -1 if there is none; the time of the stop, infinite if there is none [s].
    """
    log = np.empty((steps + 1, _WIDTH))
    station, speed = 0.0, initial_speed
    omega_f, omega_r = initial_speed / wheels.radius, initial_speed / wheels.radius
    scale_f, scale_r, at_ground = 1.0, 1.0, 0.0
    onset, stop, stop_time = profile.onset_time, -1, inf
    for n in range(steps + 1):
        if isinf(onset):
            onset = find_onset_by_position(n * step, station, speed, profile)
        pressure = compute_brake_pressure(n * step - onset, profile)
        if len(loads) > 0:
            load_f, load_r = loads[n, 0], loads[n, 1]
        else:
            load_f, load_r = compute_transferred_loads(at_ground, wheels)
        f = compute_axle_step(speed, omega_f, load_f, pressure, scale_f, step, wheels.front, wheels, tyre)
        r = compute_axle_step(speed, omega_r, load_r, pressure, scale_r, step, wheels.rear, wheels, tyre)
        road_force = -load_f * compute_road_slope(station, road) - load_r * compute_road_slope(
            station - wheels.wheelbase, road
        )
        pull = compute_climb(station, climb)
        acceleration = (road_force - (f.force + r.force)) * (1.0 / wheels.mass) - wheels.coast - pull
        if stop >= 0:
            road_force, acceleration = 0.0, 0.0
        elif hold_speed and n * step < onset:
            acceleration = 0.0
        # what moves the load is the force at the ground, not the weight's share along the road
        at_ground = acceleration + pull
        sample = (
            station, speed, acceleration, f.slip, r.slip, omega_f, omega_r, f.force, r.force, load_f, load_r,
            f.torque, r.torque, f.scale, r.scale, pressure, road_force,
        )  # fmt: skip
        write_row(log, n, sample)
        if stop >= 0 or n == steps:
            break
        before, after = speed, speed + step * acceleration
        if after <= wheels.stop_speed:
            stop, stop_time = n + 1, (n + 1) * step
            if implicit_below > 0.0 and before > after:
                share = min(max((before - wheels.stop_speed) / (before - after), 0.0), 1.0)
                stop_time = (n + share) * step
                station += 0.5 * share * step * (before + wheels.stop_speed)
            else:
                station += 0.5 * step * (before + after)
            speed, omega_f, omega_r, scale_f, scale_r = 0.0, 0.0, 0.0, 1.0, 1.0
            at_ground = compute_climb(station, climb)
            continue
        station += 0.5 * step * (before + after)
        speed, scale_f, scale_r = after, f.scale, r.scale
        if after < implicit_below:
            omega_f = solve_wheel_speed(omega_f, after, load_f, pressure, f, step, wheels.front, wheels, tyre)
            omega_r = solve_wheel_speed(omega_r, after, load_r, pressure, r, step, wheels.rear, wheels, tyre)
        else:
            omega_f += step * f.rate
            omega_r += step * r.rate
    if stop >= 0:
        log_standing(log, stop, onset, step, profile, loads, compute_climb(station, climb), wheels)
    return log, onset, stop, stop_time


@register_jitable(cache=True)
def log_standing(
    log: NDArray[np.float64],
    stop: int,
    onset: float,
    step: float,
    profile: PressureProfile,
    loads: NDArray[np.float64],
    pull: float,
    wheels: Wheels,
) -> None:
    """Fill the log after the sample of the stop: a standing car changes its brake pressure and its loads alone.

    Parameters
    ----------
    log : log of `simulate_drive`, whose row of the stop is written
    stop : sample of the stop
    onset : brake onset [s]
    step : Euler step [s]
    profile, loads, wheels : as in `simulate_drive`
    pull : deceleration that the grade causes where the car stands [m/s2]
    """
    load_f, load_r = compute_transferred_loads(pull, wheels)
    for n in range(stop + 1, len(log)):
        pressure = compute_brake_pressure(n * step - onset, profile)
        if len(loads) > 0:
            load_f, load_r = loads[n, 0], loads[n, 1]
        write_row(log, n, log[stop])
        log[n, 9], log[n, 10], log[n, 15] = load_f, load_r, pressure
        log[n, 11] = log[stop, 13] * (wheels.front.brake_gain * pressure)
        log[n, 12] = log[stop, 14] * (wheels.rear.brake_gain * pressure)
