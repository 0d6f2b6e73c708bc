"""Campaigns with a known truth, for the error rates of the method; the generator differs from the judged model.

The generator integrates at an eighth of the step, draws session and run offsets, Gauss-Markov disturbances in
force, friction and pitch moment on its own knots, AR(1) sensor noise, and coloured noise on the pressure that
the model reads. Its wheel inertia has an error that no nuisance covers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv

from tasks.campaign.campaign import SESSION, Campaign, Run, Tolerances
from tasks.campaign.planned_runs import RICH, TRAINING, RunPlan, make_planned_run
from tasks.identification.decision.answer import Verdict
from tasks.identification.inference.forward import compute_instrument_readings, prepare_run, simulate_run
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import PARAMETER_INDEX, build_parameter_vector
from tasks.vehicle.parameters import Vehicle

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
    y = compute_instrument_readings(model, own, driven)
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


def classify_outcome(verdict: Verdict, truth: str | None, form: tuple[str, str] | None = None) -> str:
    """Return how a verdict compares with the truth: right, wrong, a set with or without the truth, a form, or refused.

    Parameters
    ----------
    verdict : verdict of `judge_runs`
    truth : name of the effect in the data; None where there is none
    form : port and variable of a truth outside the library
    """
    names = [effect.name for effect in verdict.effects]
    if truth is None:
        return "right" if not names else "false discovery"
    if not names:
        return "refused"
    if form is not None and verdict.verdict in ("UNKNOWN_FORM", "SET"):
        right = form in {(e.port, e.variable) for e in verdict.effects if e.effect_class == "form"}
        if verdict.verdict == "UNKNOWN_FORM":
            return "right form" if right else "wrong form"
        return "set with truth" if right else "set without truth"
    if verdict.verdict == "UNKNOWN_FORM":
        return "form"
    if verdict.verdict == "SET":
        contained = truth in {*names, *(rival.name for _, rival in verdict.rivals)}
        return "set with truth" if contained else "set without truth"
    return "right" if names == [truth] else "wrong"


def measure_interval_miss(verdict: Verdict, truth: str, values: Mapping[str, float]) -> float | None:
    """Return how far the truth is from the first parameter's value, in halves of its 95 % interval on that side [1].

    The interval holds the truth up to 1. None unless the truth alone is named.

    Parameters
    ----------
    verdict : verdict of `judge_runs`
    truth : name of the effect in the data
    values : its parameters by name [units of the table]
    """
    if [effect.name for effect in verdict.effects] != [truth]:
        return None
    first = verdict.effects[0].parameters[0]
    off = values[first.name] - first.value
    half = first.ci_high - first.value if off > 0.0 else first.value - first.ci_low
    return float(abs(off) / max(half, np.finfo(np.float64).tiny))


def compute_exact_interval(hits: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the Clopper-Pearson interval of a share (Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404).

    Parameters
    ----------
    hits, trials : number of successes and of trials [1]
    confidence : probability that the interval covers the share [1]
    """
    tail = 0.5 * (1.0 - confidence)
    low = float(betaincinv(hits, trials - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, trials - hits, 1.0 - tail)) if hits < trials else 1.0
    return low, high
