"""Wheels, brakes and longitudinal motion of paper mode, by explicit Euler steps (paper, Appendix B).

One step function serves the logged rollout and the lean stopping run. It multiplies by reciprocals because they
leave the loop, where divisions would stay in it.

The published step is too long for the wheels below about 4 m/s, where they chatter around the target slip: there
the last bit of a sum moves a stop by millimetres, up to 14 mm on light snow. Runs repeat bit by bit all the same.
"""

from math import isinf, nan
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.vehicle.brake import (
    PressureProfile,
    compute_abs_command,
    compute_brake_pressure,
    find_onset_by_position,
    limit_abs_rate,
)
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.road import RoadFeature, compute_road_slope
from tasks.vehicle.tyres.contract import Tyre, compute_braking_slip, compute_tyre_friction


class Axle(NamedTuple):
    """The wheels of one axle.

    Parameters
    ----------
    inertia : I_w [kg m2]
    brake_gain : brake torque per pressure, b_a K_p [N m/MPa]
    static_load : load without acceleration, by the analytic load transfer [N]
    """

    inertia: float
    brake_gain: float
    static_load: float


class Wheels(NamedTuple):
    """Longitudinal values of a vehicle in the form that the kernels take.

    Parameters
    ----------
    front, rear : the axles
    mass : m [kg]
    radius : R [m]
    wheelbase : L_w [m]
    transfer : load moved to the front per deceleration, m h_cg / L_w [N s2/m]
    release_width : delta_a of the ABS, relative to the target slip [1]
    build_rate, release_rate : largest rates of the ABS torque scale [1/s]
    coast : a_coast [m/s2]
    speed_floor, stop_speed : v_epsilon, and speed at or below which the vehicle stands [m/s]
    """

    front: Axle
    rear: Axle
    mass: float
    radius: float
    wheelbase: float
    transfer: float
    release_width: float
    build_rate: float
    release_rate: float
    coast: float
    speed_floor: float
    stop_speed: float


def build_wheels(vehicle: Vehicle) -> Wheels:
    """Return the longitudinal values of a vehicle."""
    share = vehicle.front_brake_share
    load_per_lever = vehicle.mass * vehicle.gravity / vehicle.wheelbase
    return Wheels(
        front=Axle(
            inertia=vehicle.wheel_inertia_f,
            brake_gain=share * vehicle.brake_gain,
            static_load=load_per_lever * vehicle.cg_to_rear_axle,
        ),
        rear=Axle(
            inertia=vehicle.wheel_inertia_r,
            brake_gain=(1 - share) * vehicle.brake_gain,
            static_load=load_per_lever * vehicle.cg_to_front_axle,
        ),
        mass=vehicle.mass,
        radius=vehicle.wheel_radius,
        wheelbase=vehicle.wheelbase,
        transfer=vehicle.mass * vehicle.cg_height / vehicle.wheelbase,
        release_width=vehicle.abs_release_width,
        build_rate=vehicle.abs_build_rate,
        release_rate=vehicle.abs_release_rate,
        coast=vehicle.coast_deceleration,
        speed_floor=vehicle.slip_speed_floor,
        stop_speed=vehicle.stop_speed,
    )


class AxleStep(NamedTuple):
    """One axle in one step: slip [1], tyre force [N], brake torque [N m], ABS scale [1], wheel rate [rad/s2]."""

    slip: float
    force: float
    torque: float
    scale: float
    rate: float


@njit(cache=True, nogil=True)
def compute_axle_step(
    speed: float,
    omega: float,
    load: float,
    pressure: float,
    scale: float,
    step: float,
    axle: Axle,
    wheels: Wheels,
    tyre: Tyre,
) -> AxleStep:
    """Return slip, ABS scale, tyre force and wheel acceleration of one axle (paper, from Eq. app_abs_command on).

    Parameters
    ----------
    speed : v [m/s]
    omega : wheel speed [rad/s]
    load : load of the axle [N]
    pressure : brake pressure [MPa]
    scale : ABS scale before the step [1]
    step : Euler step [s]
    axle, wheels, tyre : the axle's wheels, the vehicle's longitudinal values, its tyre on the surface
    """
    slip = compute_braking_slip(speed, wheels.radius * omega, wheels.speed_floor)
    wanted = compute_abs_command(slip, tyre.target_slip, wheels.release_width)
    scale = limit_abs_rate(wanted, scale, wheels.build_rate * step, wheels.release_rate * step)
    force = compute_tyre_friction(slip, load, tyre) * load
    torque = scale * (axle.brake_gain * pressure)
    return AxleStep(slip, force, torque, scale, (wheels.radius * force - torque) * (1.0 / axle.inertia))


@njit(cache=True, nogil=True)
def compute_transferred_loads(acceleration: float, wheels: Wheels) -> tuple[float, float]:
    """Return the axle loads by longitudinal load transfer, F_z^long [N] (paper, Appendix B).

    Parameters
    ----------
    acceleration : dv/dt [m/s2]
    wheels : static loads and transfer
    """
    moved = wheels.transfer * acceleration
    return max(wheels.front.static_load - moved, 0.0), max(wheels.rear.static_load + moved, 0.0)


@njit(cache=True, nogil=True)
def simulate_stop(
    initial_speed: float, step: float, longest: int, profile: PressureProfile, wheels: Wheels, tyre: Tyre
) -> tuple[float, float]:
    """Brake on a flat road from t = 0 to the stop, without a log.

    Parameters
    ----------
    initial_speed : speed at the brake onset [m/s]
    step : Euler step [s]
    longest : largest number of steps [1]
    profile : brake command with its onset at 0
    wheels, tyre : the vehicle on its surface

    Returns
    -------
    Stopping distance [m] and time [s]; NaN when it does not stop.
    """
    speed, omega_f, omega_r = initial_speed, initial_speed / wheels.radius, initial_speed / wheels.radius
    scale_f, scale_r, acceleration, distance = 1.0, 1.0, 0.0, 0.0
    for n in range(longest):
        pressure = compute_brake_pressure(n * step, profile)
        load_f, load_r = compute_transferred_loads(acceleration, wheels)
        f = compute_axle_step(speed, omega_f, load_f, pressure, scale_f, step, wheels.front, wheels, tyre)
        r = compute_axle_step(speed, omega_r, load_r, pressure, scale_r, step, wheels.rear, wheels, tyre)
        scale_f, scale_r = f.scale, r.scale
        acceleration = -(f.force + r.force) * (1.0 / wheels.mass) - wheels.coast
        after = speed + step * acceleration
        distance += 0.5 * step * (speed + after)
        speed = after
        omega_f += step * f.rate
        omega_r += step * r.rate
        if speed <= wheels.stop_speed:
            return distance, (n + 1) * step
    return nan, nan


DRIVE_COLUMNS = (
    "station", "speed", "longitudinal_acceleration", "braking_slip_f", "braking_slip_r", "wheel_speed_f",
    "wheel_speed_r", "tyre_force_f", "tyre_force_r", "tyre_load_f", "tyre_load_r", "brake_torque_f",
    "brake_torque_r", "abs_scale_f", "abs_scale_r", "brake_pressure_mpa", "road_force",
)  # fmt: skip
"""Columns of the log that ``simulate_drive`` returns."""


@njit(cache=True, nogil=True)
def simulate_drive(
    initial_speed: float,
    hold_speed: bool,
    steps: int,
    step: float,
    profile: PressureProfile,
    road: RoadFeature,
    loads: NDArray[np.float64],
    wheels: Wheels,
    tyre: Tyre,
) -> tuple[NDArray[np.float64], float, int]:
    """Drive, brake and stand on a road, and log every sample.

    Parameters
    ----------
    initial_speed : speed at the start [m/s]
    hold_speed : keep the speed until the brake onset
    steps : number of Euler steps
    step : Euler step [s]
    profile : brake command
    road : road feature
    loads : half-car loads of the front and rear axle at each sample, shape (steps + 1, 2) [N]; with shape
        (0, 2) the analytic load transfer feeds the tyres
    wheels, tyre : the vehicle on its surface

    Returns
    -------
    The log, shape (steps + 1, len(DRIVE_COLUMNS)); the brake onset [s], infinite if it never comes; the sample
    of the stop, -1 if there is none.
    """
    log = np.empty((steps + 1, 17))
    station, speed = 0.0, initial_speed
    omega_f, omega_r = initial_speed / wheels.radius, initial_speed / wheels.radius
    scale_f, scale_r, acceleration = 1.0, 1.0, 0.0
    onset, stop = profile.onset_time, -1
    for n in range(steps + 1):
        if isinf(onset):
            onset = find_onset_by_position(n * step, station, speed, profile)
        pressure = compute_brake_pressure(n * step - onset, profile)
        if len(loads) > 0:
            load_f, load_r = loads[n, 0], loads[n, 1]
        else:
            load_f, load_r = compute_transferred_loads(acceleration, wheels)
        f = compute_axle_step(speed, omega_f, load_f, pressure, scale_f, step, wheels.front, wheels, tyre)
        r = compute_axle_step(speed, omega_r, load_r, pressure, scale_r, step, wheels.rear, wheels, tyre)
        road_force = -load_f * compute_road_slope(station, road) - load_r * compute_road_slope(
            station - wheels.wheelbase, road
        )
        acceleration = (road_force - (f.force + r.force)) * (1.0 / wheels.mass) - wheels.coast
        if stop >= 0:
            road_force, acceleration = 0.0, 0.0
        elif hold_speed and n * step < onset:
            acceleration = 0.0
        log[n] = (
            station, speed, acceleration, f.slip, r.slip, omega_f, omega_r, f.force, r.force, load_f, load_r,
            f.torque, r.torque, f.scale, r.scale, pressure, road_force,
        )  # fmt: skip
        if stop >= 0 or n == steps:
            continue
        after = speed + step * acceleration
        station += 0.5 * step * (speed + after)
        speed, scale_f, scale_r = after, f.scale, r.scale
        omega_f += step * f.rate
        omega_r += step * r.rate
        if speed <= wheels.stop_speed:
            stop = n + 1
            speed, omega_f, omega_r, acceleration, scale_f, scale_r = 0.0, 0.0, 0.0, 0.0, 1.0, 1.0
    return log, onset, stop
