"""Brake dive: calibrate the brake and the pitch response on some drives, predict events of another."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from studies.measured_drives.events import Event
from tasks.campaign.campaign import CHANNELS, Run
from tasks.identification.inference.forward import RunModel, prepare_run, simulate_run
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.table import EFFECT_TABLE, PARAMETER_INDEX
from tasks.vehicle.half_car import build_half_car, integrate_half_car
from tasks.vehicle.parameters import Vehicle

REFINEMENT = 5
"""Half-car steps between samples: at 100 Hz the axles' fast modes need 2 ms."""


@dataclass(frozen=True, kw_only=True)
class DiveModel:
    """Effective parameters of the brake and of the pitch response (paper, Appendix C.5).

    Parameters
    ----------
    brake_gain : torque of all wheels per pressure [N m/MPa]
    pitch_gain : factor on the pitch moment of braking [1]
    stiffness : factor on both axles' springs [1]
    damping_ratio : zeta of the body's pitch mode [1]
    """

    brake_gain: float
    pitch_gain: float
    stiffness: float
    damping_ratio: float


def pitch_mode(vehicle: Vehicle) -> tuple[float, float]:
    """Undamped natural frequency [Hz] and damping ratio [1] of the body's pitch on its springs.

    Parameters
    ----------
    vehicle : its springs, dampers and inertia; tyres are taken as rigid
    """
    front, rear = vehicle.cg_to_front_axle**2, vehicle.cg_to_rear_axle**2
    stiffness = vehicle.suspension_stiffness_f * front + vehicle.suspension_stiffness_r * rear
    damping = vehicle.suspension_damping_f * front + vehicle.suspension_damping_r * rear
    omega = sqrt(stiffness / vehicle.pitch_inertia)
    return omega / (2 * pi), damping / (2 * vehicle.pitch_inertia * omega)


def with_model(vehicle: Vehicle, model: DiveModel) -> Vehicle:
    """The vehicle with the model's springs and the dampers that give its damping ratio.

    Parameters
    ----------
    vehicle : to start from
    model : effective parameters; the gains are not part of the result
    """
    stiffer = replace(
        vehicle,
        suspension_stiffness_f=model.stiffness * vehicle.suspension_stiffness_f,
        suspension_stiffness_r=model.stiffness * vehicle.suspension_stiffness_r,
    )
    factor = model.damping_ratio / pitch_mode(stiffer)[1]
    return replace(
        stiffer,
        suspension_damping_f=factor * vehicle.suspension_damping_f,
        suspension_damping_r=factor * vehicle.suspension_damping_r,
    )


def dive_of_deceleration(
    vehicle: Vehicle, model: DiveModel, deceleration: NDArray[np.float64], interval: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pitch [deg] and pitch rate [deg/s] of the half-car under a measured deceleration.

    Parameters
    ----------
    vehicle : to start from
    model : effective parameters
    deceleration : about its baseline, float64 [N] [m/s^2]
    interval : [s]
    """
    car = with_model(vehicle, model)
    fine = np.interp(
        np.arange((len(deceleration) - 1) * REFINEMENT + 1) / REFINEMENT,
        np.arange(len(deceleration)),
        deceleration,
    )
    moment = model.pitch_gain * vehicle.sprung_mass * vehicle.cg_height * fine
    flat = np.zeros(len(moment))
    states = integrate_half_car(flat, flat, moment, interval / REFINEMENT, build_half_car(car))[::REFINEMENT]
    return np.degrees(states[:, 1]), np.degrees(states[:, 5])


def fit_brake_gain(events: Sequence[Event], vehicle: Vehicle, surface: SurfaceParameters) -> float:
    """Torque per pressure that explains the measured deceleration; neither pitch nor its rate is used [N m/MPa].

    Parameters
    ----------
    events : training events with longitudinal acceleration
    vehicle : to start from
    surface : pavement
    """
    models = [_event_model(event, vehicle, surface) for event in events]
    measured = [-event.subtract_baseline("longitudinal_acceleration") for event in events]

    def residual(log_factor: NDArray[np.float64]) -> NDArray[np.float64]:
        theta = np.zeros(len(EFFECT_TABLE))
        theta[PARAMETER_INDEX["pressure_gain"]] = float(np.exp(log_factor[0])) - 1.0
        parts = []
        for event, model, truth in zip(events, models, measured, strict=True):
            driven = simulate_run(model, theta, initial_speed=event.start_speed)
            evaluated = event.mask_window(event.protocol.evaluation)[_driven(event)]
            predicted = -driven.column("longitudinal_acceleration")
            parts.append((predicted - truth[_driven(event)])[evaluated])
        return np.concatenate(parts)

    found = least_squares(residual, np.zeros(1), bounds=(np.log(0.05), np.log(20.0)), diff_step=1e-3)
    return float(np.exp(found.x[0])) * vehicle.brake_gain


def fit_pitch(
    events: Sequence[Event], vehicle: Vehicle, brake_gain: float, *, damping_ratio: float | None
) -> DiveModel:
    """Effective pitch response, with the measured deceleration as the half-car's excitation.

    Parameters
    ----------
    events : training events with pitch, and with pitch rate where the damping is to be found
    vehicle : to start from
    brake_gain : already found [N m/MPa]
    damping_ratio : given for the pitch-only calibration; None finds it from pitch and rate together [1]
    """
    joint = damping_ratio is None
    inputs = [-event.subtract_baseline("longitudinal_acceleration") for event in events]
    dives = [event.dive[event.mask_window(event.protocol.evaluation)] for event in events]
    rates = (
        [
            event.subtract_baseline("pitch_rate")[event.mask_window(event.protocol.evaluation)]
            for event in events
        ]
        if joint
        else []
    )
    dive_scale = float(np.sqrt(np.mean(np.concatenate(dives) ** 2)))
    rate_scale = float(np.sqrt(np.mean(np.concatenate(rates) ** 2))) if joint else 1.0

    def model_of(x: NDArray[np.float64]) -> DiveModel:
        gain, stiffness, *rest = np.exp(x)
        zeta = damping_ratio if damping_ratio is not None else float(rest[0])
        return DiveModel(
            brake_gain=brake_gain, pitch_gain=float(gain), stiffness=float(stiffness), damping_ratio=zeta
        )

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        model, parts = model_of(x), []
        for i, event in enumerate(events):
            interval = float(event.time[1] - event.time[0])
            dive, rate = dive_of_deceleration(vehicle, model, inputs[i], interval)
            inside = event.mask_window(event.protocol.evaluation)
            parts.append((dive[inside] - dives[i]) / dive_scale)
            if joint:
                parts.append((rate[inside] - rates[i]) / rate_scale)
        return np.concatenate(parts)

    start = np.log([1.0, 1.0, 0.4] if joint else [1.0, 1.0])
    low = np.log([0.02, 0.1, 0.05] if joint else [0.02, 0.1])
    high = np.log([20.0, 20.0, 2.0] if joint else [20.0, 20.0])
    found = least_squares(residual, start, bounds=(low, high), diff_step=1e-3, x_scale=1.0)
    return model_of(found.x)


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """A held-out event beside what the model makes of its pressure and start speed.

    Parameters
    ----------
    time : within the evaluation window, float64 [N] [s]
    dive, predicted_dive : nose-down change of pitch, float64 [N] [deg]
    rate, predicted_rate : pitch rate, float64 [N]; rate is None where it was not measured [deg/s]
    """

    time: NDArray[np.float64]
    dive: NDArray[np.float64]
    predicted_dive: NDArray[np.float64]
    rate: NDArray[np.float64] | None
    predicted_rate: NDArray[np.float64]


def predict_event(event: Event, vehicle: Vehicle, model: DiveModel, surface: SurfaceParameters) -> Prediction:
    """Predict an event from its brake pressure and start speed alone.

    Parameters
    ----------
    event : held-out
    vehicle : to start from
    model : calibrated on other drives
    surface : pavement
    """
    car = with_model(vehicle, model)
    prepared = _event_model(event, replace(car, brake_gain=model.brake_gain), surface)
    theta = np.zeros(len(EFFECT_TABLE))
    # the gain multiplies the moment of the sprung mass, the model's that of the whole vehicle
    theta[PARAMETER_INDEX["pitch_gain"]] = model.pitch_gain * car.sprung_mass / car.mass - 1.0
    driven = simulate_run(prepared, theta, initial_speed=event.start_speed)
    inside = event.mask_window(event.protocol.evaluation)
    kept = inside[_driven(event)]
    return Prediction(
        time=event.time[inside],
        dive=event.dive[inside],
        predicted_dive=np.degrees(driven.column("pitch")[kept]),
        rate=event.subtract_baseline("pitch_rate")[inside] if "pitch_rate" in event.columns else None,
        predicted_rate=np.degrees(driven.column("pitch_rate")[kept]),
    )


def _driven(event: Event) -> NDArray[np.bool_]:
    """Samples that are simulated: from the end of the baseline to the end of the evaluation."""
    return event.mask_window((event.protocol.baseline[1], event.protocol.evaluation[1]))


def _event_model(event: Event, vehicle: Vehicle, surface: SurfaceParameters) -> RunModel:
    driven = _driven(event)
    count = int(np.count_nonzero(driven))
    response = np.zeros((count, len(CHANNELS)))
    response[:, CHANNELS.index("speed")] = event.start_speed
    run = Run(
        name=event.run, held_out=False, weather=event.weather.kind,
        precipitation_mm_h=event.weather.precipitation_mm_h,
        snow_accumulation_h=event.weather.snow_accumulation_h, direction=1,
        disc_rise=0.0, hazard_center=0.0, hazard_length=0.0, hazard_height=0.0,
        interval=float(event.time[1] - event.time[0]),
        pressure=np.maximum(event.subtract_baseline("brake_pressure")[driven], 0.0), response=response,
    )  # fmt: skip
    return prepare_run(run, vehicle, surface)
