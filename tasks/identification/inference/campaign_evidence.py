"""A campaign as evidence: its runs, differentiated by the library, and the priors of all nuisances."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import Tolerances
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.evidence import RunEvidence
from tasks.identification.inference.forward import RunModel
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.library import Effect


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Training runs with the library by which they were differentiated, and held-out runs.

    Parameters
    ----------
    train : training runs
    held_out : held-out runs, which no fit and no choice reads
    effects : library of effects
    tolerances, disturbance : priors of session, offsets and disturbances
    sensors : AR(1) coefficient and standard deviation of every channel's sensor, float64 [7] each
    rules : decision rules
    step_sensitive : names of runs left out because halving the integration step changes their prediction
    """

    train: tuple[RunEvidence, ...]
    held_out: tuple[RunModel, ...]
    effects: tuple[Effect, ...]
    tolerances: Tolerances
    disturbance: Disturbance
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]]
    rules: DecisionRules
    step_sensitive: tuple[str, ...] = ()

    @property
    def session_sigma(self) -> NDArray[np.float64]:
        """Return the prior sigmas of the session, float64 [8]."""
        return np.array(self.tolerances.file_numbers)
