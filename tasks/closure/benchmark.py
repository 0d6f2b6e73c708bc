"""The tool's own error rates: campaigns with a known truth, made unlike the model that judges them.

The generator integrates at a quarter of the step, draws session and run offsets, Gauss-Markov disturbances in
force, friction and pitch moment on knots of its own, AR(1) sensor noise and coloured noise on the pressure that
the model is given; wheel inertia is off by an amount that no nuisance covers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from tasks.closure.answer import Verdict
from tasks.closure.campaign import Campaign, Run, Tolerances
from tasks.closure.evidence import SESSION_INDEX
from tasks.closure.forward import SUBSTEPS, Slot, instruments, roll, run_model
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import PARAMETER_INDEX, parameter_vector
from tasks.vehicle.parameters import Vehicle

INTERVAL = 0.01
NOISE_SIGMA = np.array([0.03, 0.05, 0.09, 0.09, 0.015, 0.1, 0.1])
NOISE_RHO = np.array([0.6, 0.0, 0.0, 0.0, 0.6, 0.0, 0.0])
PRESSURE_NOISE = 0.01
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


@dataclass(frozen=True, kw_only=True)
class Drive:
    """One planned run.

    Parameters
    ----------
    weather, rate : weather and its rate [mm/h]
    speed : initial speed [m/s]
    peak : brake pressure after the ramp; negative pulses between it and 0.3 of it [MPa]
    duration : [s]
    disc_rise : [K]
    hazard : centre, length, height [m]
    """

    weather: str = "dry"
    rate: float = 0.0
    speed: float
    peak: float
    duration: float = 6.0
    disc_rise: float = 20.0
    hazard: tuple[float, float, float] = (0.0, 0.0, 0.0)


RICH: tuple[Drive, ...] = (
    Drive(speed=32.0, peak=0.0, duration=8.0), Drive(speed=16.7, peak=0.0, duration=8.0),
    Drive(speed=25.0, peak=2.0, disc_rise=350.0), Drive(speed=27.8, peak=1.5, disc_rise=150.0),
    Drive(speed=26.4, peak=-2.4), Drive(speed=16.7, peak=2.3), Drive(speed=11.1, peak=3.5, duration=4.0),
    Drive(weather="rain", rate=10.0, speed=22.2, peak=2.3), Drive(weather="rain", rate=25.0, speed=12.5, peak=3.0),
    Drive(weather="snow", rate=3.0, speed=13.9, peak=2.3), Drive(weather="snow", rate=1.0, speed=9.7, peak=0.6),
    Drive(speed=11.1, peak=0.0, duration=4.0, hazard=(12.0, 3.7, 0.075)),
    Drive(speed=9.7, peak=0.0, duration=4.0, hazard=(10.0, 2.0, -0.08)),
    Drive(speed=7.8, peak=0.5, duration=4.0, hazard=(10.0, 3.7, 0.06)),
    Drive(speed=25.0, peak=0.0, duration=8.0), Drive(speed=22.2, peak=2.6, disc_rise=250.0),
    Drive(speed=33.3, peak=2.0, disc_rise=80.0), Drive(speed=13.9, peak=1.6, duration=5.0),
    Drive(weather="rain", rate=10.0, speed=16.7, peak=2.6), Drive(weather="snow", rate=1.0, speed=12.5, peak=2.0),
    Drive(speed=8.9, peak=0.8, duration=4.0, hazard=(9.0, 3.7, 0.05)),
    Drive(speed=9.7, peak=0.0, duration=4.0, hazard=(12.0, 2.5, 0.06)),
)  # fmt: skip
"""A design that excites every port, 14 training runs first."""
TRAINING = 14


def synthetic_campaign(
    vehicle: Vehicle,
    surface: SurfaceParameters,
    truth: Mapping[str, float],
    seed: int,
    *,
    slots: tuple[Slot, ...] = (),
    design: Sequence[Drive] = RICH,
) -> Campaign:
    """A campaign of a car that has what ``truth`` says.

    Parameters
    ----------
    vehicle, surface : the car before anything is added
    truth : effect parameters by name
    seed : of all that is drawn
    slots : forms outside any library
    design : the runs; the first `TRAINING` of them train
    """
    rng = np.random.Generator(np.random.Philox(seed))
    theta = parameter_vector(truth)
    theta[list(SESSION_INDEX)] += rng.standard_normal(len(SESSION_INDEX)) * TOLERANCES.session
    theta[PARAMETER_INDEX["wheel_inertia"]] += 0.05 * rng.random()
    runs = tuple(
        _measure(drive, i, 1 if rng.random() < 0.5 else -1, vehicle, surface, theta, slots, rng)
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


def _measure(
    drive: Drive,
    number: int,
    direction: int,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    theta: NDArray[np.float64],
    slots: tuple[Slot, ...],
    rng: np.random.Generator,
) -> Run:
    count = round(drive.duration / INTERVAL)
    t = np.arange(count) * INTERVAL
    pressure = abs(drive.peak) * np.clip((t - 1.0) / 0.3, 0.0, 1.0)
    if drive.peak < 0:
        pressure *= np.where((t > 1.5) & (((t - 1.5) % 1.0) < 0.5), 0.3, 1.0)
    response = np.zeros((count, 7))
    response[:, 0] = drive.speed
    run = Run(
        name=f"run-{number + 1:02d}", held_out=number >= TRAINING, weather=drive.weather, precipitation_mm_h=drive.rate,
        snow_accumulation_h=1.0 if drive.weather == "snow" else 0.0, direction=direction, disc_rise=drive.disc_rise,
        hazard_center=drive.hazard[0], hazard_length=drive.hazard[1], hazard_height=drive.hazard[2],
        interval=INTERVAL, pressure=pressure, response=response,
    )  # fmt: skip
    model = run_model(run, vehicle, surface)
    own = theta.copy()
    own[PARAMETER_INDEX["friction"]] += TOLERANCES.friction * rng.standard_normal()
    disturbed = tuple(_disturbance(*entry, drive.duration, rng) for entry in DISTURBANCE)
    speed = drive.speed + TOLERANCES.initial_speed * rng.standard_normal()
    out, _ = roll(model, own, slots=(*slots, *disturbed), initial_speed=speed, substeps=4 * SUBSTEPS)
    y = instruments(model, own, out)
    y[:, 1] += TOLERANCES.acceleration_bias * rng.standard_normal()
    y[:, 4] += TOLERANCES.pitch_offset * rng.standard_normal()
    for j in range(y.shape[1]):
        y[:, j] += NOISE_SIGMA[j] * _autoregressive(NOISE_RHO[j], count, rng)
    seen = np.maximum(pressure + PRESSURE_NOISE * _autoregressive(0.5, count, rng), 0.0)
    return replace(run, response=y, pressure=seen if drive.peak else pressure)


def _disturbance(
    port: str, scale: float, time: float, spacing: float, duration: float, rng: np.random.Generator
) -> Slot:
    count = int(duration / spacing) + 2
    values = scale * _autoregressive(float(np.exp(-spacing / time)), count, rng)
    return Slot(port=port, variable="time", origin=0.0, spacing=spacing, values=values)


def _autoregressive(rho: float, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    x = rng.standard_normal(count)
    for i in range(1, count):
        x[i] = rho * x[i - 1] + np.sqrt(1.0 - rho**2) * x[i]
    return x


def outcome(verdict: Verdict, truth: str | None) -> str:
    """How a verdict stands to the truth: right, wrong, set (with or without the truth) or refused.

    Parameters
    ----------
    verdict : what the tool said
    truth : name of the effect in the data; None where there is none
    """
    names = [effect.name for effect in verdict.effects]
    if truth is None:
        return "right" if not names else "false discovery"
    if not names:
        return "refused"
    if verdict.verdict == "SET":
        return (
            "set with truth"
            if truth in {*names, *(rival.name for _, rival in verdict.rivals)}
            else "set without truth"
        )
    if verdict.verdict == "UNKNOWN_FORM":
        return "form"
    return "right" if names == [truth] else "wrong"


def exact_interval(hits: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Clopper-Pearson interval of a share (Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404).

    Parameters
    ----------
    hits, trials : counts
    confidence : of the interval [1]
    """
    tail = 0.5 * (1.0 - confidence)
    low = float(beta.ppf(tail, hits, trials - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1.0 - tail, hits + 1, trials - hits)) if hits < trials else 1.0
    return low, high
