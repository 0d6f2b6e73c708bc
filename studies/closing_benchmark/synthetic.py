"""Campaigns with a known truth, for the error rates of the method; the generator differs from the judged model.

The generator integrates at an eighth of the step, draws session and run offsets, Gauss-Markov disturbances in
force, friction and pitch moment on its own knots, AR(1) sensor noise, and coloured noise on the pressure that
the model reads. Its wheel inertia has an error that no nuisance covers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import SESSION, Campaign, Run, Tolerances
from tasks.campaign.planned_runs import RunPlan, make_planned_run
from tasks.identification.inference.forward import (
    SENSED,
    compute_instrument_readings,
    prepare_run,
    simulate_run,
)
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import PARAMETER_INDEX, build_parameter_vector
from tasks.vehicle.parameters import Vehicle

RICH: tuple[RunPlan, ...] = (
    RunPlan(speed=32.0, peak=0.0, duration=8.0), RunPlan(speed=16.7, peak=0.0, duration=8.0),
    RunPlan(speed=25.0, peak=2.0, disc_rise=350.0), RunPlan(speed=27.8, peak=1.5, disc_rise=150.0),
    RunPlan(speed=26.4, peak=-2.4), RunPlan(speed=16.7, peak=2.3), RunPlan(speed=11.1, peak=3.5, duration=4.0),
    RunPlan(weather="rain", rate=10.0, speed=22.2, peak=2.3), RunPlan(weather="rain", rate=25.0, speed=12.5, peak=3.0),
    RunPlan(weather="snow", rate=3.0, speed=13.9, peak=2.3), RunPlan(weather="snow", rate=1.0, speed=9.7, peak=0.6),
    RunPlan(speed=11.1, peak=0.0, duration=4.0, hazard=(12.0, 3.7, 0.075)),
    RunPlan(speed=9.7, peak=0.0, duration=4.0, hazard=(10.0, 2.0, -0.08)),
    RunPlan(speed=7.8, peak=0.5, duration=4.0, hazard=(10.0, 3.7, 0.06)),
    RunPlan(speed=25.0, peak=0.0, duration=8.0), RunPlan(speed=22.2, peak=2.6, disc_rise=250.0),
    RunPlan(speed=33.3, peak=2.0, disc_rise=80.0), RunPlan(speed=13.9, peak=1.6, duration=5.0),
    RunPlan(weather="rain", rate=10.0, speed=16.7, peak=2.6), RunPlan(weather="snow", rate=1.0, speed=12.5, peak=2.0),
    RunPlan(speed=8.9, peak=0.8, duration=4.0, hazard=(9.0, 3.7, 0.05)),
    RunPlan(speed=9.7, peak=0.0, duration=4.0, hazard=(12.0, 2.5, 0.06)),
)  # fmt: skip
"""An experiment design that excites every port, 14 training runs first."""
TRAINING = 14
NOISE_SIGMA = np.array([0.03, 0.05, 0.09, 0.09, 0.015, 0.1, 0.1])
NOISE_RHO = np.array([0.6, 0.0, 0.0, 0.0, 0.6, 0.0, 0.0])
PRESSURE_NOISE = 0.01
GENERATOR_REFINEMENT = 8
TOLERANCES = Tolerances(
    session=(0.02, 0.01, 0.02, 0.005, 0.04, 0.02, 0.0015),
    initial_speed=0.05,
    friction=0.03,
    acceleration_bias=0.03,
    pitch_offset=0.03,
)
DISTURBANCE = (
    ("longitudinal_force", 50.0, 0.9, 0.12),
    ("friction", 0.008, 0.6, 0.2),
    ("pitch_moment", 70.0, 0.3, 0.08),
)
"""Port, standard deviation [unit of the port], correlation time and knot spacing [s]."""


def make_synthetic_campaign(
    vehicle: Vehicle,
    surface: SurfaceParameters,
    truth: Mapping[str, float],
    seed: int,
    *,
    slots: tuple[Slot, ...] = (),
    design: Sequence[RunPlan] = RICH,
) -> Campaign:
    """Return a campaign of a vehicle that has the effects of ``truth``.

    Parameters
    ----------
    vehicle, surface : vehicle and surface without the effects
    truth : effect parameters by name [units of the table]
    seed : seed of all random draws
    slots : forms outside any library
    design : planned runs; the first `TRAINING` of them train
    """
    rng = np.random.Generator(np.random.Philox(seed))
    theta = build_parameter_vector(truth)
    session = [PARAMETER_INDEX[name] for name in SESSION]
    theta[session] += rng.standard_normal(len(session)) * TOLERANCES.session
    theta[PARAMETER_INDEX["wheel_inertia"]] += 0.05 * rng.random()
    runs = tuple(
        _measure_run(drive, i, 1 if rng.random() < 0.5 else -1, vehicle, surface, theta, slots, rng)
        for i, drive in enumerate(design)
    )  # fmt: skip
    return Campaign(
        name=f"synthetic-{seed}",
        vehicle=vehicle.name,
        runs=runs,
        tolerances=TOLERANCES,
        content_hash="",
        split_hash="",
    )


def _measure_run(
    drive: RunPlan,
    number: int,
    direction: int,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    theta: NDArray[np.float64],
    slots: tuple[Slot, ...],
    rng: np.random.Generator,
) -> Run:
    """Return one planned run as the instruments would have measured it."""
    run = make_planned_run(drive, f"run-{number + 1:02d}", direction, held_out=number >= TRAINING)
    pressure, count = run.pressure, len(run.pressure)
    model = prepare_run(run, vehicle, surface)
    own = theta.copy()
    own[PARAMETER_INDEX["friction"]] += TOLERANCES.friction * rng.standard_normal()
    disturbed = tuple(_draw_disturbance(*entry, drive.duration, rng) for entry in DISTURBANCE)
    speed = drive.speed + TOLERANCES.initial_speed * rng.standard_normal()
    driven = simulate_run(
        model, own, slots=(*slots, *disturbed), initial_speed=speed, refinement=GENERATOR_REFINEMENT
    )
    y = compute_instrument_readings(model, own, driven.history[:, SENSED])
    y[:, 1] += TOLERANCES.acceleration_bias * rng.standard_normal()
    y[:, 4] += TOLERANCES.pitch_offset * rng.standard_normal()
    for j in range(y.shape[1]):
        y[:, j] += NOISE_SIGMA[j] * _draw_autoregressive_noise(NOISE_RHO[j], count, rng)
    seen = np.maximum(pressure + PRESSURE_NOISE * _draw_autoregressive_noise(0.5, count, rng), 0.0)
    return replace(run, response=y, pressure=seen if drive.peak else pressure)


def _draw_disturbance(
    port: str, scale: float, time: float, spacing: float, duration: float, rng: np.random.Generator
) -> Slot:
    """Return a Gauss-Markov disturbance at one port over the duration of a run."""
    count = int(duration / spacing) + 2
    values = scale * _draw_autoregressive_noise(float(np.exp(-spacing / time)), count, rng)
    return Slot(port=port, variable="time", origin=0.0, spacing=spacing, values=values)


def _draw_autoregressive_noise(rho: float, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return AR(1) noise of unit variance, float64 [count]."""
    x = rng.standard_normal(count)
    for i in range(1, count):
        x[i] = rho * x[i - 1] + np.sqrt(1.0 - rho**2) * x[i]
    return x
