"""A campaign as evidence: its runs, differentiated by the library, with the priors of all that is not sought."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import Tolerances
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.evidence import RunEvidence
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.library import Effect


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Training and held-out runs with the library they were differentiated by.

    Parameters
    ----------
    train, held_out : runs
    effects : the library
    tolerances, disturbance : priors of session, offsets and disturbances
    sensors : AR(1) coefficient and standard deviation of every channel's sensor, float64 [7] each
    rules : by which a verdict is reached
    forked : names of the runs that fork when the integration step is halved, and are left out
    """

    train: tuple[RunEvidence, ...]
    held_out: tuple[RunEvidence, ...]
    effects: tuple[Effect, ...]
    tolerances: Tolerances
    disturbance: Disturbance
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]]
    rules: DecisionRules
    forked: tuple[str, ...] = ()

    @property
    def session_sigma(self) -> NDArray[np.float64]:
        """Prior sigmas of the session, float64 [7]."""
        return np.array(self.tolerances.session)

    @property
    def samples(self) -> int:
        """Number of measured training values, N of the score."""
        return sum(run.model.samples * int(np.isfinite(run.sigma).sum()) for run in self.train)
