"""Paper mode: the published update order, from Appendix B line by line.

On a flat road the tyres take the loads of the analytic load transfer, and the half-car is integrated afterwards. On a
road feature, half-car and wheels are integrated over the whole time grid in turn: until the station settles, or five
times where the published steps are taken literally. The responses to the road and to the brake are integrated
separately and added.
"""

from dataclasses import dataclass
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from tasks.surface.road_profile import LEVEL_ROAD, RoadGrade, RoadHazard, road_elevation
from tasks.vehicle.brake import PressureProfile
from tasks.vehicle.half_car import (
    build_half_car,
    compute_contact_loads,
    integrate_half_car,
    integrate_superposed,
)
from tasks.vehicle.history import History
from tasks.vehicle.paper.drive import DRIVE_COLUMNS, simulate_drive
from tasks.vehicle.paper.low_speed import NO_STOP, BrakedStop, SteadyStop, compute_brake_pitch_input
from tasks.vehicle.paper.wheel_step import find_implicit_speed
from tasks.vehicle.paper.wheels import build_wheels
from tasks.vehicle.parameters import SurfaceResponse, Vehicle
from tasks.vehicle.road import make_climb, make_road_feature

LITERAL_PASSES = 5
"""Passes on a road feature as published, by which every case of the publication has settled [1]."""
MOST_PASSES = 60
"""Most passes where the end of a stop is kept steady; of 435 random cars the slowest took at most 15 [1]."""
SETTLED = 1e-6
"""Change of the station in a pass below which the passes end [m]."""
ANALYTIC_LOADS = np.empty((0, 2))
STATE_COLUMNS = (
    "heave", "pitch", "unsprung_heave_f", "unsprung_heave_r",
    "heave_rate", "pitch_rate", "unsprung_rate_f", "unsprung_rate_r",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class PaperRun:
    """A run on the internal grid.

    Parameters
    ----------
    log : columns of ``DRIVE_COLUMNS``, shape (n, len(DRIVE_COLUMNS))
    states : half-car states, shape (n, 8) [m, rad, m/s, rad/s]
    road : road height under the front and the rear axle, shape (n, 2) [m]
    loads : contact loads of the half-car, shape (n, 2) [N]
    onset : brake onset; infinite if there is none [s]
    stop : sample of the stop; -1 if there is none
    stop_time : time of the stop, at or before that sample; infinite if there is none [s]
    """

    log: NDArray[np.float64]
    states: NDArray[np.float64]
    road: NDArray[np.float64]
    loads: NDArray[np.float64]
    onset: float
    stop: int
    stop_time: float


@dataclass(frozen=True, kw_only=True)
class StepGrid:
    """Internal grid of a run in paper mode.

    Parameters
    ----------
    steps : number of steps
    step : length of each [s]
    """

    steps: int
    step: float


def run_paper_mode(
    vehicle: Vehicle,
    response: SurfaceResponse,
    initial_speed: float,
    hold_speed: bool,
    profile: PressureProfile,
    hazard: RoadHazard,
    grid: StepGrid,
    steady: SteadyStop | None = None,
    grade: RoadGrade = LEVEL_ROAD,
) -> PaperRun:
    """Simulate one run (paper, Appendix B).

    Parameters
    ----------
    vehicle : the vehicle
    response : its tyres and pitch calibration on the surface
    initial_speed : speed at the start [m/s]
    hold_speed : keep the speed until the brake onset
    profile : brake command
    hazard : road feature
    grid : internal steps
    steady : how the end of a stop is kept steady; None takes the published steps literally
    grade : of the road, which the publication does not have
    """
    wheels, road = build_wheels(vehicle), make_road_feature(hazard)
    climb = make_climb(grade, vehicle.gravity)
    implicit_below, held_share, pitch_rule = 0.0, 0.0, True
    if steady is not None:
        pitch_rule = steady.pitch_rule
        held_share = steady.held_share
        implicit_below = find_implicit_speed(
            wheels, response.tyre, profile, grid.step, steady.explicit_limit, vehicle.gravity
        )

    def drive(loads: NDArray[np.float64]) -> tuple[NDArray[np.float64], float, int, float]:
        return simulate_drive(
            initial_speed, hold_speed, grid.steps, grid.step, profile, road, climb, loads, implicit_below,
            wheels, response.tyre,
        )  # fmt: skip

    def move_body() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        braked = BrakedStop(onset=onset, sample=stop, time=stop_time) if pitch_rule else NO_STOP
        return simulate_body(
            vehicle, response, hazard, log, braked, grid.step, held_share=held_share, grade=grade
        )

    log, onset, stop, stop_time = drive(ANALYTIC_LOADS)
    if hazard.height_m == 0:
        states, heights, loads = move_body()
    done, change = 0, inf
    most = LITERAL_PASSES if steady is None else MOST_PASSES
    while hazard.height_m != 0 and (done < LITERAL_PASSES or (change > SETTLED and done < most)):
        station = log[:, 0]
        states, heights, loads = move_body()
        log, onset, stop, stop_time = drive(loads)
        done, change = done + 1, float(np.abs(log[:, 0] - station).max())
    return PaperRun(
        log=log,
        states=states,
        road=heights,
        loads=loads,
        onset=onset,
        stop=stop,
        stop_time=stop_time,
    )


def simulate_body(
    vehicle: Vehicle,
    response: SurfaceResponse,
    hazard: RoadHazard,
    log: NDArray[np.float64],
    braked: BrakedStop,
    step: float,
    *,
    held_share: float = 0.0,
    grade: RoadGrade = LEVEL_ROAD,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return half-car states, road heights and contact loads along a drive (paper, Eqs. half_car and app_brake_pitch).

    Parameters
    ----------
    vehicle, response, hazard : as in ``run_paper_mode``
    log : log of `simulate_drive`, shape (n, len(DRIVE_COLUMNS))
    braked : brake onset and stop of the drive; `NO_STOP` leaves the low-speed rule out
    step : step of the grid [s]
    held_share : as in `compute_brake_pitch_input`
    grade : of the road
    """
    car = build_half_car(vehicle)
    d_theta = compute_brake_pitch_input(
        log[:, 2],
        step,
        braked,
        climb=None if grade.is_level else vehicle.gravity * grade.at(log[:, 0]),
        hold_s=response.hold_s,
        release_s=response.release_s,
        hold_ratio=vehicle.hold_ratio,
        held_share=held_share,
    )
    gamma = response.pitch_scale * (1.0 if hazard.height_m == 0 else vehicle.coupled_pitch_scale)
    moment = gamma * vehicle.sprung_mass * vehicle.cg_height * d_theta
    station = log[:, 0]
    if hazard.height_m == 0:
        road_f = road_r = np.zeros_like(station)
        states = integrate_half_car(road_f, road_r, moment, step, car)
    else:
        road_f, road_r = road_elevation(station, hazard), road_elevation(station - vehicle.wheelbase, hazard)
        states = integrate_superposed(road_f, road_r, moment, step, car)
    loads = compute_contact_loads(states, road_f, road_r, car)
    return states, np.stack([road_f, road_r], axis=1), loads


def sample_history(run: PaperRun, step: float, per_tick: int) -> History:
    """Return every ``per_tick``-th sample of a run, with its events.

    Parameters
    ----------
    run : run on the internal grid
    step : step of that grid [s]
    per_tick : samples per tick
    """
    station = run.log[:, 0]
    onset_station = inf
    if isfinite(run.onset):
        onset_station = float(np.interp(run.onset, np.arange(len(station)) * step, station))
    ticks = slice(None, None, per_tick)
    columns = dict(zip(DRIVE_COLUMNS, run.log[ticks].T.copy(), strict=True))
    columns |= dict(zip(STATE_COLUMNS, run.states[ticks].T.copy(), strict=True))
    for index, axle in enumerate("fr"):
        columns[f"road_height_{axle}"] = run.road[ticks, index].copy()
        columns[f"axle_load_{axle}"] = run.loads[ticks, index].copy()
    return History(
        columns=columns,
        onset=run.onset,
        onset_station=onset_station,
        stop_time=run.stop_time,
    )
