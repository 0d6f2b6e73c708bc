"""Discrepancy: a channel weighs less in a run in which the model misses it by more than its sensor's noise.

An anti-lock brake cycles, a bus drops samples: such misfit belongs to one channel of some runs. Within the noise of the
whole campaign it drowns what the other runs show (model discrepancy, Kennedy and O'Hagan 2001,
doi:10.1111/1467-9868.00294).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.evidence import Evidence, RunEvidence, set_disturbance_prior
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.linearisation_points import LinearisedRun, linearise_at
from tasks.identification.inference.noise import (
    correlate_with_next,
    rewhiten_channels,
    unwhiten_channels,
    whiten_channels,
)

MOST_CORRELATION = 0.98
"""Correlation from sample to sample beyond which more is not distinguished: 99 samples then count as one [1]."""


@dataclass(frozen=True, kw_only=True)
class RunNoise:
    """Noise of one run's channels.

    Parameters
    ----------
    rho, sigma : float64 [7] AR(1) coefficient [1] and standard deviation [unit of the channel]
    """

    rho: NDArray[np.float64]
    sigma: NDArray[np.float64]


def estimate_run_noise(evidence: Evidence, at: Fit) -> dict[str, RunNoise]:
    """Return by run the noise of each channel: its sensor's, or what a fit and its disturbances leave over.

    Parameters
    ----------
    evidence : the runs
    at : fit whose leftover is taken
    """
    points = linearise_at(evidence.train, at.parts, at.values, at.session, at.offsets)
    return {
        run.model.run.name: _estimate_noise(run, point, evidence)
        for run, point in zip(evidence.train, points, strict=True)
    }


def set_run_noise(evidence: Evidence, noise: Mapping[str, RunNoise]) -> Evidence:
    """Return the runs under other noise.

    Parameters
    ----------
    evidence : the runs
    noise : by name of the run
    """

    def rewhiten(run: RunEvidence) -> RunEvidence:
        own = noise[run.model.run.name]
        if np.array_equal(own.rho, run.rho) and np.array_equal(own.sigma, run.sigma):
            return run
        nuisance, session, library, others = (
            rewhiten_channels(columns, (run.rho, run.sigma), (own.rho, own.sigma), run.model.sampled)
            for columns in (run.nuisance, run.session, run.library, run.others)
        )
        changed = replace(
            run, rho=own.rho, sigma=own.sigma, nuisance=nuisance, session=session, library=library, others=others,
            information=nuisance.T @ nuisance,
        )  # fmt: skip
        return set_disturbance_prior(changed, evidence.tolerances, evidence.disturbance)

    return replace(evidence, train=tuple(rewhiten(run) for run in evidence.train))


def _estimate_noise(run: RunEvidence, point: LinearisedRun, evidence: Evidence) -> RunNoise:
    """Return the noise that a run's leftover asks for, which is nowhere below its sensors'."""
    left = run.add_offsets(point.residual, point.offsets - run.estimate_offsets(point.projected))
    error = unwhiten_channels(left, run.rho, run.sigma, run.model.sampled)
    white = whiten_channels(error, *evidence.sensors, run.model.sampled).reshape(error.shape)
    rho, sigma = evidence.sensors[0].copy(), evidence.sensors[1].copy()
    for c in np.flatnonzero(np.isfinite(sigma)):
        own = slice(None) if run.model.sampled is None else run.model.sampled[:, c]
        if float(np.mean(white[own, c] ** 2)) > evidence.rules.discrepancy_limit:
            e = error[own, c]
            rho[c] = max(correlate_with_next(e, MOST_CORRELATION), rho[c])
            sigma[c] = max(float(np.sqrt(np.mean(e**2))), sigma[c])
    return RunNoise(rho=rho, sigma=sigma)
