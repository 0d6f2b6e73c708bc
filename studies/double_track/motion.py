"""Equations of motion of the double-track car: 39 states, compiled, for SciPy's integrators.

The body moves forward, heaves, pitches (nose-down positive) and rolls (left side up positive); each wheel moves up
and down and, on its bushings, forward and back; it turns, and its tyre has a slip of its own. Vertical states are
from rest.
"""

from math import cos, exp, pi, sin, tanh
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from studies.double_track.brakes import pad_factor, pad_pressure
from studies.double_track.suspension import (
    damper_force,
    dry_friction,
    spring_force,
    stop_force,
    swing_arm_force,
)
from studies.double_track.tyre import load_factor, magic_formula, slip_rate, stiffness_factor

STATION, SPEED, HEAVE, PITCH, ROLL, HEAVE_RATE, PITCH_RATE, ROLL_RATE = range(8)
HEIGHT, CLIMB, TURN, SLIP, PUSH, PUSH_RATE = range(8, 32, 4)
"""First of four states: wheel height and its rate, wheel speed, slip, place on the bushings and its rate."""
LINE, DISC, HEAT = 32, 33, 35
"""Pressure in the line; first of the axles' disc temperatures; first of the wheels' heat of sliding."""
STATES = 39
FORCE_PORT, TORQUE_PORT, FRICTION_PORT, PITCH_PORT, STRUT_PORT = range(5)
PORTS = ("longitudinal_force", "brake_torque", "friction", "pitch_moment", "suspension_force")
VARIABLES = (
    "time", "speed", "pressure", "disc_temperature", "pressure_rate", "load_ratio", "suspension_travel",
    "suspension_speed", "deceleration",
)  # fmt: skip


class Inputs(NamedTuple):
    """Inputs of a run as tables at even times.

    Parameters
    ----------
    interval : between the samples [s]
    pressure : at the master cylinder [MPa]
    force, friction, moment : smooth disturbances [N, 1, N m]
    drive : of the engine at the front wheels [N m]
    form_keys : int64 [3] port and variable of a form, and 1 if it acts on wet roads only; port -1 for none
    form : float64 [2 + K] lowest and highest value of the variable, then the port's values between
    """

    interval: float
    pressure: NDArray[np.float64]
    force: NDArray[np.float64]
    friction: NDArray[np.float64]
    moment: NDArray[np.float64]
    drive: NDArray[np.float64]
    form_keys: NDArray[np.int64]
    form: NDArray[np.float64]


@njit(error_model="numpy")
def table_at(time: float, interval: float, table: NDArray[np.float64]) -> float:
    """Value of a table between its samples, held at both ends.

    Parameters
    ----------
    time : since the first sample [s]
    interval : between the samples [s]
    table : float64 [N]
    """
    place = min(max(time / interval, 0.0), len(table) - 1.0)
    k = min(int(place), len(table) - 2)
    return table[k] + (place - k) * (table[k + 1] - table[k])


@njit(error_model="numpy")
def form_at(port: int, variables: NDArray[np.float64], wet: float, inputs: Inputs) -> float:
    """Value of the run's form at a port; 0 where it has none [unit of the port].

    Parameters
    ----------
    port : place in `PORTS`
    variables : float64 [9] in the order of `VARIABLES`
    wet : 1 on a wet road
    inputs : of the run
    """
    keys, form = inputs.form_keys, inputs.form
    if keys[0] != port or (keys[2] == 1 and wet == 0.0):
        return 0.0
    return table_at(variables[keys[1]] - form[0], (form[1] - form[0]) / (len(form) - 3), form[2:])


@njit(error_model="numpy")
def road_at(station: float, center: float, length: float, height: float) -> tuple[float, float]:
    """Height [m] and slope [1] of a raised cosine.

    Parameters
    ----------
    station : along the road [m]
    center, length, height : of the feature [m]
    """
    if length <= 0.0 or abs(station - center) >= 0.5 * length:
        return 0.0, 0.0
    turn = 2.0 * pi / length
    angle = turn * (station - center)
    return 0.5 * height * (1.0 + cos(angle)), -0.5 * height * turn * sin(angle)


@njit(error_model="numpy")
def line_pressure(time: float, state: NDArray[np.float64], record: NDArray[np.void], inputs: Inputs) -> float:
    """Pressure in the brake line: of the driver, late by the dead time, or the lagging state [MPa].

    Parameters
    ----------
    time : [s]
    state : float64 [39]
    record : the car
    inputs : of the run
    """
    if record[0].lag > 0.0:
        return state[LINE]
    return table_at(time - record[0].dead_time, inputs.interval, inputs.pressure)


@njit(error_model="numpy")
def find_rates(
    time: float,
    state: NDArray[np.float64],
    record: NDArray[np.void],
    inputs: Inputs,
    caps: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Rates of all states, float64 [39].

    Parameters
    ----------
    time : [s]
    state : float64 [39]
    record : the car, shape (1,)
    inputs : of the run
    caps : float64 [3, 4] pressure limits of the wheels [MPa], their relative rates [1/s], and in [2] the time at
        which they held [s] and the pressure that the rates act on besides [MPa]
    """
    car = record[0]
    rate = np.zeros(STATES)
    v, pitch, roll = state[SPEED], state[PITCH], state[ROLL]
    commanded = table_at(time - car.dead_time, inputs.interval, inputs.pressure)
    line = line_pressure(time, state, record, inputs)
    if car.lag > 0.0:
        tau = car.lag if commanded > line else car.lag * car.release_lag_ratio
        rate[LINE] = (commanded - line) / tau
    variables = np.zeros(9)
    variables[0], variables[1], variables[2] = time, v, line
    later = table_at(time - car.dead_time + 0.01, inputs.interval, inputs.pressure)
    before = table_at(time - car.dead_time - 0.01, inputs.interval, inputs.pressure)
    variables[4] = (later - before) / 0.02
    grip = 1.0 + table_at(time, inputs.interval, inputs.friction)
    climb = car.gravity * car.grade * car.direction
    whole = car.body_mass
    for i in range(4):
        whole += car.wheel_mass[i]
    moment = table_at(time, inputs.interval, inputs.moment)
    pull, up, turn, tilt = 0.0, car.aero_lift * v * v, 0.0, 0.0
    anti_roll = car.roll_stiffness * roll
    for i in range(4):
        axle = i // 2
        station = state[STATION] - (0.0 if axle == 0 else car.wheelbase) + state[PUSH + i]
        height, slope = road_at(station, car.hazard_center, car.hazard_length, car.hazard_height)
        hub_speed = v + state[PUSH_RATE + i]
        omega, slip = state[TURN + i], state[SLIP + i]
        # what carries the wheel
        squeeze = height - state[HEIGHT + i]
        load = car.static_load[i] + car.tyre_stiffness[i] * squeeze
        if load > 0.0:
            load = max(load + car.tyre_damping * (v * slope - state[CLIMB + i]), 0.0)
        load = max(load, 0.0)
        ratio = load / car.static_load[i]
        travel = state[HEAVE] - car.ahead[i] * pitch + car.aside[i] * roll - state[HEIGHT + i]
        speed = (
            state[HEAVE_RATE]
            - car.ahead[i] * state[PITCH_RATE]
            + car.aside[i] * state[ROLL_RATE]
            - state[CLIMB + i]
        )
        variables[3], variables[5] = state[DISC + axle], ratio
        variables[6], variables[7] = travel, speed
        # brake
        cap = (caps[0, i] + caps[2, 1]) * exp(caps[1, i] * (time - caps[2, 0])) - caps[2, 1]
        held = min(line, cap)
        share = car.front_share + car.bias_pressure * line
        share = 0.5 * share if axle == 0 else 0.5 * (1.0 - share)
        pad_share = 0.5 * car.pad_drag_front if axle == 0 else 0.5 * (1.0 - car.pad_drag_front)
        pressing = pad_pressure(held, car.push_out, car.push_out_width)
        factor = pad_factor(
            held, car.radius * omega, state[DISC + axle], car.pressure_curve, car.fade, car.pad_speed,
            car.pad_speed_reference,
        )  # fmt: skip
        factor *= max(1.0 + form_at(TORQUE_PORT, variables, car.wet, inputs), 0.0)
        turning = tanh(omega / car.lock_speed)
        brake = (share * car.brake_gain * pressing * factor + pad_share * car.pad_drag) * turning
        rate[DISC + axle] += brake * omega / car.disc_capacity[axle]
        # drive shaft of the front axle, against the rotation
        shaft = 0.0
        if axle == 0:
            shaft = 0.5 * (car.engine_torque * turning + car.engine_viscous * omega)
            shaft -= 0.5 * table_at(time, inputs.interval, inputs.drive)
            rim = car.radius * omega
            if car.creep_force > 0.0 and rim < car.creep_speed:
                shaft -= 0.5 * car.creep_force * car.radius * (1.0 - rim / car.creep_speed)
        # tyre
        hot = 1.0 / (1.0 + car.tyre_heating * state[HEAT + i] / 0.5e5)
        film = 1.0 - car.wet * car.wet_speed * max(v - car.wet_threshold, 0.0)
        peak = car.peak * grip * hot * max(film, 0.0)
        peak *= load_factor(ratio, car.load_exponent + car.load_sensitivity)
        peak *= max(1.0 + form_at(FRICTION_PORT, variables, car.wet, inputs), 0.0)
        stiffness = car.slip_stiffness * stiffness_factor(ratio, car.stiffness_by_load)
        braking = load * magic_formula(slip, peak, stiffness, car.shape, car.curvature)
        rate[SLIP + i] = slip_rate(slip, hub_speed, car.radius * omega, car.relaxation[i], car.slow_speed)
        rate[HEAT + i] = abs(braking * (hub_speed - car.radius * omega)) - car.tyre_cooling * state[HEAT + i]
        # wheel
        rolling = load * car.radius * (car.rolling_coefficient + car.rolling_speed * v) * turning
        rate[TURN + i] = (car.radius * braking - brake - shaft - rolling) / car.wheel_inertia[i]
        snow = car.ploughing * car.snow_depth_mm * (0.35 if axle == 0 else 0.15) * (0.9 + 0.01 * v)
        link = car.fore_aft_stiffness * state[PUSH + i] + car.fore_aft_damping * state[PUSH_RATE + i]
        rate[PUSH_RATE + i] = -(braking + load * slope + snow + link) / car.wheel_mass[i] - climb
        # strut
        force = spring_force(travel, car.spring[i], 0.5 * car.progressive_rate)
        force += damper_force(speed, car.damper[i], car.damper_knee, car.damper_asymmetry)
        force += stop_force(travel, car.stop_clearance, car.stop_stiffness, car.stop_growth)
        force += dry_friction(speed, 0.5 * car.coulomb_friction, car.dry_friction_speed)
        force += 0.5 * form_at(STRUT_PORT, variables, car.wet, inputs)
        force += anti_roll / (2.0 * car.aside[i])
        force -= swing_arm_force(brake, car.radius, car.tangent[i], travel, car.migration)
        rate[HEIGHT + i], rate[PUSH + i] = state[CLIMB + i], state[PUSH_RATE + i]
        rate[CLIMB + i] = (force + load - car.static_load[i]) / car.wheel_mass[i]
        # body
        pull += link
        up -= force
        turn += car.ahead[i] * force - link * car.body_lever + brake + shaft
        tilt -= car.aside[i] * force
    air = v + car.direction * car.wind_speed
    drag = 0.5 * car.air_density * car.drag_area * air * abs(air)
    against = drag + whole * car.coast + table_at(time, inputs.interval, inputs.force)
    against += form_at(FORCE_PORT, variables, car.wet, inputs)
    rate[STATION] = v
    rate[SPEED] = (pull - against) / car.body_mass - climb
    variables[8] = -rate[SPEED]
    moment += form_at(PITCH_PORT, variables, car.wet, inputs)
    rate[HEAVE], rate[PITCH], rate[ROLL] = state[HEAVE_RATE], state[PITCH_RATE], state[ROLL_RATE]
    rate[HEAVE_RATE] = up / car.body_mass
    rate[PITCH_RATE] = (turn + moment - drag * car.drag_lever) / car.pitch_inertia
    rate[ROLL_RATE] = tilt / car.roll_inertia
    cooling = car.disc_cooling + car.disc_cooling_by_speed * v
    for axle in range(2):
        rate[DISC + axle] -= cooling * state[DISC + axle] / car.disc_capacity[axle]
    for i in range(4):
        rate[PUSH_RATE + i] -= rate[SPEED]
    return rate
