"""Traces of known scalars: the paper's development conditions, a vehicle's traces in them, and their errors."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.references import ReferenceCase, Traces
from flows.making.driving import weather_of
from flows.measured.agreement import agreement_of
from flows.measured.calibration import calibration_case
from tasks.identification.calibration.procedure import Procedure
from tasks.identification.calibration.residual import WHEELS, CalibrationCase
from tasks.identification.calibration.scalars import list_calibration_scalars, read_scalar, set_scalars
from tasks.surface.state import SurfaceState
from tasks.surface.weather import surface_state
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import simulate_scenario

GRID = "multibody-development"
DURATION_S = 12.0
WAVES = 2
"""Half waves that an error has over a trace beside its constant [1]."""
SPREAD = {
    "efficiency": 0.02, "slip_stiffness": 0.2, "pitch_scale": 0.02, "hold_s": 0.03, "release_s": 0.01,
    "hold_ratio": 0.03, "coupled_pitch_scale": 0.02, "static_pitch": float(np.deg2rad(0.1)), "coast_deceleration": 0.05,
}  # fmt: skip
"""Standard deviation of a true scalar about the vehicle that the fit starts from [unit of the group]."""


def list_development_cases() -> tuple[ReferenceCase, ...]:
    """Return the 19 development conditions of the frozen run, without their stopping distances."""
    pavement = load("surface", "dense-asphalt")
    return tuple(
        ReferenceCase(
            case=label,
            split="development",
            weather=scenario.weather,
            surface_coefficient=round(surface_state(weather_of(scenario), pavement).friction, 6),
            initial_speed_km_h=scenario.initial_speed_km_h,
            peak_pressure_mpa=scenario.peak_pressure_mpa,
            ramp_s=scenario.ramp_s,
            brake_onset_s=scenario.brake_onset_s,
            hazard_center_m=scenario.hazard_center_m,
            hazard_length_m=scenario.hazard_length_m,
            hazard_height_m=scenario.hazard_height_m,
        )
        for label, scenario in load("grid", GRID).scenarios
    )


def draw_truth(vehicle: Vehicle, procedure: Procedure, seed: int) -> Vehicle:
    """Return a vehicle with every scalar of a procedure drawn about its value, at least 5 % inside its bounds.

    Parameters
    ----------
    vehicle : vehicle that the fit starts from
    procedure : groups and bounds
    seed : seed of the draw
    """
    rng = np.random.Generator(np.random.Philox(key=[seed, 0]))
    values = {}
    for scalar in list_calibration_scalars(vehicle, procedure.groups):
        bounds = procedure.bounds[scalar.group]
        margin = 0.05 * (bounds.upper - bounds.lower)
        drawn = read_scalar(vehicle, scalar) + SPREAD[scalar.group] * rng.normal()
        values[scalar] = float(np.clip(drawn, bounds.lower + margin, bounds.upper - margin))
    return set_scalars(vehicle, values)


def make_known_cases(
    truth: Vehicle, conditions: Sequence[ReferenceCase], procedure: Procedure, interval: float
) -> list[CalibrationCase]:
    """Return the traces of a vehicle in paper mode as a calibration reads them, free of error.

    Parameters
    ----------
    truth : vehicle that makes the traces
    conditions : cases
    procedure : phases of the stop
    interval : spacing of the samples that count [s]
    """
    made = [_trace(truth, case) for case in conditions]
    reference = [
        (case.model_copy(update={"stopping_distance_m": distance}), columns)
        for case, (columns, distance) in zip(conditions, made, strict=True)
    ]
    windows = [row["window"] for row in agreement_of(truth, reference, "paper")["cases"]]
    return [
        calibration_case(case, columns, window, interval, procedure.yardstick.start_s, truth.wheelbase)
        for (case, columns), window in zip(reference, windows, strict=True)
    ]


def add_errors(cases: Sequence[CalibrationCase], procedure: Procedure, seed: int) -> list[CalibrationCase]:
    """Return cases whose responses err as the identifiability report assumes: one smooth curve a response and case.

    A curve is a sum of half waves with random heights, whose root mean square over draws is the response's scale at
    each time. The four wheels err alike, which is the worst case of their mean.

    Parameters
    ----------
    cases : cases free of error
    procedure : scales of the responses
    seed : seed of the draw
    """
    scales = procedure.yardstick.scales
    wrong = []
    for number, case in enumerate(cases):
        rng = np.random.Generator(np.random.Philox(key=[seed, number + 1]))
        speed, pitch, slip, load = (
            scales[name] * _draw_curve(case.time, rng) for name in ("speed", "pitch", "slip", "wheel_load")
        )
        stop, distance = scales["stop"] * rng.normal(), case.stopping_distance
        wrong.append(
            replace(
                case, speed=case.speed + speed, pitch=case.pitch + pitch, slip=case.slip + slip,
                wheel_load=case.wheel_load + load,
                stopping_distance=None if distance is None else distance + stop,
            )
        )  # fmt: skip
    return wrong


def _draw_curve(time: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a smooth random curve whose mean square is 1 at each time, over draws, shape (n,) [1]."""
    phase = np.pi * (time - time[0]) / (time[-1] - time[0])
    curve = rng.normal() * np.ones_like(phase)
    for wave in range(1, WAVES + 1):
        curve += rng.normal() * np.cos(wave * phase) + rng.normal() * np.sin(wave * phase)
    return curve / np.sqrt(WAVES + 1)


def _trace(truth: Vehicle, case: ReferenceCase) -> tuple[Traces, float]:
    """Return the columns of one trace [their units], and its stopping distance [m]."""
    surface = SurfaceState(kind=case.weather, friction=case.surface_coefficient)
    ride = simulate_scenario(
        truth, surface, case.controls(), case.hazard(), mode="paper", duration_s=DURATION_S
    )
    model = ride.columns
    columns = {"time": model["t_ns"] * 1e-9, "station": model["station"], "speed": model["speed"]}
    columns["pitch"] = np.rad2deg(model["pitch"] + truth.static_pitch)
    columns |= {f"slip_{wheel}": model[f"braking_slip_{axle}"] for wheel, axle in WHEELS.items()}
    columns |= {f"wheel_load_{wheel}": model[f"axle_load_{axle}"] / 2 for wheel, axle in WHEELS.items()}
    return columns, ride.stopping_distance
