"""Which effect, if any, the model lacks: screening, refinement, gates, rivals."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.closure.campaign import SESSION, Tolerances
from tasks.closure.disturbance import Disturbance
from tasks.closure.evidence import RunEvidence
from tasks.closure.fit import Fit, Hypothesis, fit, library_hypothesis, misfit_by_run
from tasks.vehicle.effects.library import Effect

ACCEPT_SCORE = 25.0
RIVAL_SPAN = 10.0
HELD_OUT_GAIN = 4.0
WIN_SHARE = 0.6
REFINED = 5
"""Candidates of each screening that are refined through the simulation."""
BOOTSTRAP = 400


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One hypothesis added to what is already accepted, refined and judged.

    Parameters
    ----------
    hypothesis : what is added
    fitted : joint fit of it and all accepted ones; its parameters come last
    gain : log likelihood gained
    inflation : empirical-null factor by which the gain is divided
    score : gain / inflation - parameters x log N
    held_out_gain : fall of the held-out marginal misfit, divided by the inflation; 0 where the score fails
    """

    hypothesis: Hypothesis
    fitted: Fit
    gain: float
    inflation: float
    score: float
    held_out_gain: float

    @property
    def passes(self) -> bool:
        """Whether score, held-out test and bounds all hold."""
        return self.score > ACCEPT_SCORE and self.held_out_gain > HELD_OUT_GAIN and not self.fitted.at_bound


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Training and held-out runs with the library they were differentiated by.

    Parameters
    ----------
    train, held_out : runs
    effects : the library
    tolerances, disturbance : priors of session, offsets and disturbances
    """

    train: tuple[RunEvidence, ...]
    held_out: tuple[RunEvidence, ...]
    effects: tuple[Effect, ...]
    tolerances: Tolerances
    disturbance: Disturbance

    @property
    def session_sigma(self) -> NDArray[np.float64]:
        """Prior sigmas of the session, float64 [7]."""
        return np.array(self.tolerances.session)

    @property
    def samples(self) -> int:
        """Number of whitened training values, N of the score."""
        return sum(len(run.nuisance) for run in self.train)


def screen(evidence: Evidence, at: Fit) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gain and estimate of every library effect, linearly, beyond the accepted ones.

    Parameters
    ----------
    evidence : the runs
    at : fit that holds the accepted effects

    Returns
    -------
    gains float64 [E] and estimates float64 [E] of the first parameter
    """
    accepted = [j for j, e in enumerate(evidence.effects) if e.name in {p.name for p in at.parts}]
    library, n_session = len(evidence.effects), len(evidence.session_sigma)
    gram, right = np.zeros((library + n_session,) * 2), np.zeros(library + n_session)
    for run, r in zip(evidence.train, at.residuals, strict=True):
        b = np.column_stack((run.library, run.session))
        q = np.column_stack((run.library_q, run.session_q))
        gram += b.T @ b - q.T @ q
        right += b.T @ r - q.T @ run.project(r)
    others = [*accepted, *range(library, library + n_session)]
    precision = np.concatenate((np.zeros(len(accepted)), 1.0 / np.square(evidence.session_sigma)))
    right[library:] -= at.session / np.square(evidence.session_sigma)
    inner = np.linalg.inv(
        gram[np.ix_(others, others)] + np.diag(precision) + 1e-9 * np.diag(np.diag(gram)[others])
    )
    gains, estimates = np.zeros(library), np.zeros(library)
    for j, effect in enumerate(evidence.effects):
        if j in accepted:
            continue
        cross = gram[j, others]
        information = gram[j, j] - cross @ inner @ cross
        if information <= 1e-6 * gram[j, j] or gram[j, j] <= 0.0:
            continue
        value = (right[j] - cross @ inner @ right[others]) / information
        first = effect.parameters[0]
        value = min(max(value, first.lower), first.upper)
        estimates[j] = value
        gains[j] = value * (right[j] - cross @ inner @ right[others]) - 0.5 * information * value**2
    return gains, estimates


def inflation(evidence: Evidence, at: Fit, own: NDArray[np.float64] | None) -> float:
    """How much the runs disagree beyond their noise about one direction and about the library's in general.

    Under a right model every run's score z in any direction is standard normal. Q is the sum of z^2 over runs
    (Cochran 1954, doi:10.2307/3001666); the null's level is the median over the library's directions, and the
    direction's own Q counts beside it.

    Parameters
    ----------
    evidence : the runs
    at : fit whose residuals are looked at
    own : float64 [R] z of the direction itself, or None
    """
    z = np.full((len(evidence.train), len(evidence.effects)), np.nan)
    for i, (run, r) in enumerate(zip(evidence.train, at.residuals, strict=True)):
        q, qr = run.library_q, run.project(r)
        information = np.einsum("ij,ij->j", run.library, run.library) - np.einsum("ij,ij->j", q, q)
        alive = information * np.array([e.parameters[0].step for e in evidence.effects]) ** 2 > 0.05
        z[i, alive] = ((run.library.T @ r - q.T @ qr) / np.sqrt(np.maximum(information, 1e-30)))[alive]
    count = np.sum(np.isfinite(z), axis=0)
    mean_square = np.nansum(z**2, axis=0)[count >= 4] / count[count >= 4]
    level = max(float(np.median(mean_square)), 1.0) if mean_square.size else 1.0
    if own is None or len(own) < 3:
        return level
    return max(level, (float(np.sum(own**2)) + 6.0 * level) / (len(own) - 1 + 6.0))


def judge(
    evidence: Evidence, base: Fit, base_held_out: NDArray[np.float64], hypothesis: Hypothesis
) -> Candidate:
    """Refine a hypothesis on top of ``base`` and judge it on training and held-out runs.

    Parameters
    ----------
    evidence : the runs
    base : fit of what is accepted so far
    base_held_out : float64 [H] held-out misfits under ``base``
    hypothesis : what may be added
    """
    first = np.arange(len(hypothesis.names)) == 0
    session = base.session.copy()
    if hypothesis.names[0] in SESSION:
        # the session already carries the same number under a prior: hand it over to the free parameter
        place = SESSION.index(hypothesis.names[0])
        hypothesis = replace(hypothesis, start=np.array([session[place]]))
        session[place] = 0.0
    # Starts: the linear estimate with the accepted fit's disturbances; the same with fresh ones, which have
    # not yet absorbed what is sought; close to the accepted fit, which the hypothesis extends.
    fitted = None
    for share, offsets in ((1.0, base.offsets), (1.0, None), (0.1, base.offsets)):
        trial = fit(
            evidence.train,
            (*base.parts, hypothesis),
            evidence.session_sigma,
            values=np.concatenate((base.values, np.where(first, share * hypothesis.start, hypothesis.start))),
            session=session,
            offsets=offsets,
            iterations=4,
        )
        if fitted is None or trial.objective < fitted.objective:
            fitted = trial
        worthwhile = (
            0.5 * (base.objective - fitted.objective) > ACCEPT_SCORE or hypothesis.names[0] in SESSION
        )
        if fitted.objective < base.objective and not (offsets is base.offsets and worthwhile):
            break
    assert fitted is not None
    return assess(evidence, base, base_held_out, hypothesis, fitted)


def assess(
    evidence: Evidence,
    base: Fit,
    base_held_out: NDArray[np.float64],
    hypothesis: Hypothesis,
    fitted: Fit,
) -> Candidate:
    """Judge a fit that extends ``base`` by a hypothesis.

    Parameters
    ----------
    evidence : the runs, with derivatives that hold at the fit
    base : fit of what is accepted so far
    base_held_out : float64 [H] held-out misfits under ``base``
    hypothesis : what was added; its parameters come last
    fitted : the joint fit
    """
    gain = 0.5 * (base.objective - fitted.objective)
    factor = inflation(evidence, fitted, _own_scores(evidence, fitted, hypothesis))
    penalty = float(len(hypothesis.names) * np.log(evidence.samples))
    if gain / factor - penalty > ACCEPT_SCORE:
        # what the base reaches from here as well is no merit of the hypothesis
        gain = min(gain, 0.5 * (_back(evidence, base, hypothesis, fitted).objective - fitted.objective))
    score = gain / factor - penalty
    held_out = 0.0
    if score > ACCEPT_SCORE:
        held_out = float(np.sum(base_held_out - misfit_by_run(evidence.held_out, fitted))) / factor
    return Candidate(
        hypothesis=hypothesis, fitted=fitted, gain=gain, inflation=factor, score=score, held_out_gain=held_out
    )


def _back(evidence: Evidence, base: Fit, hypothesis: Hypothesis, fitted: Fit) -> Fit:
    """The base fitted again from where a fit that extends it ended."""
    session = fitted.session.copy()
    k = len(hypothesis.names)
    if hypothesis.names[0] in SESSION:
        session[SESSION.index(hypothesis.names[0])] += fitted.values[-k]
    return fit(
        evidence.train, base.parts, evidence.session_sigma, values=fitted.values[:-k], session=session,
        offsets=fitted.offsets, iterations=4,
    )  # fmt: skip


def _own_scores(evidence: Evidence, fitted: Fit, hypothesis: Hypothesis) -> NDArray[np.float64]:
    names = [e.name for e in evidence.effects]
    if hypothesis.name not in names:
        return np.empty(0)
    j = names.index(hypothesis.name)
    scores = []
    for run, r in zip(evidence.train, fitted.residuals, strict=True):
        a = run.library[:, j]
        q = run.library_q[:, j]
        information = float(a @ a - q @ q)
        if information * hypothesis.step[0] ** 2 > 0.05:
            scores.append(float(a @ r - q @ run.project(r)) / np.sqrt(information))
    return np.array(scores)


def ladder(evidence: Evidence, base: Fit, count: int = REFINED) -> list[Candidate]:
    """The best candidates to add to ``base``, refined and sorted by score, best first.

    Parameters
    ----------
    evidence : the runs
    base : fit of what is accepted so far
    count : how many of the screening are refined
    """
    gains, estimates = screen(evidence, base)
    held_out = misfit_by_run(evidence.held_out, base)
    order = [j for j in np.argsort(-gains, kind="stable") if gains[j] > 0.3 * ACCEPT_SCORE][:count]
    hypotheses = [library_hypothesis(evidence.effects[j], float(estimates[j])) for j in order]
    judged = [judge(evidence, base, held_out, hypothesis) for hypothesis in hypotheses]
    return sorted(judged, key=lambda c: -c.score)


def win_share(candidates: list[Candidate], base: Fit, seed: int = 0) -> float:
    """Share of bootstrap resamples of the runs in which the first candidate keeps the best score.

    Parameters
    ----------
    candidates : refined, best first
    base : the fit they were added to
    seed : of the resampling
    """
    draws = np.random.Generator(np.random.Philox(seed)).integers(
        0, len(base.by_run), (BOOTSTRAP, len(base.by_run))
    )
    scores = []
    for c in candidates:
        per_run = 0.5 * (base.by_run - c.fitted.by_run) / c.inflation
        penalty = c.gain / c.inflation - c.score
        scores.append(per_run[draws].sum(axis=1) - penalty)
    winner = np.argmax(np.array(scores), axis=0)
    return float(np.mean((winner == 0) & (scores[0] > 0.0)))


def nested(small: Hypothesis, large: Hypothesis) -> bool:
    """Whether every parameter of ``small`` is also one of ``large``."""
    return set(small.names) < set(large.names)


def without(base: Fit, index: int, evidence: Evidence) -> Fit:
    """Refit with one accepted part left out.

    Parameters
    ----------
    base : fit with all parts
    index : the part to leave out
    evidence : the runs
    """
    parts = tuple(p for i, p in enumerate(base.parts) if i != index)
    sizes = [len(p.names) for p in base.parts]
    at = sum(sizes[:index])
    values = np.delete(base.values, np.arange(at, at + sizes[index]))
    return fit(
        evidence.train, parts, base.session_sigma, values=values, session=base.session, offsets=base.offsets,
        iterations=8,
    )  # fmt: skip
