"""Coupled mode: one time loop over speed, wheels, body, contact, and the heat of tyres and discs."""

from math import inf, isinf

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.surface.road_profile import RoadHazard
from tasks.vehicle.brake import PressureProfile, brake_pressure, onset_by_position
from tasks.vehicle.effects.brake_line import line_after
from tasks.vehicle.effects.ports import INDEX
from tasks.vehicle.effects.slots import SlotTables, slot_tables
from tasks.vehicle.history import History
from tasks.vehicle.model.chassis import Chassis, chassis_of
from tasks.vehicle.model.coupled_step import coupled_step
from tasks.vehicle.model.ports import ports_at
from tasks.vehicle.model.states import AT_REST, Instant, Memory, Motion, without_slip
from tasks.vehicle.parameters import SurfaceResponse, Vehicle
from tasks.vehicle.road import RoadFeature, road_feature
from tasks.vehicle.tyres.contract import Tyre

REST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_LAG, _DEAD_TIME = INDEX["lag"], INDEX["dead_time"]

COUPLED_COLUMNS = (
    "station", "speed", "longitudinal_acceleration", "braking_slip_f", "braking_slip_r", "wheel_speed_f",
    "wheel_speed_r", "tyre_force_f", "tyre_force_r", "tyre_load_f", "tyre_load_r", "brake_torque_f",
    "brake_torque_r", "abs_scale_f", "abs_scale_r", "brake_pressure_mpa", "road_force", "heave", "pitch",
    "unsprung_heave_f", "unsprung_heave_r", "heave_rate", "pitch_rate", "road_height_f", "road_height_r",
)  # fmt: skip
"""Columns of the log that ``drive_coupled`` returns."""


@njit(cache=True, nogil=True, error_model="numpy")
def drive_coupled(
    initial_speed: float,
    hold_speed: bool,
    steps: int,
    per_tick: int,
    step: float,
    profile: PressureProfile,
    road: RoadFeature,
    forms: SlotTables | None,
    chassis: Chassis,
    tyre: Tyre,
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
    forms : what no effect of the library has; None compiles to a loop that knows no forms
    chassis, tyre : the vehicle on its surface

    Returns
    -------
    The log, shape (steps / per_tick + 1, len(COUPLED_COLUMNS)); the brake onset [s], the station there [m] and
    the time of the stop [s], each infinite if it never comes.
    """
    log = np.empty((steps // per_tick + 1, 25))
    wheels = chassis.wheels
    rolling = initial_speed / wheels.radius
    motion, memory, x = Motion(0.0, initial_speed, rolling, rolling), Memory(AT_REST, AT_REST), REST
    scale_f, scale_r, deceleration = 1.0, 1.0, 0.0
    onset, onset_station, stop = profile.onset_time, inf, inf
    standing = False
    line, dead = 0.0, chassis.theta[_DEAD_TIME]
    for n in range(steps + 1):
        time = n * step
        if isinf(onset):
            onset = onset_by_position(time, motion.station, motion.speed, profile)
        if isinf(onset_station) and time >= onset:
            onset_station = motion.station - motion.speed * (time - onset)
        held = hold_speed and time < onset
        commanded = brake_pressure(time - onset - dead, profile)
        if n == 0 or chassis.theta[_LAG] <= 0.0:
            line = commanded
        next_commanded = brake_pressure(time + step - onset - dead, profile)
        next_line = line_after(line, commanded, next_commanded, step, chassis.theta)
        rate = (next_line - line) / step
        instant = Instant(time, line, rate, deceleration, standing, held)
        ports = ports_at(motion, memory, x, instant, scale_f, scale_r, step, forms, chassis, tyre, road)
        if n % per_tick == 0:
            f, r = ports.front, ports.rear
            log[n // per_tick] = (
                motion.station, motion.speed, ports.acceleration, f.slip, r.slip, motion.omega_f, motion.omega_r,
                f.tyre_force, r.tyre_force, f.ground.load, r.ground.load, f.brake_torque, r.brake_torque, f.abs_scale,
                r.abs_scale, brake_pressure(time - onset, profile), ports.road_force, x[0], x[1], x[2], x[3], x[4],
                x[5], f.ground.height, r.ground.height,
            )  # fmt: skip
        if n == steps:
            break
        deceleration = -ports.acceleration
        next_instant = Instant(time + step, next_line, rate, deceleration, standing, held)
        motion, memory, x = coupled_step(
            motion, memory, x, ports, instant, next_instant, step, forms, chassis, tyre, road
        )
        line, scale_f, scale_r = next_line, ports.front.abs_scale, ports.rear.abs_scale
        if not standing and motion.speed <= wheels.stop_speed:
            standing, stop = True, time + step
            motion, memory = Motion(motion.station, 0.0, 0.0, 0.0), without_slip(memory)
    return log, onset, onset_station, stop


def run_coupled_mode(
    vehicle: Vehicle,
    response: SurfaceResponse,
    initial_speed: float,
    hold_speed: bool,
    profile: PressureProfile,
    hazard: RoadHazard,
    *,
    snow_depth_mm: float,
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
    snow_depth_mm : of the snow on the road [mm]
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
        slot_tables([form.slot for form in vehicle.forms]) if vehicle.forms else None,
        chassis_of(vehicle, response, snow_depth_mm),
        response.tyre,
    )
    columns = dict(zip(COUPLED_COLUMNS, log.T.copy(), strict=True))
    columns |= {f"axle_load_{axle}": columns[f"tyre_load_{axle}"] for axle in "fr"}
    return History(columns=columns, onset=onset, onset_station=onset_station, stop_time=stop_time)
