"""What no effect can follow: a channel of a run that the model misses beyond its sensor's noise weighs less.

An anti-lock brake cycles, a bus drops samples: such misfit belongs to one channel of some runs. Within the noise of the
whole campaign it drowns what the other runs show (model discrepancy, Kennedy and O'Hagan 2001,
doi:10.1111/1467-9868.00294).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.evidence import RunEvidence, set_disturbance_prior
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.linearisation_points import LinearisedRun, linearise_at, linearise_runs
from tasks.identification.inference.noise import unwhiten_channels, whiten_channels

LONGEST_MEMORY = 0.98
"""Correlation from sample to sample beyond which more is not told apart [1]."""


def widen_noise(evidence: Evidence, at: Fit) -> Evidence:
    """Return the runs with the noise of each channel as wide as what a fit and its disturbances leave over.

    Held-out runs too: their noise is read at the same fit, and is the same for every explanation.

    Parameters
    ----------
    evidence : the runs
    at : fit whose leftover is taken
    """
    train = linearise_at(evidence.train, at.parts, at.values, at.session, at.offsets)
    held_out = linearise_runs(evidence.held_out, at.parts, at.values, at.session)

    def widened(run: RunEvidence, point: LinearisedRun) -> RunEvidence:
        fresh = _widened(run, point, evidence.sensors, evidence.rules.discrepancy_limit)
        return set_disturbance_prior(fresh, evidence.tolerances, evidence.disturbance)

    return replace(
        evidence,
        train=tuple(widened(*pair) for pair in zip(evidence.train, train, strict=True)),
        held_out=tuple(widened(*pair) for pair in zip(evidence.held_out, held_out, strict=True)),
    )


def _widened(
    run: RunEvidence,
    point: LinearisedRun,
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    limit: float,
) -> RunEvidence:
    """Return a run under the noise that its leftover asks for, which is nowhere below its sensors'."""
    left = point.residual - run.nuisance @ run.estimate_offsets(point.projected)
    error = unwhiten_channels(left, run.rho, run.sigma)
    white = whiten_channels(error, *sensors).reshape(error.shape)
    rho, sigma = sensors[0].copy(), sensors[1].copy()
    for c in np.flatnonzero(np.isfinite(sensors[1])):
        if float(np.mean(white[:, c] ** 2)) > limit:
            e = error[:, c]
            power = float(e @ e)
            rho[c] = min(max(float(e[1:] @ e[:-1]) / power, rho[c]), LONGEST_MEMORY)
            sigma[c] = max(float(np.sqrt(power / len(e))), sigma[c])
    nuisance, session, library, others = (
        whiten_channels(unwhiten_channels(columns, run.rho, run.sigma), rho, sigma)
        for columns in (run.nuisance, run.session, run.library, run.others)
    )
    return replace(
        run, rho=rho, sigma=sigma, nuisance=nuisance, session=session, library=library, others=others,
        information=nuisance.T @ nuisance,
    )  # fmt: skip
