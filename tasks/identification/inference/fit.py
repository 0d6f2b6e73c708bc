"""Fit of hypotheses through the simulation: Gauss-Newton with every nuisance marginalised."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from tasks.campaign.campaign import FILE_NUMBERS
from tasks.identification.inference.evidence import SESSION_INDEX, RunEvidence
from tasks.identification.inference.hypothesis import Hypothesis, compose_parameters
from tasks.identification.inference.linearisation_points import (
    LinearisedRun,
    collect_misfits,
    linearise_at,
    linearise_runs,
    move_linearisation_points,
)
from tasks.identification.inference.quantiles import NORMAL_QUANTILE, OUTSIDE
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import PARAMETERS

HELD = 1e18
"""Prior precision that holds a nuisance at 0."""
MISSED = 0.3
"""Relative error of the predicted fall of the misfit from which derivatives are taken anew."""

INFORMED = 0.01
"""Share of the best informed run's information from which a run informs a direction [1]."""
SETTLED = 1.0
"""Fall of the misfit that a fit no longer seeks: half a unit of log likelihood [1]."""
LIMITS = tuple(
    np.array([getattr(PARAMETERS[name], end) for name in FILE_NUMBERS]) for end in ("lower", "upper")
)
"""Bounds of the numbers of the file, float64 [8] each."""
TRIALS = ((1.0, True), (0.4, True), (1.0, False), (0.4, False), (0.16, False), (0.064, False))
"""Shares of a step that are tried, and whether the runs' own offsets move with it."""

Slopes = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Derivatives by parameters and session, float64 [M, K + 7], and their projection on the nuisances, [D, K + 7]."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A joint fit of hypotheses.

    Parameters
    ----------
    parts : the hypotheses, in the order of the parameters
    values : float64 [K] all parameters [their units]
    session : float64 [8] session nuisances
    session_sigma : float64 [8] their prior sigmas
    objective : sum over runs of the marginalised misfit, plus the session's prior term
    covariance : float64 [K, K] of the parameters, session marginalised
    session_error : float64 [8] standard deviations of the session's nuisances, parameters marginalised
    scatter : float64 [K + 8] standard deviations that the runs' scatter adds to those of noise
    residuals : whitened residual of each run at the fit
    offsets : float64 [D] each, the run's own offsets about which its residual is linearised
    """

    parts: tuple[Hypothesis, ...]
    values: NDArray[np.float64]
    session: NDArray[np.float64]
    session_sigma: NDArray[np.float64]
    objective: float
    covariance: NDArray[np.float64]
    session_error: NDArray[np.float64]
    scatter: NDArray[np.float64]
    residuals: tuple[NDArray[np.float64], ...]
    offsets: tuple[NDArray[np.float64], ...]

    def compose(self) -> tuple[NDArray[np.float64], tuple[Slot, ...]]:
        """Return the full vector theta and the slots of all parts, with the session's nuisances added."""
        return compose_parameters(self.parts, self.values, self.session)

    @property
    def pulls(self) -> NDArray[np.float64]:
        """Return how far each number of the session is pulled, in its prior sigmas and either way, float64 [8]."""
        return np.asarray(np.abs(self.session) / self.session_sigma)


@dataclass(frozen=True, kw_only=True)
class _State:
    """Where a fit stands: parameters, session, the runs linearised there, and their misfit with the session's prior."""

    values: NDArray[np.float64]
    session: NDArray[np.float64]
    points: tuple[LinearisedRun, ...]
    misfit: float


def fit_hypotheses(
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
    parts : hypotheses; without any, the session alone is fitted
    session_sigma : float64 [8] prior sigmas of the session
    values, session, offsets : start of the fit; by default the hypotheses' first values, 0 and 0
    iterations : largest number of Gauss-Newton steps
    """
    lower, upper, steps, first = (
        np.concatenate([np.empty(0), *(getattr(p, field) for p in parts)])
        for field in ("lower", "upper", "step", "start")
    )
    least, most = (np.concatenate((own, limit)) for own, limit in zip((lower, upper), LIMITS, strict=True))
    x = first if values is None else values.copy()
    s = np.zeros(len(SESSION_INDEX)) if session is None else session.copy()
    prior = 1.0 / np.square(session_sigma)
    # a free parameter that is also a session nuisance is the same number: the nuisance stays at 0
    taken = [FILE_NUMBERS.index(name) for part in parts for name in part.names if name in FILE_NUMBERS]
    s[taken], prior[taken] = 0.0, HELD
    k = len(x)
    points = (
        linearise_runs(evidence, parts, x, s)
        if offsets is None
        else linearise_at(evidence, parts, x, s, offsets)
    )
    here = _State(values=x, session=s, points=points, misfit=_compute_total_misfit(points, prior, s))
    slopes: list[Slopes] = []
    normal = np.eye(k + len(s))
    blind, fell, foreseen = False, np.inf, np.inf
    for _ in range(iterations):
        unforeseen = k and np.isfinite(fell) and abs(fell - foreseen) > MISSED * foreseen + 1.0
        if not slopes or unforeseen or blind:
            x = here.values
            ways = np.where(x + 0.3 * steps > upper, -0.3, 0.3) * steps
            slopes = _differentiate_runs(evidence, parts, x, here.session, ways)
            normal = np.diag(np.concatenate((np.zeros(k), prior)))
            for columns, q in slopes:
                normal += columns.T @ columns - q.T @ q
            # a threshold has no derivative while its effect is 0: take derivatives again after the effect has moved
            blind = bool(np.any(np.diag(normal)[:k] == 0.0))
        right = np.concatenate((np.zeros(k), -prior * here.session))
        for score in _score_runs(evidence, here.points, slopes):
            right += score
        move = _compute_gauss_newton_step(
            normal, right, np.concatenate((here.values, here.session)), least, most
        )
        foreseen = float(move @ right)
        if foreseen < 0.1 and abs(fell) < 3.0:
            break
        there = _step_along(evidence, parts, here, move, slopes, foreseen, (least, most), prior)
        if there is None:
            break
        fell, here = here.misfit - there.misfit, there
        if abs(fell) < SETTLED and foreseen < SETTLED:
            break
    # scaled first: in their own units the information matrix is too ill-conditioned for double precision
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    inverse = np.asarray(
        np.linalg.pinv(normal / np.outer(size, size)) / np.outer(size, size), dtype=np.float64
    )
    scatter = _measure_scatter(_score_runs(evidence, here.points, slopes) @ inverse, slopes, inverse)
    return Fit(
        parts=parts, values=here.values, session=here.session, session_sigma=session_sigma, objective=here.misfit,
        covariance=inverse[:k, :k],
        session_error=np.sqrt(np.diag(inverse)[k:]), scatter=scatter,
        residuals=tuple(
            run.add_offsets(point.residual, point.offsets)
            for run, point in zip(evidence, here.points, strict=True)
        ),
        offsets=tuple(point.offsets for point in here.points),
    )  # fmt: skip


def _score_runs(
    evidence: tuple[RunEvidence, ...], points: tuple[LinearisedRun, ...], slopes: list[Slopes]
) -> NDArray[np.float64]:
    """Return the score of every run by parameters and session, float64 [R, K + 8]."""
    # the offsets' linear part N d of the residual: columns' N = q' factor'
    return np.array(
        [
            columns.T @ point.residual + q.T @ (run.factor.T @ point.offsets - point.projected)
            for run, point, (columns, q) in zip(evidence, points, slopes, strict=True)
        ]
    )


def _measure_scatter(
    scores: NDArray[np.float64], slopes: list[Slopes], inverse: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the standard deviations that the runs' scatter adds to those of noise, float64 [K + 8].

    The variance that noise of the runs makes counts as often as Cochran's mean square is above 1, by the t quantile of
    so few runs over the normal one (Hartung and Knapp 2001, doi:10.1002/sim.791). Fewer than three runs say nothing.

    Parameters
    ----------
    scores : float64 [R, K + 8] of every run, along the columns of ``inverse``
    slopes : derivatives of every run
    inverse : float64 [K + 8, K + 8] covariance
    """
    size = np.array(
        [np.sum((c @ inverse) ** 2, axis=0) - np.sum((q @ inverse) ** 2, axis=0) for c, q in slopes]
    )
    informed = size > INFORMED * size.max(axis=0)
    square = np.where(informed, scores**2 / np.maximum(size, 1e-300), 0.0).sum(axis=0)
    freedom = informed.sum(axis=0) - 1
    few = np.maximum(freedom, 2)
    excess = np.where(freedom < 2, 0.0, np.maximum(square / few - 1.0, 0.0))
    return np.asarray(np.sqrt(size.sum(axis=0) * excess) * stdtrit(few, 1.0 - OUTSIDE) / NORMAL_QUANTILE)


def _step_along(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    here: _State,
    move: NDArray[np.float64],
    slopes: list[Slopes],
    foreseen: float,
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]],
    prior: NDArray[np.float64],
) -> _State | None:
    """Return where the first share of a step leads that lowers the misfit; None where none does.

    Parameters and each run's own offsets move together; if that does not help, one after the other.
    """
    k = len(here.values)
    ahead = tuple(
        run.estimate_offsets(point.projected - q @ move)
        for run, point, (_, q) in zip(evidence, here.points, slopes, strict=True)
    )
    for share, together in TRIALS:
        if share * (2.0 - share) * foreseen < SETTLED and share < 1.0:
            continue
        there = np.clip(np.concatenate((here.values, here.session)) + share * move, *bounds)
        x, s = there[:k], there[k:]
        own = tuple(
            point.offsets + share * together * (d - point.offsets)
            for point, d in zip(here.points, ahead, strict=True)
        )
        points = linearise_at(evidence, parts, x, s, own)
        if _compute_total_misfit(points, prior, s) < here.misfit:
            if not together:
                points = move_linearisation_points(evidence, parts, x, s, points)
            return _State(values=x, session=s, points=points, misfit=_compute_total_misfit(points, prior, s))
        if foreseen < 0.1:
            break
    return None


def _differentiate_runs(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
    steps: NDArray[np.float64],
) -> list[Slopes]:
    """Return the derivatives of every run by parameters and session, and their projection on its nuisances.

    They are taken at the same point as those of the nuisances, with the same offsets of the run. On a road feature that
    the vehicle reaches a moment later, derivatives about other offsets cannot be projected on the nuisances, and the
    information would come out many times too large.
    """
    slopes = []
    there = compose_parameters(parts, x, s)
    moved = [
        compose_parameters(parts, x + step * unit, s)
        for step, unit in zip(steps, np.eye(len(x)), strict=True)
    ]
    for run in evidence:
        if not moved:
            slopes.append((run.session, run.session_q))
            continue
        r = run.compute_residual(*there, run.origin)
        a = [
            (r - run.compute_residual(*far, run.origin)) / step
            for far, step in zip(moved, steps, strict=True)
        ]
        columns = np.column_stack((*a, run.session))
        slopes.append(
            (columns, np.column_stack((run.project_on_nuisances(columns[:, : len(x)]), run.session_q)))
        )
    return slopes


def _compute_gauss_newton_step(
    normal: NDArray[np.float64],
    right: NDArray[np.float64],
    x: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the Gauss-Newton step of parameters and session, float64 [K], without those that press against a bound."""
    k = len(x)
    free = np.ones(len(right), dtype=bool)
    move = np.zeros(len(right))
    for _ in range(k + 1):
        move = np.zeros(len(right))
        block = normal[np.ix_(free, free)]
        move[free] = np.linalg.solve(block + 1e-12 * np.diag(np.diag(block) + 1e-30), right[free])
        outside = (x + move[:k] < lower) & (x <= lower) | (x + move[:k] > upper) & (x >= upper)
        if not np.any(outside & free[:k]):
            break
        free[:k] &= ~outside
    return move


def _compute_total_misfit(
    points: tuple[LinearisedRun, ...], prior: NDArray[np.float64], session: NDArray[np.float64]
) -> float:
    """Return the misfit of all runs and of the session's prior [1]."""
    return float(collect_misfits(points).sum() + np.sum(prior * session**2))
