"""Runs made by the model itself at a finer step, with noise: what the tests of attribution start from."""

from dataclasses import replace

import numpy as np

from catalogs.entries import load
from tasks.campaign.campaign import Run, Tolerances
from tasks.identification.inference.forward import RunModel, predict_channels, prepare_run

VEHICLE = load("vehicle", "paper-reference")
SURFACE = load("surface", "dense-asphalt")
NOISE = np.array([0.03, 0.05, 0.1, 0.1, 0.015, 0.1, 0.1])
TOLERANCES = Tolerances(
    session=(0.02, 0.01, 0.02, 0.005, 0.04, 0.02, 0.0015),
    initial_speed=0.05,
    friction=0.03,
    acceleration_bias=0.03,
    pitch_offset=0.03,
)


def plain_run(
    speed: float,
    peak: float,
    *,
    name: str = "run",
    direction: int = 1,
    disc_rise: float = 20.0,
    seconds: float = 3.0,
) -> Run:
    """A run at 100 Hz that brakes after a second; what shows late, or in little, needs more than two of braking."""
    t = np.arange(round(100 * seconds)) * 0.01
    response = np.zeros((len(t), 7))
    response[:, 0] = speed
    return Run(
        name=name, held_out=False, weather="dry", precipitation_mm_h=0.0, snow_accumulation_h=0.0,
        direction=direction, disc_rise=disc_rise, hazard_center=0.0, hazard_length=0.0, hazard_height=0.0,
        interval=0.01, pressure=np.clip((t - 1.0) / 0.3, 0.0, 1.0) * peak, response=response,
    )  # fmt: skip


def measured(run: Run, theta: np.ndarray, seed: int) -> RunModel:
    """The run as a car with ``theta`` would have been measured, ready for evidence."""
    model = prepare_run(run, VEHICLE, SURFACE)
    clean = predict_channels(model, theta, refinement=4)
    noise = NOISE * np.random.default_rng(seed).standard_normal(clean.shape)
    return prepare_run(replace(run, response=clean + noise), VEHICLE, SURFACE)
