"""Evidence of a linear Gaussian model whose columns may differ from run to run, in compiled loops.

The matrices are small and there are thousands of them: in single calls of NumPy they cost three times as much.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

FEWEST = 3
"""Runs that must inform a direction for their scatter to say something [1]."""
INFORMED = 1e-6
"""Share of the best informed run's information from which a run informs a direction [1]."""


class Prior(NamedTuple):
    """Columns of a model with the inverse variances and means of their priors: int64 or float64 [K] each."""

    columns: NDArray[np.int64]
    precision: NDArray[np.float64]
    centre: NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def weigh_columns(
    runs: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    prior: Prior,
    nobody: Prior,
    own: NDArray[np.int64],
    begins: NDArray[np.int64],
    spread: bool,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float, float]:
    """Return what the runs say about an explanation, without and with what differs from run to run.

    Parameters
    ----------
    runs : information and score of every run, and of all runs
    prior : of the columns of an explanation
    nobody : of the columns of the explanation without a member
    own : int64 [N] places of the members' numbers among the columns
    begins : int64 [D + 1] where each member's own begin, and their end
    spread : count what differs from run to run

    Returns
    -------
    Mean of every column without spread, float64 [K]; values and errors of the members' numbers, float64 [N]; spreads
    of the members, float64 [D]; log evidence without spread, and gain with it, NaN where nothing differs.
    """
    information, score, all_information, all_score = runs
    columns, k, members, count = prior.columns, len(prior.columns), len(begins) - 1, len(score)
    total, right = np.empty((k, k)), np.empty(k)
    for i in range(k):
        right[i] = all_score[columns[i]]
        for j in range(k):
            total[i, j] = all_information[columns[i], columns[j]]
    mean, factor, evidence = integrate_columns(total, right, prior)
    plain, spreads, gain = np.empty(k), np.zeros(members), np.nan
    for i in range(k):
        plain[i] = mean[i] + prior.centre[i]
    if spread and members:
        # of every run its information and, last, its score along each member's values
        along, size, pull = np.zeros((members, count, k + 1)), np.empty(count), np.empty(count)
        for m in range(members):
            for r in range(count):
                for i in own[begins[m] : begins[m + 1]]:
                    for j in range(k):
                        along[m, r, j] += plain[i] * information[r, columns[i], columns[j]]
                    along[m, r, k] += plain[i] * score[r, columns[i]]
                size[r], pull[r] = 0.0, along[m, r, k]
                for i in own[begins[m] : begins[m + 1]]:
                    size[r] += plain[i] * along[m, r, i]
                for j in range(k):
                    pull[r] -= along[m, r, j] * mean[j]
            spreads[m] = np.sqrt(estimate_spread(size, pull))
        if spreads.max() > 0.0:
            _admit_spread(total, right, along, spreads, plain, own, begins)
            mean, factor, evidence_with = integrate_columns(total, right, prior)
            gain = evidence_with - integrate_columns(total, right, nobody)[2]
    values, errors, unit = np.empty(len(own)), np.zeros(len(own)), np.empty(k)
    for n in range(len(own)):
        values[n] = mean[own[n]] + prior.centre[own[n]]
        unit[:] = 0.0
        unit[own[n]] = 1.0
        _solve_lower(factor, unit)
        for i in range(k):
            errors[n] += unit[i] * unit[i]
        errors[n] = np.sqrt(errors[n])
    return plain, values, errors, spreads, evidence, gain


@njit(cache=True, nogil=True, error_model="numpy")
def integrate_columns(
    information: NDArray[np.float64], score: NDArray[np.float64], prior: Prior
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return mean about the linearisation point, Cholesky factor of the precision (upper), and log evidence.

    Parameters
    ----------
    information, score : float64 [K, K] and [K] of all runs; columns beyond those of the prior are left out
    prior : of the columns
    """
    precision, centre = prior.precision, prior.centre
    k = len(precision)
    factor, mean, evidence = np.empty((k, k)), np.empty(k), 0.0
    for i in range(k):
        mean[i] = score[i] - precision[i] * centre[i]
        evidence += 0.5 * (np.log(precision[i]) - precision[i] * centre[i] ** 2)
        for j in range(k):
            factor[i, j] = information[i, j]
        factor[i, i] += precision[i]
    for i in range(k):
        if not factor[i, i] > 0.0:
            raise np.linalg.LinAlgError("the information of the runs must be positive")
        pivot = np.sqrt(factor[i, i])
        evidence -= np.log(pivot)
        for j in range(i, k):
            factor[i, j] /= pivot
        for n in range(i + 1, k):
            for j in range(n, k):
                factor[n, j] -= factor[i, n] * factor[i, j]
    _solve_lower(factor, mean)
    for i in range(k):
        evidence += 0.5 * mean[i] ** 2
    for i in range(k - 1, -1, -1):
        for j in range(i + 1, k):
            mean[i] -= factor[i, j] * mean[j]
        mean[i] /= factor[i, i]
    return mean, factor, evidence


@njit(cache=True, nogil=True, error_model="numpy")
def estimate_spread(size: NDArray[np.float64], pull: NDArray[np.float64]) -> float:
    """Return the variance from run to run of the amplitude of a direction (DerSimonian and Laird) [1].

    Parameters
    ----------
    size : float64 [R] what each run says about an amplitude of one
    pull : float64 [R] its score, so that pull / size is its own estimate
    """
    informed = size > INFORMED * max(float(size.max()), 1e-300)
    if np.count_nonzero(informed) < FEWEST:
        return 0.0
    weight, own = size[informed], pull[informed] / size[informed]
    sum_of_weights = float(weight.sum())
    mean = float(weight @ own) / sum_of_weights
    heterogeneity = float(weight @ (own - mean) ** 2)
    scale = sum_of_weights - float(weight @ weight) / sum_of_weights
    return max(0.0, (heterogeneity - (len(own) - 1)) / scale) if scale > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _admit_spread(
    total: NDArray[np.float64],
    right: NDArray[np.float64],
    along: NDArray[np.float64],
    spreads: NDArray[np.float64],
    values: NDArray[np.float64],
    own: NDArray[np.int64],
    begins: NDArray[np.int64],
) -> None:
    """Integrate out an amplitude of each member in each run: information and score of all runs become less.

    Parameters
    ----------
    total, right : float64 [K, K] and [K] of all runs
    along : float64 [D, R, K + 1] what each run says along each member's values, its score last; changed
    spreads : float64 [D] standard deviations of the amplitudes
    values : float64 [K] of all columns
    own, begins : as `weigh_columns` takes them
    """
    members, count, k = len(spreads), along.shape[1], len(right)
    for m in range(members):
        for r in range(count):
            mine = along[m, r]
            size = 1.0
            for i in own[begins[m] : begins[m + 1]]:
                size += spreads[m] ** 2 * values[i] * mine[i]
            share = spreads[m] ** 2 / size
            for i in range(k):
                right[i] -= share * mine[k] * mine[i]
                for j in range(k):
                    total[i, j] -= share * mine[i] * mine[j]
            for n in range(m + 1, members):
                both = 0.0
                for i in own[begins[n] : begins[n + 1]]:
                    both += values[i] * mine[i]
                for j in range(k + 1):
                    along[n, r, j] -= share * both * mine[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _solve_lower(factor: NDArray[np.float64], x: NDArray[np.float64]) -> None:
    """Solve factor' y = x in place, for an upper triangular factor, float64 [K, K] and [K]."""
    for i in range(len(x)):
        x[i] /= factor[i, i]
        for j in range(i + 1, len(x)):
            x[j] -= factor[i, j] * x[i]
