"""One stop predicted from another of the same car, with what the model lacks added step by step."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from studies.measured_drives.brake_dive import DiveModel, dive_of_deceleration, pitch_mode, with_model
from studies.measured_drives.stop import (
    MASKED_SPEED,
    REBOUND_S,
    Stop,
    StopErrors,
    rolling_radius,
    stop_errors,
)
from studies.measured_drives.stop_swing import Swing, fit_swing, with_swing
from tasks.campaign.campaign import CHANNELS, Run
from tasks.identification.inference.forward import RunModel, predict_channels, prepare_run
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import Vehicle

LEAD_SAMPLES = 20
"""Samples at the start of a stop in which it still rolls freely."""
SCALES = {"speed": 0.1, "longitudinal_acceleration": 0.3, "wheel_speed_front": 0.3}
DIVE_SCALES = (0.05, 1.0)
"""Sizes of error that weigh alike in a fit [the channel's unit]."""
STARTS = {"wheel_speed_delay": 0.03, "lag": 0.03}
"""Where fits start; others at 0."""
BOUNDS = {
    "pressure_gain": (-0.6, 3.0), "lag": (0.0, 0.4), "pad_speed": (-0.05, 0.05), "wheel_speed_delay": (0.0, 0.2),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Rung:
    """One step of the ladder.

    Parameters
    ----------
    name, adds : for people
    engine_torque : the engine's torque at the wheels is an input
    fixed : effect parameters that are known [the catalogue's units]
    longitudinal : effect parameters fitted to speed and acceleration
    swing : the body swings on its compliance after the stop
    """

    name: str
    adds: str
    engine_torque: bool
    fixed: Mapping[str, float]
    longitudinal: tuple[str, ...]
    swing: bool


@dataclass(frozen=True, kw_only=True)
class RungResult:
    """Parameters that a rung found on the training stop, and its errors on both stops.

    Parameters
    ----------
    rung : the step
    parameters : fitted and fixed effect parameters [the catalogue's units]
    dive : pitch response, fitted with the measured deceleration as its input
    swing : compliance after the stop; None where the rung has none
    train, held_out : errors
    predicted : predicted channels on the held-out stop, each float64 [N]
    """

    rung: Rung
    parameters: dict[str, float]
    dive: DiveModel
    swing: Swing | None
    train: StopErrors
    held_out: StopErrors
    predicted: dict[str, NDArray[np.float64]]


def fit_ladder(
    train: Stop, held_out: Stop, ladder: Sequence[Rung], vehicle: Vehicle, surface: SurfaceParameters
) -> tuple[RungResult, ...]:
    """Fit every rung on the training stop alone and judge it on the other.

    Parameters
    ----------
    train, held_out : the stops
    ladder : steps; each is fitted anew
    vehicle, surface : the uncalibrated model
    """
    return tuple(_step(train, held_out, rung, vehicle, surface) for rung in ladder)


def compute_uncalibrated_errors(stop: Stop, vehicle: Vehicle, surface: SurfaceParameters) -> StopErrors:
    """Errors of the model as its data sheet has it.

    Parameters
    ----------
    stop : measured
    vehicle, surface : the model
    """
    _, zeta = pitch_mode(vehicle)
    dive = DiveModel(brake_gain=vehicle.brake_gain, pitch_gain=1.0, stiffness=1.0, damping_ratio=zeta)
    model = _model(stop, vehicle, surface, engine_torque=False)
    return stop_errors(stop, _predicted(model, {}, vehicle, dive, None))


def _step(
    train: Stop, held_out: Stop, rung: Rung, vehicle: Vehicle, surface: SurfaceParameters
) -> RungResult:
    dive = _fitted_dive(train, vehicle)
    car = with_model(vehicle, dive)
    learnt = _model(train, car, surface, engine_torque=rung.engine_torque)
    # the radius acts in the motion too, so it comes first, from wheels that roll freely
    found = {**rung.fixed, "wheel_radius": rolling_radius(train) / vehicle.wheel_radius - 1.0}
    for names, channels in (
        (rung.longitudinal, ("speed", "longitudinal_acceleration")),
        (("wheel_speed_delay",), ("wheel_speed_front",)),
    ):
        found |= _fitted(train, learnt, found, names, channels)
    swing = None
    if rung.swing:
        measured = train.columns
        swing = fit_swing(measured["longitudinal_acceleration"], measured["speed"], train.interval, REBOUND_S)
    judged = _predicted(
        _model(held_out, car, surface, engine_torque=rung.engine_torque), found, vehicle, dive, swing
    )
    return RungResult(
        rung=rung,
        parameters=found,
        dive=dive,
        swing=swing,
        train=stop_errors(train, _predicted(learnt, found, vehicle, dive, swing)),
        held_out=stop_errors(held_out, judged),
        predicted=judged,
    )


def _fitted(
    stop: Stop, model: RunModel, known: Mapping[str, float], names: tuple[str, ...], channels: tuple[str, ...]
) -> dict[str, float]:
    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        theta = build_parameter_vector({**known, **dict(zip(names, x.tolist(), strict=True))})
        predicted = dict(zip(CHANNELS, predict_channels(model, theta).T, strict=True))
        return np.concatenate(
            [(predicted[n][: stop.slow] - stop.columns[n][: stop.slow]) / SCALES[n] for n in channels]
        )

    start = [STARTS.get(name, 0.0) for name in names]
    bounds = tuple(zip(*(BOUNDS[name] for name in names), strict=True))
    found = least_squares(residual, start, bounds=bounds, diff_step=1e-3, x_scale="jac")
    return dict(zip(names, found.x.tolist(), strict=True))


def _fitted_dive(stop: Stop, vehicle: Vehicle) -> DiveModel:
    """Pitch response with the measured deceleration as input, so that no error of the brake enters it."""
    rest = float(np.median(stop.columns["longitudinal_acceleration"][: stop.onset]))
    deceleration = rest - stop.columns["longitudinal_acceleration"]

    def model_of(x: NDArray[np.float64]) -> DiveModel:
        gain, stiffness, zeta = np.exp(x).tolist()
        return DiveModel(
            brake_gain=vehicle.brake_gain, pitch_gain=gain, stiffness=stiffness, damping_ratio=zeta
        )

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        found = dive_of_deceleration(vehicle, model_of(x), deceleration, stop.interval)
        return np.concatenate(
            [
                (answer - stop.columns[name]) / scale
                for name, answer, scale in zip(("pitch", "pitch_rate"), found, DIVE_SCALES, strict=True)
            ]
        )

    low, high = np.log([0.05, 0.2, 0.05]), np.log([10.0, 15.0, 2.0])
    return model_of(least_squares(residual, np.log([1.0, 3.0, 0.5]), bounds=(low, high), diff_step=1e-3).x)


def _predicted(
    model: RunModel, parameters: Mapping[str, float], vehicle: Vehicle, dive: DiveModel, swing: Swing | None
) -> dict[str, NDArray[np.float64]]:
    values = predict_channels(model, build_parameter_vector(parameters))
    columns = dict(zip(CHANNELS, values.T, strict=True))
    columns |= _held_to_standstill(columns, model.run.interval)
    if swing is not None:
        columns["longitudinal_acceleration"] = with_swing(
            columns["longitudinal_acceleration"], columns["speed"], model.run.interval, swing
        )
    # the pitch before the brake is what the measured one is taken about
    rest = float(np.median(columns["longitudinal_acceleration"][:LEAD_SAMPLES]))
    deceleration = rest - columns["longitudinal_acceleration"]
    columns["pitch"], columns["pitch_rate"] = dive_of_deceleration(
        vehicle, dive, deceleration, model.run.interval
    )
    return columns


def _held_to_standstill(
    columns: Mapping[str, NDArray[np.float64]], interval: float
) -> dict[str, NDArray[np.float64]]:
    """Speed and acceleration with the deceleration held from 2 m/s to rest.

    Below that the slip's floor is what makes the tyre force, so the rollout says nothing about the last metre.
    """
    speed, acceleration = columns["speed"].copy(), columns["longitudinal_acceleration"].copy()
    slow = int(np.argmax(speed < MASKED_SPEED))
    if slow == 0:
        return {}
    held = float(np.mean(acceleration[max(slow - round(0.05 / interval), 0) : slow]))
    rest = speed[slow] + held * interval * np.arange(len(speed) - slow)
    speed[slow:] = np.maximum(rest, 0.0)
    acceleration[slow:] = np.where(rest > 0.0, held, 0.0)
    return {"speed": speed, "longitudinal_acceleration": acceleration}


def _model(stop: Stop, vehicle: Vehicle, surface: SurfaceParameters, *, engine_torque: bool) -> RunModel:
    columns = stop.columns
    pressure = columns["brake_pressure"]
    if engine_torque:
        pressure = np.maximum(pressure - columns["engine_torque"] / vehicle.brake_gain, 0.0)
    run = Run(
        name=stop.name, held_out=False, weather="dry", precipitation_mm_h=0.0, snow_accumulation_h=0.0, direction=1,
        disc_rise=0.0, hazard_center=0.0, hazard_length=0.0, hazard_height=0.0, interval=stop.interval,
        pressure=pressure, response=np.column_stack([columns[name] for name in CHANNELS]),
    )  # fmt: skip
    start = float(np.mean(columns["speed"][:5]))
    # the stop itself and the rebound after it are part of the story, so the run is not cut at low speed
    return replace(prepare_run(run, vehicle, surface), samples=len(pressure), initial_speed=start)
