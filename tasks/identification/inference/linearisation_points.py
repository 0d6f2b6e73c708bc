"""Linearisation points: each run is linearised about its own offsets, which move with the parameters."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.evidence import RunEvidence
from tasks.identification.inference.hypothesis import Hypothesis, compose_parameters
from tasks.vehicle.effects.slots import Slot

SETTLING = 4
"""Number of moves of a run's linearisation point before its misfit is taken."""
SLACK = 1.0
"""Rise of a run's misfit that counts as rounding when its linearisation point moves."""
MISFIT_SETTLED = 0.05
"""Change of a run's misfit by a full move of its linearisation point below which the point is final."""


@dataclass(frozen=True, kw_only=True)
class LinearisedRun:
    """A run at given parameters, linearised about its own offsets.

    Parameters
    ----------
    offsets : float64 [D] offsets about which it is linearised
    residual : float64 [M] whitened residual of the simulation with these offsets
    projected : float64 [D] projection of the residual, with the offsets added, on the nuisances
    misfit : marginalised misfit [1]
    linearisation_error : change of the misfit by the last full move of the offsets; 0 where the linearisation holds [1]
    """

    offsets: NDArray[np.float64]
    residual: NDArray[np.float64]
    projected: NDArray[np.float64]
    misfit: float
    linearisation_error: float = np.inf


def linearise_runs(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
) -> tuple[LinearisedRun, ...]:
    """Return every run linearised about its posterior, from offsets of 0.

    Parameters
    ----------
    evidence : the runs
    parts : hypotheses, in the order of the parameters
    x : float64 [K] their parameters
    s : float64 [8] session nuisances
    """
    points = linearise_at(evidence, parts, x, s, (None,) * len(evidence))
    for _ in range(SETTLING):
        points = move_linearisation_points(evidence, parts, x, s, points)
    return points


def move_linearisation_points(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
    points: tuple[LinearisedRun, ...],
) -> tuple[LinearisedRun, ...]:
    """Move every run's linearisation point towards its posterior, as far as the misfit does not rise.

    Parameters
    ----------
    evidence : the runs
    parts : hypotheses, in the order of the parameters
    x : float64 [K] their parameters
    s : float64 [8] session nuisances
    points : the points before the move
    """
    theta, slots = compose_parameters(parts, x, s)
    after = list(points)
    for i, (run, point) in enumerate(zip(evidence, points, strict=True)):
        if point.linearisation_error < MISFIT_SETTLED:
            continue
        move = run.estimate_offsets(point.projected) - point.offsets
        linearisation_error = np.inf
        for share in (1.0, 0.4):
            trial = _linearise_run(run, theta, slots, point.offsets + share * move)
            if share == 1.0:
                linearisation_error = abs(trial.misfit - point.misfit)
            after[i] = replace(point, linearisation_error=linearisation_error)
            if trial.misfit <= point.misfit + SLACK:
                after[i] = replace(trial, linearisation_error=linearisation_error)
                break
    return tuple(after)


def linearise_at(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
    offsets: tuple[NDArray[np.float64] | None, ...],
) -> tuple[LinearisedRun, ...]:
    """Return every run linearised about given offsets.

    Parameters
    ----------
    evidence : the runs
    parts : hypotheses, in the order of the parameters
    x : float64 [K] their parameters
    s : float64 [8] session nuisances
    offsets : float64 [D] of each run; None is 0 everywhere
    """
    theta, slots = compose_parameters(parts, x, s)
    return tuple(_linearise_run(run, theta, slots, d) for run, d in zip(evidence, offsets, strict=True))


def _linearise_run(
    run: RunEvidence, theta: NDArray[np.float64], slots: tuple[Slot, ...], offsets: NDArray[np.float64] | None
) -> LinearisedRun:
    """Return one run linearised about given offsets.

    Their linear part N d is not added to the residual r: |r + N d|^2 = |r|^2 + (2 N'r + N'N d)'d needs N once.
    """
    residual = run.compute_residual(theta, slots, offsets)
    along = run.nuisance.T @ residual
    misfit = float(residual @ residual)
    if offsets is None:
        offsets = np.zeros(len(along))
    else:
        added = run.information @ offsets
        misfit += float((2.0 * along + added) @ offsets)
        along += added
    projected = run.project_product(along)
    return LinearisedRun(
        offsets=offsets, residual=residual, projected=projected, misfit=misfit - float(projected @ projected)
    )


def collect_misfits(points: tuple[LinearisedRun, ...]) -> NDArray[np.float64]:
    """Return the marginalised misfit of each run, float64 [R]."""
    return np.array([point.misfit for point in points])
