"""The vehicle model: one time loop over speed, wheels, body, contact, and the heat of tyres and discs.

Generated datasets, calibration and the closing of the loop all use it. They differ in the input (a brake command or a
measured pressure trace), in the step, and in how often they keep the motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isinf

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.vehicle.brake import find_onset_by_position
from tasks.vehicle.effects.brake_line import compute_line_pressure
from tasks.vehicle.effects.slots import Slot, SlotTables, pack_slots
from tasks.vehicle.history import write_row
from tasks.vehicle.model.axle_ports import compute_vertical_force
from tasks.vehicle.model.brake_input import BrakeInput, compute_input_pressure, interpolate_trace
from tasks.vehicle.model.chassis import Chassis, Conditions, build_chassis
from tasks.vehicle.model.ports import compute_ports
from tasks.vehicle.model.states import (
    STATE_WIDTH,
    Instant,
    Motion,
    VehicleState,
    clear_slip,
    make_rolling_state,
    pack_state,
    unpack_state,
)
from tasks.vehicle.model.step import take_step
from tasks.vehicle.parameters import SurfaceResponse, Vehicle
from tasks.vehicle.road import Climb, RoadFeature, compute_climb, make_climb, make_road_feature
from tasks.vehicle.tyres.contract import Tyre

INTERNAL_STEP_S = 0.0005
"""Internal step of a drive by a brake command, or by another program [s]."""
COLUMNS = (
    "station", "speed", "longitudinal_acceleration", "braking_slip_f", "braking_slip_r", "wheel_speed_f",
    "wheel_speed_r", "tyre_force_f", "tyre_force_r", "tyre_load_f", "tyre_load_r", "brake_torque_f",
    "brake_torque_r", "abs_scale_f", "abs_scale_r", "brake_pressure_mpa", "road_force", "heave", "pitch",
    "unsprung_heave_f", "unsprung_heave_r", "heave_rate", "pitch_rate", "road_height_f", "road_height_r",
    "heave_acceleration", "disc_rise_f", "disc_rise_r", "suspension_travel_f", "suspension_travel_r",
    "suspension_rate_f", "suspension_rate_r", "acting_pressure",
    "axle_load_f", "axle_load_r",
)  # fmt: skip
"""Columns of a history, in SI units but for the pressures [MPa]."""
COLUMN = {name: i for i, name in enumerate(COLUMNS)}
_WIDTH = len(COLUMNS)


@dataclass(frozen=True, kw_only=True)
class Simulation:
    """Motion of one run at equal intervals, and its events; infinity for an event that never comes.

    Parameters
    ----------
    history : float64 [N, len(COLUMNS)]
    states : float64 [N, S] state at each row, from which another run can start; empty unless asked for
    onset : brake onset of a brake command [s]
    onset_station : route position of the front axle at the onset [m]
    stop : time when the vehicle comes to rest [s]
    """

    history: NDArray[np.float64]
    states: NDArray[np.float64]
    onset: float
    onset_station: float
    stop: float

    def column(self, name: str) -> NDArray[np.float64]:
        """Return one column of the history, float64 [N] [its unit]; ``name`` is one of `COLUMNS`."""
        return self.history[:, COLUMN[name]]


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Samples that a simulation returns, and the steps between them.

    Parameters
    ----------
    samples : number of samples, the one at the start included
    interval : time between samples [s]
    substeps : internal steps between samples
    keep_states : return the state at each sample
    """

    samples: int
    interval: float
    substeps: int
    keep_states: bool = False

    @property
    def step(self) -> float:
        """Return the internal step [s]."""
        return self.interval / self.substeps


def simulate(
    vehicle: Vehicle,
    surface: SurfaceResponse,
    drive: BrakeInput,
    conditions: Conditions,
    recording: Recording,
    *,
    initial_speed: float = 0.0,
    start: NDArray[np.float64] | None = None,
    slots: Sequence[Slot] = (),
) -> Simulation:
    """Simulate one run with the vehicle's effects and forms.

    Of the paper's calibration only the tyre's peak and slip stiffness are used; pitch follows from the forces.

    Parameters
    ----------
    vehicle : the vehicle
    surface : its tyres on the surface
    drive : input of the driver
    conditions : road feature, snow, grade, direction, disc temperature
    recording : samples and internal steps
    initial_speed : speed at the start of the run, with the body at rest [m/s]
    start : row of an earlier run's states with the same step, to start from; replaces ``initial_speed``
    slots : tables that act in this run only, added to the vehicle's forms
    """
    tables = [form.slot for form in vehicle.forms] + list(slots)
    if start is None:
        state = make_rolling_state(
            initial_speed, vehicle.wheel_radius, conditions.disc_rise, drive.profile.onset_time
        )
    else:
        state = unpack_state(start)
    history = np.empty((recording.samples, _WIDTH))
    states = np.empty((recording.samples if recording.keep_states else 0, STATE_WIDTH))
    onset, onset_station, stop = integrate_motion(
        state,
        recording.samples,
        recording.substeps,
        recording.step,
        drive,
        make_road_feature(conditions.hazard),
        make_climb(conditions.grade, vehicle.gravity, conditions.direction),
        pack_slots(tables) if tables else None,
        build_chassis(vehicle, surface, conditions),
        surface.tyre,
        history,
        states,
    )
    return Simulation(history=history, states=states, onset=onset, onset_station=onset_station, stop=stop)


# without Numba's reference counts: each call of a port counted those of the slots' arrays, a third of the loop's time
@njit(cache=True, nogil=True, error_model="numpy", _nrt=False)
def integrate_motion(
    state: VehicleState,
    samples: int,
    substeps: int,
    step: float,
    drive: BrakeInput,
    road: RoadFeature,
    climb: Climb,
    slots: SlotTables | None,
    chassis: Chassis,
    tyre: Tyre,
    history: NDArray[np.float64],
    states: NDArray[np.float64],
) -> tuple[float, float, float]:
    """Integrate driving, braking and standing; fill ``history``, and ``states`` unless it is empty.

    Parameters
    ----------
    state : the start
    samples : rows to fill
    substeps : internal steps between them
    step : internal step [s]
    drive : input of the driver
    road : road feature
    climb : of the road's grade
    slots : forms and disturbances; with None the compiled loop leaves them out
    chassis, tyre : the vehicle on its surface
    history : float64 [samples, len(COLUMNS)]
    states : float64 [samples or 0, S]

    Returns
    -------
    The brake onset [s], the station there [m] and the time of the stop [s], each infinite if it never comes.
    """
    wheels, body = chassis.wheels, chassis.body
    motion, memory, x = state.motion, state.memory, state.body
    line, scale_f, scale_r, deceleration = state.line, state.scale_f, state.scale_r, state.deceleration
    standing, onset, onset_station, stop = state.standing, state.onset, state.onset_station, state.stop
    dead, lag = chassis.effects.dead_time, chassis.effects.lag
    first, last = round(state.time / step), (samples - 1) * substeps
    for n in range(last + 1):
        time = (first + n) * step
        if n % substeps == 0 and len(states) > 0:
            kept = VehicleState(
                time,
                motion,
                memory,
                x,
                line,
                scale_f,
                scale_r,
                deceleration,
                standing,
                onset,
                onset_station,
                stop,
            )
            write_row(states, n // substeps, pack_state(kept))
        if isinf(onset):
            onset = find_onset_by_position(time, motion.station, motion.speed, drive.profile)
        if isinf(onset_station) and time >= onset:
            onset_station = motion.station - motion.speed * (time - onset)
        held = drive.hold_speed and time < onset
        commanded = compute_input_pressure(time, onset, dead, drive)
        if first + n == 0 or lag <= 0.0:
            line = commanded
        next_line = compute_line_pressure(
            line, commanded, compute_input_pressure(time + step, onset, dead, drive), step, chassis.effects
        )
        rate = (next_line - line) / step
        engine, next_engine = 0.0, 0.0
        if len(drive.engine) > 0:
            engine = interpolate_trace(time - drive.begin, drive.engine, drive.interval)
            next_engine = interpolate_trace(time + step - drive.begin, drive.engine, drive.interval)
        instant = Instant(
            time, line, rate, deceleration, standing, held, engine, compute_climb(motion.station, climb)
        )
        ports = compute_ports(motion, memory, x, instant, scale_f, scale_r, step, slots, chassis, tyre, road)
        if n % substeps == 0:
            f, r = ports.front, ports.rear
            sample = (
                motion.station, motion.speed, ports.acceleration, f.slip, r.slip, motion.omega_f, motion.omega_r,
                f.tyre_force, r.tyre_force, f.ground.load, r.ground.load, f.brake_torque, r.brake_torque, f.abs_scale,
                r.abs_scale, compute_input_pressure(time, onset, 0.0, drive), ports.road_force,
                x[0], x[1], x[2], x[3], x[4], x[5], f.ground.height, r.ground.height,
                (ports.lift - f.suspension_force - r.suspension_force) / body.sprung_mass, memory.front.disc_rise,
                memory.rear.disc_rise, x[0] - x[2] - body.to_front * x[1], x[0] - x[3] + body.to_rear * x[1],
                x[4] - x[6] - body.to_front * x[5], x[4] - x[7] + body.to_rear * x[5], line,
                compute_vertical_force(f, chassis.effects), compute_vertical_force(r, chassis.effects),
            )  # fmt: skip
            write_row(history, n // substeps, sample)
        if n == last:
            break
        deceleration = -ports.acceleration
        ahead = motion.station if standing else motion.station + step * motion.speed
        next_instant = Instant(
            time + step,
            next_line,
            rate,
            deceleration,
            standing,
            held,
            next_engine,
            compute_climb(ahead, climb),
        )
        motion, memory, x = take_step(
            motion, memory, x, ports, instant, next_instant, step, slots, chassis, tyre, road
        )
        line, scale_f, scale_r = next_line, ports.front.abs_scale, ports.rear.abs_scale
        if not standing and motion.speed <= wheels.stop_speed:
            standing, stop = True, time + step
            motion, memory = Motion(motion.station, 0.0, 0.0, 0.0), clear_slip(memory)
    return onset, onset_station, stop
