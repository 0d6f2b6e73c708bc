"""Where each run is linearised: about its own offsets, which move as the parameters do."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.evidence import RunEvidence
from tasks.identification.inference.hypothesis import Hypothesis, compose
from tasks.vehicle.effects.slots import Slot

SETTLING = 4
"""Moves of a run's point of linearisation before its misfit is taken."""
SLACK = 1.0
"""Rise of a run's misfit that is taken for rounding when its point of linearisation moves."""
SETTLED = 0.05
"""Change of a run's misfit by a full move of its point of linearisation below which it is moved no further."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """A run at some parameters, linearised about its own offsets.

    Parameters
    ----------
    offsets : float64 [D] about which it is linearised
    residual : float64 [M] whitened
    projected : float64 [D] what the nuisances can take from it
    misfit : marginalised
    doubt : by how much the last full move of the offsets changed the misfit: 0 where the linearisation holds
    """

    offsets: NDArray[np.float64]
    residual: NDArray[np.float64]
    projected: NDArray[np.float64]
    misfit: float
    doubt: float = np.inf


def settled(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
) -> tuple[Place, ...]:
    """Every run linearised about its posterior, from offsets of 0.

    Parameters
    ----------
    evidence : the runs
    parts : hypotheses, in the order of the parameters
    x : float64 [K] their parameters
    s : float64 [7] session nuisances
    """
    places = places_at(evidence, parts, x, s, (None,) * len(evidence))
    for _ in range(SETTLING):
        places = relinearised(evidence, parts, x, s, places)
    return places


def relinearised(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
    places: tuple[Place, ...],
) -> tuple[Place, ...]:
    """Move every run's point of linearisation towards its posterior, as far as the run does not fit worse.

    Parameters
    ----------
    evidence : the runs
    parts : hypotheses, in the order of the parameters
    x : float64 [K] their parameters
    s : float64 [7] session nuisances
    places : where they are
    """
    theta, slots = compose(parts, x, s)
    after = list(places)
    for i, (run, place) in enumerate(zip(evidence, places, strict=True)):
        if place.doubt < SETTLED:
            continue
        move = run.offsets(place.projected) - place.offsets
        doubt = np.inf
        for share in (1.0, 0.4):
            trial = _place(run, theta, slots, place.offsets + share * move)
            if share == 1.0:
                doubt = abs(trial.misfit - place.misfit)
            after[i] = replace(place, doubt=doubt)
            if trial.misfit <= place.misfit + SLACK:
                after[i] = replace(trial, doubt=doubt)
                break
    return tuple(after)


def places_at(
    evidence: tuple[RunEvidence, ...],
    parts: tuple[Hypothesis, ...],
    x: NDArray[np.float64],
    s: NDArray[np.float64],
    offsets: tuple[NDArray[np.float64] | None, ...],
) -> tuple[Place, ...]:
    """Every run linearised about given offsets.

    Parameters
    ----------
    evidence : the runs
    parts : hypotheses, in the order of the parameters
    x : float64 [K] their parameters
    s : float64 [7] session nuisances
    offsets : float64 [D] of each run; None is 0 everywhere
    """
    theta, slots = compose(parts, x, s)
    return tuple(_place(run, theta, slots, d) for run, d in zip(evidence, offsets, strict=True))


def _place(
    run: RunEvidence, theta: NDArray[np.float64], slots: tuple[Slot, ...], offsets: NDArray[np.float64] | None
) -> Place:
    residual = run.residual(theta, slots, offsets)
    projected = run.project(residual)
    return Place(
        offsets=np.zeros(run.nuisance.shape[1]) if offsets is None else offsets, residual=residual,
        projected=projected, misfit=float(residual @ residual - projected @ projected),
    )  # fmt: skip


def misfits(places: tuple[Place, ...]) -> NDArray[np.float64]:
    """Marginalised misfit of each run, float64 [R]."""
    return np.array([place.misfit for place in places])
