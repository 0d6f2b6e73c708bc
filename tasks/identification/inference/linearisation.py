"""Linearisation of all runs about a fit, and the scales of their disturbances."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from tasks.campaign.campaign import SESSION, Campaign, Tolerances
from tasks.campaign.gauge import denoise_pressure
from tasks.identification.inference.derivatives import (
    differentiate_by_library,
    differentiate_run,
)
from tasks.identification.inference.disturbance import Disturbance, compute_prior_precision
from tasks.identification.inference.evidence import Evidence, RunEvidence, set_disturbance_prior
from tasks.identification.inference.fit import Fit, fit_hypotheses
from tasks.identification.inference.forward import RunModel, predict_channels, prepare_run
from tasks.identification.inference.hypothesis import compose_parameters
from tasks.identification.inference.noise import estimate_channel_noise, whiten_channels
from tasks.identification.inference.start import estimate_session
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

BODY_CHANNELS = ("pitch", "pitch_rate", "vertical_acceleration")
SUSPENSION = ("pitch_gain", "damping", "stiffness")
"""Session nuisances that act on the body's motion only."""
UNSEEN = 1e-3
"""Factor on the tolerance of a nuisance that no channel depends on, which keeps it at 0."""
KNOWN = 0.04
"""Most that a number of the session moves by one of its tolerances, in which its derivatives count [1]."""
FREED = 20.0
"""Factor on the session's tolerances while the disturbances are scaled, so that they do not absorb a wrong number."""


def prepare_evidence(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    effects: tuple[Effect, ...],
    rules: DecisionRules,
) -> tuple[Evidence, Fit]:
    """Return noise and derivatives under the first guess of the disturbances, and the fit without effects.

    The derivatives are those about the model as it stands or, where the runs pull a number of the session far from it,
    about that fit.

    Parameters
    ----------
    campaign : measured runs with their split
    vehicle, surface : judged model
    effects : library of candidates
    rules : decision rules; they say which runs are left out
    """
    rho, sigma = estimate_channel_noise(campaign)
    tolerances = _leave_out_unseen(campaign)
    guess = Disturbance()
    models = [
        prepare_run(replace(run, pressure=denoise_pressure(run.pressure)), vehicle, surface)
        for run in campaign.runs
    ]
    first = estimate_session(campaign, [m for m in models if not m.run.held_out], rules)
    base, session_sigma = compose_parameters((), np.empty(0), first)[0], np.array(tolerances.file_numbers)

    def select_models(held_out: bool) -> list[RunModel]:
        """Return the training or the held-out runs that are insensitive to the step; all if these are too few."""
        own = [m for m in models if m.run.held_out == held_out]
        insensitive = [m for m in own if compute_step_misfit(m, base, rho, sigma) <= rules.step_misfit]
        return insensitive if len(insensitive) >= rules.fewest_runs else own

    def differentiate_runs(own: list[RunModel], base: NDArray[np.float64]) -> tuple[RunEvidence, ...]:
        """Return the derivatives of runs by everything but the library."""
        return tuple(differentiate_run(m, rho, sigma, base, (), tolerances, guess) for m in own)

    train, held_out = select_models(False), select_models(True)
    used = [m.run.name for m in (*train, *held_out)]
    runs = differentiate_runs(train, base)
    null = fit_hypotheses(runs, (), session_sigma, session=first, iterations=6)
    known = np.minimum(session_sigma, KNOWN)
    if np.max(np.abs(null.session - first) / known) > rules.relinearisation_pull:
        base = compose_parameters((), np.empty(0), null.session)[0]
        runs = differentiate_runs(train, base)
        null = fit_hypotheses(runs, (), session_sigma, session=null.session, iterations=6)
    evidence = Evidence(
        train=tuple(differentiate_by_library(run, base, effects) for run in runs),
        held_out=tuple(held_out), effects=effects,
        tolerances=tolerances, disturbance=guess, sensors=(rho, sigma), rules=rules,
        step_sensitive=tuple(run.name for run in campaign.runs if run.name not in used),
    )  # fmt: skip
    return evidence, null


def _leave_out_unseen(campaign: Campaign) -> Tolerances:
    """Return the tolerances, with the suspension fixed where no channel depends on the body's motion."""
    if any(name in campaign.channels for name in BODY_CHANNELS):
        return campaign.tolerances
    session = (
        UNSEEN * s if name in SUSPENSION else s
        for name, s in zip(SESSION, campaign.tolerances.session, strict=True)
    )
    return replace(campaign.tolerances, session=tuple(session))


def compute_step_misfit(
    model: RunModel, theta: NDArray[np.float64], rho: NDArray[np.float64], sigma: NDArray[np.float64]
) -> float:
    """Return the misfit that halving the integration step alone makes [1].

    Runs that are sensitive to the step, such as those that stay near the threshold of the ABS, have a large one.

    Parameters
    ----------
    model : the run
    theta : float64 [len(EFFECT_TABLE)] parameters [units of the table]
    rho, sigma : channel noise
    """
    change = predict_channels(model, theta) - predict_channels(model, theta, refinement=2)
    return float(np.sum(whiten_channels(change, rho, sigma, model.sampled) ** 2))


def differentiate_at(evidence: Evidence, at: Fit) -> Evidence:
    """Return the same runs with derivatives taken about a fit.

    Parameters
    ----------
    evidence : the runs
    at : fit, the new linearisation point
    """
    theta, slots = at.compose()
    here = evidence.effects, evidence.tolerances, evidence.disturbance
    return replace(
        evidence,
        train=tuple(
            differentiate_run(run.model, run.rho, run.sigma, theta, *here, slots) for run in evidence.train
        ),
    )


def differentiate_about_offsets(evidence: Evidence, at: Fit) -> tuple[RunEvidence, ...]:
    """Return the training runs with derivatives about a fit and about each run's own offsets there, without a library.

    A run's own friction decides when its anti-lock brake acts: derivatives about an offset of 0 may tell many times too
    much about the brake there.

    Parameters
    ----------
    evidence : the runs
    at : fit, the new linearisation point
    """
    theta, slots = at.compose()
    runs = []
    for run, offsets in zip(evidence.train, at.offsets, strict=True):
        model, moved, forms = run.apply_offsets(theta, slots, offsets)
        fresh = differentiate_run(
            model, run.rho, run.sigma, moved, (), evidence.tolerances, evidence.disturbance, forms
        )
        runs.append(replace(fresh, model=run.model, origin=offsets))
    return tuple(runs)


def rescale_disturbances(evidence: Evidence, disturbance: Disturbance) -> Evidence:
    """Return the same runs under other scales of the disturbances.

    Parameters
    ----------
    evidence : the runs
    disturbance : scales and correlation times
    """
    return replace(
        evidence,
        disturbance=disturbance,
        train=tuple(set_disturbance_prior(run, evidence.tolerances, disturbance) for run in evidence.train),
    )


def compute_whitened_residuals(evidence: Evidence, at: Fit) -> list[NDArray[np.float64]]:
    """Return the whitened residual of every training run at a fit, with its own offsets at 0; float64 [M] each.

    Parameters
    ----------
    evidence : the runs
    at : fit
    """
    theta, slots = at.compose()
    return [run.compute_residual(theta, slots) for run in evidence.train]


def fit_disturbance(
    evidence: tuple[RunEvidence, ...],
    residuals: list[NDArray[np.float64]],
    tolerances: Tolerances,
    effects: tuple[Effect, ...],
    start: Disturbance,
    splines: tuple[NDArray[np.float64], ...],
    ridge: NDArray[np.float64],
) -> Disturbance:
    """Return scales and times by marginal likelihood, with every library direction, every spline and the session free.

    With these directions fixed at 0, an effect or a form would inflate the disturbance, which would then hide it.

    Parameters
    ----------
    evidence : training runs
    residuals : whitened residual of each run at the linearisation point, float64 [M]
    tolerances : session priors
    effects : library, whose steps set broad priors
    start : first guess
    splines : derivatives of each run by the knots of the splines, float64 [M, K]
    ridge : float64 [K] precision of their priors
    """
    broad = [(30.0 * e.parameters[0].step) ** -2 for e in effects]
    prior = np.concatenate((1.0 / np.square(FREED * np.array(tolerances.file_numbers)), broad, ridge))
    blocks = []
    for run, r, columns in zip(evidence, residuals, splines, strict=True):
        b = np.column_stack((r, run.session, run.library, columns))
        blocks.append((b.T @ b, run.nuisance.T @ b))

    def compute_cost(trial: Disturbance) -> float:
        total = np.zeros_like(blocks[0][0])
        value = 0.0
        for run, (gram, cross) in zip(evidence, blocks, strict=True):
            precision, log_det = compute_prior_precision(run.knots, tolerances, trial)
            factor = cholesky(run.information + precision, lower=True, check_finite=False)
            q = solve_triangular(factor, cross, lower=True, check_finite=False)
            total += gram - q.T @ q
            value += 2.0 * float(np.sum(np.log(np.diag(factor)))) - log_det
        inner = cholesky(total[1:, 1:] + np.diag(prior), lower=True, check_finite=False)
        q = solve_triangular(inner, total[1:, 0], lower=True, check_finite=False)
        return value + float(total[0, 0] - q @ q) + 2.0 * float(np.sum(np.log(np.diag(inner))))

    best, lowest = start, compute_cost(start)
    for factor in (2.0, 1.4):
        for field in ("scale", "time"):
            for port in range(3):
                for direction in (factor, 1.0 / factor):
                    improved = True
                    while improved:
                        values = list(getattr(best, field))
                        values[port] *= direction
                        trial = replace(best, **{field: tuple(values)})
                        value = compute_cost(trial) if 0.15 <= trial.time[port] <= 6.0 else np.inf
                        improved = value < lowest - 0.5
                        if improved:
                            best, lowest = trial, value
    return best
