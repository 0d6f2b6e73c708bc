"""Fitting a hypothesis through the simulation: Gauss-Newton with every nuisance integrated out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.closure.campaign import SESSION
from tasks.closure.evidence import SESSION_INDEX, RunEvidence
from tasks.closure.hypothesis import Hypothesis, compose

SETTLING = 4
"""Moves of a run's point of linearisation before its misfit is taken."""
HELD = 1e18
"""Prior precision that holds a nuisance at 0."""
SLACK = 1.0
"""Rise of a run's misfit that is taken for rounding when its point of linearisation moves."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A fitted set of hypotheses.

    Parameters
    ----------
    parts : the hypotheses, in the order of the parameters
    values : float64 [K] all parameters
    session : float64 [7] session nuisances
    session_sigma : float64 [7] their prior sigmas
    objective : sum over runs of the marginalised misfit, plus the session's prior term
    by_run : float64 [R] misfit of each run without the session's prior
    covariance : float64 [K, K] of the parameters, session marginalised
    residuals : whitened residual of each run at the fit
    offsets : the run's own offsets about which each residual is linearised
    """

    parts: tuple[Hypothesis, ...]
    values: NDArray[np.float64]
    session: NDArray[np.float64]
    session_sigma: NDArray[np.float64]
    objective: float
    by_run: NDArray[np.float64]
    covariance: NDArray[np.float64]
    residuals: tuple[NDArray[np.float64], ...]
    offsets: tuple[NDArray[np.float64], ...]

    @property
    def at_bound(self) -> bool:
        """Whether a parameter sits on its bound, other than at 0 for a second parameter."""
        lower = np.concatenate([p.lower for p in self.parts]) if self.parts else np.empty(0)
        upper = np.concatenate([p.upper for p in self.parts]) if self.parts else np.empty(0)
        first = (
            np.concatenate([np.arange(len(p.names)) == 0 for p in self.parts]) if self.parts else np.empty(0)
        )
        margin = 1e-6 * (upper - lower)
        touching = (self.values <= lower + margin) | (self.values >= upper - margin)
        return bool(np.any(touching & (first.astype(bool) | (self.values != 0.0))))


def fit(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    session_sigma: NDArray[np.float64],
    *,
    values: NDArray[np.float64] | None = None,
    session: NDArray[np.float64] | None = None,
    offsets: tuple[NDArray[np.float64], ...] | None = None,
    iterations: int = 5,
) -> Fit:
    """Fit all parameters and the session's nuisances to the runs.

    Parameters
    ----------
    evidence : the runs
    parts : hypotheses; none fits the session alone
    session_sigma : float64 [7] prior sigmas of the session
    values, session, offsets : where to start
    iterations : at most so many Gauss-Newton steps
    """
    lower = np.concatenate([p.lower for p in parts]) if parts else np.empty(0)
    upper = np.concatenate([p.upper for p in parts]) if parts else np.empty(0)
    steps = np.concatenate([p.step for p in parts]) if parts else np.empty(0)
    x = (
        (np.concatenate([p.start for p in parts]) if parts else np.empty(0))
        if values is None
        else values.copy()
    )
    s = np.zeros(len(SESSION_INDEX)) if session is None else session.copy()
    prior = 1.0 / np.square(session_sigma)
    # a free parameter that is also a session nuisance is the same number: the nuisance rests at 0
    taken = [SESSION.index(name) for part in parts for name in part.names if name in SESSION]
    s[taken], prior[taken] = 0.0, HELD
    k = len(x)
    if offsets is None:
        offsets, by_run, residuals, _ = _settled(evidence, parts, x, s)
        objective = float(by_run.sum() + np.sum(prior * s**2))
    else:
        objective, by_run, residuals = _misfit(evidence, parts, x, s, prior, offsets)
    normal = np.eye(k + len(s))
    for _ in range(iterations):
        normal = np.diag(np.concatenate((np.zeros(k), prior)))
        right = np.concatenate((np.zeros(k), -prior * s))
        for run, r, d in zip(evidence, residuals, offsets, strict=True):
            a = np.empty((len(r), k))
            for j in range(k):
                step = steps[j] * 0.3
                if x[j] + step > upper[j]:
                    step = -step
                moved = x.copy()
                moved[j] += step
                a[:, j] = (r - run.residual(*compose(parts, moved, s), d)) / step
            columns = np.column_stack((a, run.session))
            q = np.column_stack((run.project(a), run.session_q)) if k else run.session_q
            qr = run.project(r)
            normal += columns.T @ columns - q.T @ q
            right += columns.T @ r - q.T @ qr
        free = np.ones(k + len(s), dtype=bool)
        for _ in range(k + 1):
            move = np.zeros(k + len(s))
            move[free] = np.linalg.solve(
                normal[np.ix_(free, free)] + 1e-12 * np.diag(np.diag(normal)[free] + 1e-30), right[free]
            )
            outside = (x + move[:k] < lower) & (x <= lower) | (x + move[:k] > upper) & (x >= upper)
            if not np.any(outside & free[:k]):
                break
            free[:k] &= ~outside
        expected = float(move @ right)
        share = 1.0
        better = False
        for _ in range(4):
            x_try = np.clip(x + share * move[:k], lower, upper)
            s_try = s + share * move[k:]
            trial = _misfit(evidence, parts, x_try, s_try, prior, offsets)
            if trial[0] < objective:
                better = True
                break
            share *= 0.4
        if not better:
            break
        before = objective
        x, s = x_try, s_try
        offsets, by_run, residuals, _ = _relinearised(evidence, parts, x, s, offsets, trial[1], trial[2])
        objective = float(by_run.sum() + np.sum(prior * s**2))
        if abs(before - objective) < 0.3 and expected < 0.5:
            break
    # scaled first: in their own units the parameters' information spans more than double precision can invert
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    inverse = np.linalg.pinv(normal / np.outer(size, size)) / np.outer(size, size)
    covariance = np.asarray(inverse[:k, :k], dtype=np.float64)
    return Fit(
        parts=parts, values=x, session=s, session_sigma=session_sigma, objective=objective, by_run=by_run,
        covariance=covariance, residuals=tuple(residuals), offsets=offsets,
    )  # fmt: skip


def misfit_by_run(
    evidence: tuple[RunEvidence, ...], fitted: Fit
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Marginalised misfit of runs under a fit made on other runs, and how far it is from settled; float64 [R]."""
    _, by_run, _, doubt = _settled(evidence, fitted.parts, fitted.values, fitted.session)
    return by_run, doubt


def fall(
    before: tuple[NDArray[np.float64], NDArray[np.float64]],
    after: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> float:
    """Fall of the misfit summed over runs, each run's counted only beyond its numerical doubt.

    Parameters
    ----------
    before, after : of `misfit_by_run`
    """
    change = before[0] - after[0]
    return float(np.sum(np.sign(change) * np.maximum(np.abs(change) - before[1] - after[1], 0.0)))


def _settled(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
) -> tuple[
    tuple[NDArray[np.float64], ...], NDArray[np.float64], list[NDArray[np.float64]], NDArray[np.float64]
]:
    offsets = tuple(np.zeros(run.nuisance.shape[1]) for run in evidence)
    _, by_run, residuals = _misfit(evidence, parts, x, s, np.zeros_like(s), None)
    doubt = np.zeros_like(by_run)
    for _ in range(SETTLING):
        offsets, by_run, residuals, doubt = _relinearised(evidence, parts, x, s, offsets, by_run, residuals)
    return offsets, by_run, residuals, doubt


def _relinearised(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
    offsets: tuple[NDArray[np.float64], ...],
    by_run: NDArray[np.float64],
    residuals: list[NDArray[np.float64]],
) -> tuple[
    tuple[NDArray[np.float64], ...], NDArray[np.float64], list[NDArray[np.float64]], NDArray[np.float64]
]:
    """Move every run's point of linearisation towards its posterior, as far as the run does not fit worse.

    Last comes by how much the full move changes each run's misfit: 0 where the linearisation holds.
    """
    theta, slots = compose(parts, x, s)
    places, misfits, fresh = list(offsets), by_run.copy(), list(residuals)
    doubt = np.zeros_like(by_run)
    for i, run in enumerate(evidence):
        move = run.offsets(residuals[i]) - offsets[i]
        for share in (1.0, 0.4):
            trial = offsets[i] + share * move
            r = run.residual(theta, slots, trial)
            q = run.project(r)
            misfit = float(r @ r - q @ q)
            if share == 1.0:
                doubt[i] = abs(misfit - by_run[i])
            if misfit <= by_run[i] + SLACK:
                places[i], misfits[i], fresh[i] = trial, misfit, r
                break
    return tuple(places), misfits, fresh, doubt


def _misfit(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    values: NDArray[np.float64],
    session: NDArray[np.float64],
    prior: NDArray[np.float64],
    offsets: tuple[NDArray[np.float64], ...] | None,
) -> tuple[float, NDArray[np.float64], list[NDArray[np.float64]]]:
    theta, slots = compose(parts, values, session)
    own = offsets if offsets is not None else (None,) * len(evidence)
    residuals = [run.residual(theta, slots, d) for run, d in zip(evidence, own, strict=True)]
    projected = [run.project(r) for run, r in zip(evidence, residuals, strict=True)]
    by_run = np.array([float(r @ r - q @ q) for r, q in zip(residuals, projected, strict=True)])
    return float(by_run.sum() + np.sum(prior * session**2)), by_run, residuals
