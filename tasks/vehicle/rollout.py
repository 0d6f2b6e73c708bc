"""From controls to telemetry: one rollout, logged at 1 kHz in the columns of the tick table, and its largest values."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.surface.road_profile import LEVEL_ROAD, RoadGrade, RoadHazard
from tasks.surface.state import SurfaceState
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.history import History
from tasks.vehicle.model.brake_input import make_command_input
from tasks.vehicle.model.chassis import Conditions
from tasks.vehicle.model.simulation import COLUMNS, INTERNAL_STEP_S, Recording, Simulation, simulate
from tasks.vehicle.paper.low_speed import SteadyStop
from tasks.vehicle.paper.paper_mode import StepGrid, run_paper_mode, sample_history
from tasks.vehicle.parameters import SurfaceResponse, Vehicle, compute_surface_response

Mode = Literal["paper", "coupled"]
MODES: tuple[Mode, ...] = ("paper", "coupled")
TICK_NS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class Controls:
    """Inputs of the driver (paper, Eq. overall_pipeline: u).

    Parameters
    ----------
    initial_speed : speed at the start of the clip [m/s]
    brake : brake command
    hold_speed_until_brake : keep the speed until the brake onset; without an onset, throughout

    Raises
    ------
    InputError
        If the speed is not a positive number.
    """

    initial_speed: float
    brake: BrakeCommand
    hold_speed_until_brake: bool

    def __post_init__(self) -> None:
        if not (isfinite(self.initial_speed) and self.initial_speed > 0):
            raise InputError(f"initial_speed must be a positive number of m/s; it is {self.initial_speed}")


@dataclass(frozen=True, kw_only=True)
class Rollout:
    """Telemetry of one clip.

    Parameters
    ----------
    columns : every channel of ``TICK_CHANNELS`` at 1 kHz, from 0 to the duration inclusive [their units];
        ``pitch`` excludes the static pitch
    mode : paper or coupled
    surface_friction : mu_c [1]
    tyre_peak : mu_eff [1]
    slip_stiffness : beta [1]
    target_slip : kappa*, of either axle [1]
    static_pitch : to be added to ``pitch`` for the pitch of the body [rad]
    brake_onset_time : NaN if the brake is never applied [s]
    stop_time : when the vehicle comes to rest; NaN if it does not [s]
    stopping_distance : from the brake onset to rest; NaN without either [m]
    calibration_extrapolated : mu_c lies outside the calibrated knots, whose end values hold
    """

    columns: dict[str, NDArray[Any]]
    mode: Mode
    surface_friction: float
    tyre_peak: float
    slip_stiffness: float
    target_slip: float
    static_pitch: float
    brake_onset_time: float
    stop_time: float
    stopping_distance: float
    calibration_extrapolated: bool


def simulate_scenario(
    vehicle: Vehicle,
    surface: SurfaceState,
    controls: Controls,
    hazard: RoadHazard,
    *,
    mode: Mode,
    duration_s: float,
    step_s: float = INTERNAL_STEP_S,
    steady: SteadyStop | None = None,
    grade: RoadGrade = LEVEL_ROAD,
) -> Rollout:
    """Simulate one scenario; after a stop the vehicle stands and its body comes to rest too.

    Parameters
    ----------
    vehicle : the vehicle
    surface : kind of weather, mu_c and how it depends on speed, which paper mode does not know, and the depth of the
        snow for vehicles with the ploughing effect
    controls : initial speed and brake
    hazard : road feature
    mode : paper follows the publication, coupled is the physical model
    duration_s : length of the telemetry, whole milliseconds [s]
    step_s : internal step, a whole fraction of a millisecond [s]
    steady : of paper mode: how the end of a stop is kept steady; None takes the published steps literally
    grade : of the road along the station, beside the feature

    Raises
    ------
    InputError
        Listing every argument that breaks a rule.
    """
    family, surface_friction, snow_depth_mm = surface.kind, surface.friction, surface.snow_depth_mm
    per_tick = _check_arguments(vehicle, family, surface_friction, mode, duration_s, step_s)
    response = compute_surface_response(vehicle, family, surface_friction)
    ticks = round(duration_s * 1000)
    if mode == "paper":
        run = run_paper_mode(
            vehicle, response, controls.initial_speed, controls.hold_speed_until_brake, controls.brake.profile,
            hazard, StepGrid(steps=ticks * per_tick, step=step_s), steady, grade,
        )  # fmt: skip
        history = sample_history(run, step_s, per_tick)
    else:
        history = _collect_history(
            simulate(
                vehicle, response,
                make_command_input(controls.brake.profile, hold_speed=controls.hold_speed_until_brake),
                Conditions(hazard=hazard, snow_depth_mm=snow_depth_mm, grade=grade, grip=surface.grip),
                Recording(samples=ticks + 1, interval=0.001, substeps=per_tick),
                initial_speed=controls.initial_speed,
            )
        )  # fmt: skip
    return describe_rollout(
        history, vehicle, response, surface_friction, mode=mode, duration_s=duration_s, grade=grade
    )


def describe_rollout(
    history: History, vehicle: Vehicle, response: SurfaceResponse, surface_friction: float, *, mode: Mode,
    duration_s: float, grade: RoadGrade,
) -> Rollout:  # fmt: skip
    """Return the telemetry of a drive.

    Parameters
    ----------
    history : motion at the ticks, and its events
    vehicle, response : the vehicle, and its tyres on the surface
    surface_friction : mu_c [1]
    mode, duration_s, grade : as of `simulate_scenario`
    """
    columns: dict[str, NDArray[Any]] = dict(history.columns)
    columns["t_ns"] = np.arange(len(columns["speed"]), dtype=np.int64) * TICK_NS
    columns["road_grade"] = grade.at(columns["station"])
    columns["contact_f"] = columns["axle_load_f"] > 0
    columns["contact_r"] = columns["axle_load_r"] > 0
    braked = history.onset <= duration_s
    stopped = isfinite(history.stop_time)
    distance = nan
    if braked and stopped and history.stop_time >= history.onset:
        distance = float(columns["station"][-1] - history.onset_station)
    return Rollout(
        columns={channel.name: columns[channel.name] for channel in TICK_CHANNELS},
        mode=mode,
        surface_friction=surface_friction,
        tyre_peak=response.tyre.peak,
        slip_stiffness=response.slip_stiffness,
        target_slip=response.tyre.target_slip,
        static_pitch=vehicle.static_pitch,
        brake_onset_time=history.onset if braked else nan,
        stop_time=history.stop_time if stopped else nan,
        stopping_distance=distance,
        calibration_extrapolated=response.extrapolated,
    )


def compute_lift_times(columns: Mapping[str, NDArray[Any]]) -> dict[str, float]:
    """Return ``wheel_lift_time_f`` and ``wheel_lift_time_r``: for how long each axle is off the road [s].

    Where one is not 0 the unilateral clamp of Eq. app_unilateral_contact acts, and the sum of the responses to road and
    brake, which paper mode forms, is no longer the response to both.

    Parameters
    ----------
    columns : of the ticks
    """
    return {
        f"wheel_lift_time_{axle}": int(np.sum(~columns[f"contact_{axle}"].astype(bool))) * TICK_NS / 1e9
        for axle in "fr"
    }


def _collect_history(run: Simulation) -> History:
    """Return a simulation's columns and events in the form that both modes share."""
    columns = dict(zip(COLUMNS, run.history.T.copy(), strict=True))
    return History(columns=columns, onset=run.onset, onset_station=run.onset_station, stop_time=run.stop)


def _check_arguments(
    vehicle: Vehicle, family: str, surface_friction: float, mode: str, duration_s: float, step_s: float
) -> int:
    """Return the internal steps per tick; raise where an argument breaks its rule."""
    problems = []
    if mode not in MODES:
        problems.append(f"mode must be one of {', '.join(MODES)}; it is {mode}")
    try:
        vehicle.find_tyre_family(family)
    except InputError as error:
        problems += error.problems
    if not (isfinite(surface_friction) and surface_friction > 0):
        problems.append(f"surface_friction must be a positive number; it is {surface_friction}")
    whole = (
        isfinite(duration_s) and duration_s > 0 and abs(duration_s * 1000 - round(duration_s * 1000)) < 1e-6
    )
    if not whole:
        problems.append(f"duration_s must be a positive number of whole milliseconds; it is {duration_s}")
    per_tick = round(0.001 / step_s) if isfinite(step_s) and 0 < step_s <= 0.001 else 0
    if per_tick == 0 or abs(per_tick * step_s - 0.001) > 1e-12:
        problems.append(f"step_s must divide a millisecond into whole steps; it is {step_s}")
    if problems:
        raise InputError(problems)
    return per_tick


def compute_peaks(columns: Mapping[str, NDArray[Any]]) -> dict[str, float]:
    """Return ``peak_deceleration``, ``peak_pitch_rate``, ``abs_time`` and ``peak_slip`` of a clip.

    Each is NaN where a column that it follows from has no number at some tick: what is not known there may be larger.

    Parameters
    ----------
    columns : of the ticks, in the units of `tasks.conventions.TICK_CHANNELS`
    """
    acceleration, pitch_rate = columns["longitudinal_acceleration"], columns["pitch_rate"]
    slip = np.maximum(columns["braking_slip_f"], columns["braking_slip_r"])
    scale = np.minimum(columns["abs_scale_f"], columns["abs_scale_r"])
    acts = np.where(np.isnan(scale), np.nan, scale < 1)
    return {
        # 0 has no sign: a car that never slows down has the same figure in every file
        "peak_deceleration": 0.0 + float(np.maximum(0.0, np.max(-acceleration))),
        "peak_pitch_rate": float(np.max(np.abs(pitch_rate))),
        "abs_time": float(np.sum(acts)) * TICK_NS / 1e9,
        "peak_slip": float(np.max(slip)),
    }
