"""How well the runs tell each number of a joint fit: by what their misfit remembers, and by how they scatter."""

from collections.abc import Sequence
from math import exp

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded
from scipy.special import stdtrit

from tasks.identification.inference.noise import correlate_with_next
from tasks.identification.inference.quantiles import NORMAL_QUANTILE, compute_student_quantile
from tasks.identification.joint.fit import JointFit
from tasks.identification.rules import JointRules


def compute_standard_errors(fitted: JointFit, rules: JointRules) -> NDArray[np.float64]:
    """Return the standard error of each number, float64 [K] [unit of the table].

    The curvature with the misfit of the run that is followed worst counts; from `fewest_scatter_runs` runs on the
    jackknife over runs too, linear about the fit (Efron 1982, doi:10.1137/1.9781611970319). Misfit of a model
    remembers, which the scatter of runs holds and the curvature does not: of few runs the quantile stands for it.

    Parameters
    ----------
    fitted : the fit
    rules : of the joint fit
    """
    runs = len(fitted.residuals)
    error = np.sqrt(np.diag(np.linalg.inv(fitted.information)) * measure_worst_misfit(fitted.residuals))
    if runs < rules.fewest_scatter_runs:
        return np.asarray(error)
    pairs = list(zip(fitted.residuals, fitted.slopes, strict=True))
    shares = [(slope.T * _weigh_curvature(residual)) @ slope for residual, slope in pairs]
    whole = np.diag([1.0 / n.sigma**2 for n in fitted.numbers]) + sum(shares)
    moves = [
        np.linalg.solve(whole - share, slope.T @ weigh_robustly(residual))
        for share, (residual, slope) in zip(shares, pairs, strict=True)
    ]
    spread = np.array(moves) - np.mean(moves, axis=0)
    return np.maximum(error, np.sqrt((runs - 1) / runs * np.sum(spread**2, axis=0)))


def measure_worst_misfit(residuals: Sequence[NDArray[np.float64]]) -> float:
    """Return the mean square of the weighted misfit of the run that is followed worst, at least 1 [1].

    Parameters
    ----------
    residuals : weighted, one float64 [M] a run
    """
    return max(1.0, *(float(np.mean(residual**2)) for residual in residuals))


def _weigh_curvature(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the curvature of the robust loss at residuals, over that of squares, float64 [M] [1]."""
    return (1.0 + residual**2) ** -1.5


def compute_interval_reach(fitted: JointFit, rules: JointRules) -> NDArray[np.float64]:
    """Return how far the ends of a 95 % interval are from each number, float64 [K] [unit of the table].

    That is Student's t with the runs less one, at least one. Fewer than `fewest_scatter_runs` runs do not tell how they
    scatter: there the misfit counts as what remembers, if that is more (the sandwich of White 1980,
    doi:10.2307/1912934). A delay is no surer than when the driver lifts.

    Parameters
    ----------
    fitted : the fit
    rules : of the joint fit
    """
    runs = len(fitted.residuals)
    reach = compute_student_quantile(runs) * compute_standard_errors(fitted, rules)
    if runs < rules.fewest_scatter_runs:
        reach = np.maximum(reach, NORMAL_QUANTILE * _measure_what_remembers(fitted, rules))
    return np.hypot(reach, NORMAL_QUANTILE * _collect_doubts(fitted))


def compute_told_errors(fitted: JointFit, rules: JointRules) -> NDArray[np.float64]:
    """Return the standard errors that a verdict tells, with what no run can tell, float64 [K] [unit of the table].

    Parameters
    ----------
    fitted : the fit
    rules : of the joint fit
    """
    return np.hypot(compute_standard_errors(fitted, rules), _collect_doubts(fitted))


def _collect_doubts(fitted: JointFit) -> NDArray[np.float64]:
    """Return the standard deviation of each number that no run lowers, float64 [K] [unit of the table]."""
    return np.array([fitted.delay_doubt if n.group == "delay" else 0.0 for n in fitted.numbers])


def _measure_what_remembers(fitted: JointFit, rules: JointRules) -> NDArray[np.float64]:
    """Return the standard errors by a misfit that is correlated from sample to sample, float64 [K]."""
    score = np.diag([1.0 / n.sigma**2 for n in fitted.numbers])
    for residual, slope, grid in zip(fitted.residuals, fitted.slopes, fitted.grids, strict=True):
        score = score + _compute_score_covariance(residual, slope, grid, fitted.interval, rules)
    inverse = np.linalg.inv(fitted.information)
    return np.asarray(np.sqrt(np.diag(inverse @ score @ inverse)))


def _compute_score_covariance(
    residual: NDArray[np.float64],
    slope: NDArray[np.float64],
    grid: NDArray[np.bool_],
    interval: float,
    rules: JointRules,
) -> NDArray[np.float64]:
    """Return the covariance of the gradient of a run, float64 [K, K].

    The misfit of a channel is first-order autoregressive, and that of two channels is correlated at one instant: a
    model that misses the speed misses the wheels at the same time.
    """
    left, columns = np.zeros(grid.shape), np.zeros((*grid.shape, slope.shape[1]))
    left[grid], columns[grid] = residual, slope
    for c in range(grid.shape[1]):
        rows = np.flatnonzero(grid[:, c])
        apart = float(np.median(np.diff(rows))) if len(rows) > 1 else 1.0
        most = exp(-apart * interval / rules.longest_memory)
        kept = correlate_with_next(left[rows, c], most) ** (1.0 / apart)
        # the transpose of the filter that makes such misfit of white noise: each row and what is kept of those after it
        after = np.vstack((np.full(len(grid), -kept), np.ones(len(grid))))
        sums = solve_banded((0, 1), after, columns[:, c])
        sums[1:] *= np.sqrt(1.0 - kept**2)
        columns[:, c] = sums
    common = np.maximum(grid.T.astype(np.float64) @ grid, 1.0)
    return np.asarray(np.einsum("cd,nck,ndl->kl", left.T @ left / common, columns, columns, optimize=True))


def weigh_robustly(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return residuals with the weight that the robust loss gives them.

    Parameters
    ----------
    residual : float64 [M] weighted
    """
    return residual / np.sqrt(1.0 + residual**2)


def compute_naming_distance(runs: int, rules: JointRules) -> float:
    """Return the standard errors from 0 from which a number is named: Student's t, for few runs tell their scatter ill.

    Parameters
    ----------
    runs : of the fit
    rules : of the joint fit
    """
    return float(stdtrit(max(runs, rules.fewest_scatter_runs) - 1, 1.0 - rules.false_name_chance))


def measure_certainty(fitted: JointFit, rules: JointRules) -> NDArray[np.float64]:
    """Return how far each number is from the vehicle file's, over how far a name must be, float64 [K] [1].

    That is the chance of a false name, and never less than what a 95 % interval holds.

    Parameters
    ----------
    fitted : the fit
    rules : of the joint fit
    """
    needed = compute_naming_distance(len(fitted.residuals), rules) * compute_standard_errors(fitted, rules)
    return np.asarray(np.abs(fitted.values) / np.maximum(needed, compute_interval_reach(fitted, rules)))
