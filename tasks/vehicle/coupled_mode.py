"""Coupled mode: one time loop over speed, wheels, body and contact, by a W-method of second order.

The method is ROS2 (Verwer et al. 1999, doi:10.1137/S1064827597326651), which keeps its order for any matrix in
the place of the Jacobian. Here that matrix holds only the stiff slip that ties speed and wheels: with it the
wheels stay quiet to standstill; everywhere else (body, axles, road) the method is Heun's.
"""

from math import inf, isinf, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.surface.road_profile import RoadHazard
from tasks.vehicle.brake import PressureProfile, brake_pressure, onset_by_position
from tasks.vehicle.effects.brake_line import acting_pressure, disc_rise_after, line_after
from tasks.vehicle.half_car import HalfCar, HalfCarState, half_car_rates, moved
from tasks.vehicle.history import History
from tasks.vehicle.parameters import SurfaceResponse, Vehicle
from tasks.vehicle.ports import Chassis, Motion, Ports, chassis_of, ports_at
from tasks.vehicle.road import RoadFeature, road_feature
from tasks.vehicle.slip_matrix import axle_slope, solve_slip, without_speed
from tasks.vehicle.tyre import TyreCurve

GAMMA = 1.0 - sqrt(0.5)
REST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

COUPLED_COLUMNS = (
    "station", "speed", "longitudinal_acceleration", "braking_slip_f", "braking_slip_r", "wheel_speed_f",
    "wheel_speed_r", "tyre_force_f", "tyre_force_r", "tyre_load_f", "tyre_load_r", "brake_torque_f",
    "brake_torque_r", "abs_scale_f", "abs_scale_r", "brake_pressure_mpa", "road_force", "heave", "pitch",
    "unsprung_heave_f", "unsprung_heave_r", "heave_rate", "pitch_rate", "road_height_f", "road_height_r",
)  # fmt: skip
"""Columns of the log that ``drive_coupled`` returns."""


@njit(cache=True, nogil=True)
def motion_rates(motion: Motion, ports: Ports, standing: bool, chassis: Chassis) -> Motion:
    """Rates of station, speed and wheel speeds (paper, Eq. app_longitudinal_complete).

    Parameters
    ----------
    motion : the state
    ports : what acts in it
    standing : the vehicle has come to rest
    chassis : the values
    """
    if standing:
        return Motion(0.0, 0.0, 0.0, 0.0)
    f, r, wheels = ports.front, ports.rear, chassis.wheels
    return Motion(
        motion.speed,
        ports.acceleration,
        (f.lever * f.tyre_force - f.brake_torque - f.ground_moment) / wheels.front.inertia,
        (r.lever * r.tyre_force - r.brake_torque - r.ground_moment) / wheels.rear.inertia,
    )


@njit(cache=True, nogil=True)
def body_rates(x: HalfCarState, ports: Ports, body: HalfCar) -> HalfCarState:
    """Rate of the half-car state under the ports (paper, Eq. app_half_car_complete).

    Parameters
    ----------
    x : half-car state [m, rad, m/s, rad/s]
    ports : what acts in it
    body : the half-car
    """
    return half_car_rates(
        x,
        ports.front.ground.load,
        ports.rear.ground.load,
        ports.front.suspension_force,
        ports.rear.suspension_force,
        ports.pitch_moment,
        body,
    )


@njit(cache=True, nogil=True)
def drive_coupled(
    initial_speed: float,
    hold_speed: bool,
    steps: int,
    per_tick: int,
    step: float,
    profile: PressureProfile,
    road: RoadFeature,
    chassis: Chassis,
    tyre: TyreCurve,
) -> tuple[NDArray[np.float64], float, float, float]:
    """Drive, brake and stand, logging every ``per_tick``-th sample.

    Parameters
    ----------
    initial_speed : [m/s]
    hold_speed : keep the speed until the brake onset
    steps : number of internal steps
    per_tick : internal steps between logged samples
    step : internal step [s]
    profile : brake command
    road : road feature
    chassis, tyre : the vehicle on its surface

    Returns
    -------
    The log, shape (steps / per_tick + 1, len(COUPLED_COLUMNS)); the brake onset [s], the station there [m] and
    the time of the stop [s], each infinite if it never comes.
    """
    log = np.empty((steps // per_tick + 1, 25))
    wheels = chassis.wheels
    rolling = initial_speed / wheels.radius
    motion, x = Motion(0.0, initial_speed, rolling, rolling), REST
    scale_f, scale_r = 1.0, 1.0
    onset, onset_station, stop = profile.onset_time, inf, inf
    standing = False
    line, disc_rise, dead = 0.0, 0.0, chassis.effects.dead_time
    for n in range(steps + 1):
        time = n * step
        if isinf(onset):
            onset = onset_by_position(time, motion.station, motion.speed, profile)
        if isinf(onset_station) and time >= onset:
            onset_station = motion.station - motion.speed * (time - onset)
        held = hold_speed and time < onset
        pressure = brake_pressure(time - onset, profile)
        if n == 0 or chassis.effects.lag <= 0.0:
            line = brake_pressure(time - onset - dead, profile)
        acting = acting_pressure(line, motion.speed, disc_rise, chassis.effects)
        ports = ports_at(motion, x, acting, scale_f, scale_r, step, standing, held, chassis, tyre, road)
        if n % per_tick == 0:
            f, r = ports.front, ports.rear
            log[n // per_tick] = (
                motion.station, motion.speed, ports.acceleration, f.slip, r.slip, motion.omega_f, motion.omega_r,
                f.tyre_force, r.tyre_force, f.ground.load, r.ground.load, f.brake_torque, r.brake_torque, f.abs_scale,
                r.abs_scale, pressure, ports.road_force, x[0], x[1], x[2], x[3], x[4], x[5], f.ground.height,
                r.ground.height,
            )  # fmt: skip
        if n == steps:
            break
        line = line_after(line, brake_pressure(time + step - onset - dead, profile), step, chassis.effects)
        next_acting = acting_pressure(line, motion.speed, disc_rise, chassis.effects)
        power = ports.front.brake_torque * motion.omega_f + ports.rear.brake_torque * motion.omega_r
        disc_rise = disc_rise_after(disc_rise, power, step)
        motion, x = coupled_step(
            motion, x, ports, acting, next_acting, step, standing, held, chassis, tyre, road
        )
        scale_f, scale_r = ports.front.abs_scale, ports.rear.abs_scale
        if not standing and motion.speed <= wheels.stop_speed:
            standing, stop = True, time + step
            motion = Motion(motion.station, 0.0, 0.0, 0.0)
    return log, onset, onset_station, stop


@njit(cache=True, nogil=True)
def coupled_step(
    motion: Motion,
    x: HalfCarState,
    ports: Ports,
    pressure: float,
    next_pressure: float,
    step: float,
    standing: bool,
    held: bool,
    chassis: Chassis,
    tyre: TyreCurve,
    road: RoadFeature,
) -> tuple[Motion, HalfCarState]:
    """One ROS2 step from a state whose ports are known.

    Parameters
    ----------
    motion, x : longitudinal and half-car state
    ports : what acts in it
    pressure, next_pressure : now and after the step [MPa]
    step : [s]
    standing, held : at rest; speed held from outside
    chassis, tyre, road : the values

    Returns
    -------
    The longitudinal and the half-car state after the step.
    """
    body, wheels = chassis.body, chassis.wheels
    front = axle_slope(ports.front, motion, motion.omega_f, pressure, step, wheels.front, chassis, tyre)
    rear = axle_slope(ports.rear, motion, motion.omega_r, pressure, step, wheels.rear, chassis, tyre)
    if held:
        front, rear = without_speed(front), without_speed(rear)
    k1 = solve_slip(motion_rates(motion, ports, standing, chassis), front, rear, GAMMA * step)
    h1 = body_rates(x, ports, body)
    ahead = Motion(
        motion.station + step * k1.station,
        motion.speed + step * k1.speed,
        motion.omega_f + step * k1.omega_f,
        motion.omega_r + step * k1.omega_r,
    )
    x_ahead = moved(x, h1, step)
    later = ports_at(
        ahead, x_ahead, next_pressure, ports.front.abs_scale, ports.rear.abs_scale, step, standing, held,
        chassis, tyre, road,
    )  # fmt: skip
    f2 = motion_rates(ahead, later, standing, chassis)
    rest = Motion(
        f2.station - 2.0 * k1.station,
        f2.speed - 2.0 * k1.speed,
        f2.omega_f - 2.0 * k1.omega_f,
        f2.omega_r - 2.0 * k1.omega_r,
    )
    k2 = solve_slip(rest, front, rear, GAMMA * step)
    h2 = body_rates(x_ahead, later, body)
    after = Motion(
        motion.station + step * (1.5 * k1.station + 0.5 * k2.station),
        motion.speed + step * (1.5 * k1.speed + 0.5 * k2.speed),
        motion.omega_f + step * (1.5 * k1.omega_f + 0.5 * k2.omega_f),
        motion.omega_r + step * (1.5 * k1.omega_r + 0.5 * k2.omega_r),
    )
    return after, moved(moved(x, h1, 0.5 * step), h2, 0.5 * step)


def run_coupled_mode(
    vehicle: Vehicle,
    response: SurfaceResponse,
    initial_speed: float,
    hold_speed: bool,
    profile: PressureProfile,
    hazard: RoadHazard,
    *,
    steps: int,
    step: float,
    per_tick: int,
) -> History:
    """Simulate one run with the physical model.

    Of the calibration only the tyre's peak and slip stiffness are used; pitch follows from the forces.

    Parameters
    ----------
    vehicle : the vehicle
    response : its tyres on the surface
    initial_speed : [m/s]
    hold_speed : keep the speed until the brake onset
    profile : brake command
    hazard : road feature
    steps, step : number and length of the internal steps [s]
    per_tick : internal steps between ticks
    """
    log, onset, onset_station, stop_time = drive_coupled(
        initial_speed,
        hold_speed,
        steps,
        per_tick,
        step,
        profile,
        road_feature(hazard),
        chassis_of(vehicle),
        response.tyre,
    )
    columns = dict(zip(COUPLED_COLUMNS, log.T.copy(), strict=True))
    columns |= {f"axle_load_{axle}": columns[f"tyre_load_{axle}"] for axle in "fr"}
    return History(columns=columns, onset=onset, onset_station=onset_station, stop_time=stop_time)
