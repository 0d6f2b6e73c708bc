"""Runs as evidence: derivatives by effects and nuisances, with offsets and disturbances marginalised linearly.

residual = A theta + S session + J d + noise, with d the run's own offsets and disturbances under a Gaussian
prior. Integrating d out leaves inner products x' L y with L = I - J (J'J + P)^-1 J' (Woodbury), which are one small
Gram matrix per run: the evidence of any set of columns follows from their sum.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky
from scipy.linalg.lapack import dtrtrs

from tasks.campaign.campaign import CHANNELS, FILE_NUMBERS, Tolerances
from tasks.identification.inference.disturbance import (
    ACCELERATION_BIAS,
    DISTURBED,
    FRICTION,
    INITIAL_SPEED,
    KNOT_SPACING,
    N_OFFSETS,
    PITCH_OFFSET,
    Disturbance,
    compute_prior_precision,
)
from tasks.identification.inference.forward import (
    SENSED,
    RunModel,
    compute_instrument_readings,
    compute_starting_speed,
    predict_channels,
    simulate_run,
)
from tasks.identification.inference.noise import whiten_channels
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import PARAMETER_INDEX

SESSION_INDEX = tuple(PARAMETER_INDEX[name] for name in FILE_NUMBERS)
DIVERGED = 1e6
"""Reading beyond which a simulation diverges, in the unit of any channel."""
BROKEN = 1e4
"""Whitened residual of a trial whose simulation diverges, so large that no fit accepts the trial."""


@dataclass(frozen=True, kw_only=True)
class RunEvidence:
    """Whitened derivatives of one run about a linearisation point.

    Parameters
    ----------
    model : the run
    rho, sigma : float64 [7] AR(1) coefficient and standard deviation of the channels' noise [1, unit of the channel]
    nuisance : float64 [M, D] derivatives by the run's offsets and disturbance knots
    knots : number of knots at each disturbed port
    information : float64 [D, D] nuisance' nuisance
    session : float64 [M, 7] derivatives by the session's nuisances
    library : float64 [M, E] derivatives by the first parameter of every library effect
    others : float64 [M, X] the same with the second parameter at `list_second_values`
    factor : Cholesky factor (lower) of information + prior precision
    session_q : float64 [D, 7] factor^-1 nuisance' session
    origin : float64 [D] the run's offsets about which the derivatives are taken; None for 0
    """

    model: RunModel
    rho: NDArray[np.float64]
    sigma: NDArray[np.float64]
    nuisance: NDArray[np.float64]
    knots: tuple[int, ...]
    information: NDArray[np.float64]
    session: NDArray[np.float64]
    library: NDArray[np.float64]
    others: NDArray[np.float64]
    factor: NDArray[np.float64]
    session_q: NDArray[np.float64]
    origin: NDArray[np.float64] | None = None

    def compute_residual(
        self,
        theta: NDArray[np.float64],
        slots: tuple[Slot, ...] = (),
        offsets: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """Return the whitened residual, measured less model, at ``theta`` (full vector), float64 [M].

        With ``offsets`` the model is simulated with this run's own offsets and disturbances. Less their linear part,
        which `add_offsets` adds again, this is to first order the same residual, but it is also correct where the run
        is not linear in them, as on a road feature that the vehicle reaches a moment later.

        Parameters
        ----------
        theta : float64 [len(EFFECT_TABLE)] all parameters [units of the table]
        slots : forms
        offsets : float64 [D] the run's offsets and disturbance knots; None for 0
        """
        if offsets is None:
            y = predict_channels(self.model, theta, slots=slots)
            if not np.abs(y).max() < DIVERGED:
                return np.full(len(self.nuisance), BROKEN)
            return whiten_channels(self.model.measured - y, self.rho, self.sigma, self.model.sampled)
        moved, slots = move_by_offsets(theta, slots, offsets, self.knots)
        speed = compute_starting_speed(self.model, theta) + offsets[INITIAL_SPEED]
        simulated = simulate_run(self.model, moved, slots=slots, initial_speed=speed)
        y = compute_instrument_readings(self.model, moved, simulated.history[:, SENSED])
        if not np.abs(y).max() < DIVERGED:
            return np.full(len(self.nuisance), BROKEN)
        y[:, CHANNELS.index("longitudinal_acceleration")] += offsets[ACCELERATION_BIAS]
        y[:, CHANNELS.index("pitch")] += offsets[PITCH_OFFSET]
        return whiten_channels(self.model.measured - y, self.rho, self.sigma, self.model.sampled)

    def apply_offsets(
        self, theta: NDArray[np.float64], slots: tuple[Slot, ...], offsets: NDArray[np.float64]
    ) -> tuple[RunModel, NDArray[np.float64], tuple[Slot, ...]]:
        """Return the run, the parameters and the forms that have its own offsets in them.

        Parameters
        ----------
        theta : float64 [len(EFFECT_TABLE)] all parameters [units of the table]
        slots : forms
        offsets : float64 [D] the run's offsets and disturbance knots
        """
        faster = offsets[INITIAL_SPEED] * (1.0 + float(theta[PARAMETER_INDEX["speed_scale"]]))
        model = replace(self.model, initial_speed=self.model.initial_speed + faster)
        return model, *move_by_offsets(theta, slots, offsets, self.knots)

    def add_offsets(self, residual: NDArray[np.float64], offsets: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a residual with the linear part of the run's own offsets and disturbances, float64 [M].

        Parameters
        ----------
        residual : float64 [M] of a simulation with these offsets
        offsets : float64 [D]
        """
        return residual + self.nuisance @ offsets

    def estimate_offsets(self, projected: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the posterior mean of the run's offsets and disturbance knots, float64 [D].

        Parameters
        ----------
        projected : float64 [D] a residual's `project_on_nuisances`
        """
        return np.asarray(dtrtrs(self.factor, projected, lower=1, trans=1)[0])

    def project_on_nuisances(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return factor^-1 nuisance' x, the part of x that the nuisances can explain, float64 [D] or [D, P].

        Parameters
        ----------
        x : float64 [M] or [M, P] whitened residuals or derivatives
        """
        return self.project_product(self.nuisance.T @ x)

    def project_product(self, product: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return factor^-1 nuisance' x from nuisance' x, float64 [D] or [D, P].

        Parameters
        ----------
        product : float64 [D] or [D, P] nuisance' x
        """
        return np.asarray(dtrtrs(self.factor, product, lower=1)[0])


def move_by_offsets(
    theta: NDArray[np.float64], slots: tuple[Slot, ...], offsets: NDArray[np.float64], knots: tuple[int, ...]
) -> tuple[NDArray[np.float64], tuple[Slot, ...]]:
    """Return parameters and forms of a run with its own friction and disturbances.

    Parameters
    ----------
    theta : float64 [len(EFFECT_TABLE)] parameters without them [units of the table]
    slots : forms without them
    offsets : float64 [D] the run's offsets and disturbance knots
    knots : number of knots at each disturbed port
    """
    moved = theta.copy()
    moved[PARAMETER_INDEX["friction"]] += offsets[FRICTION]
    at = N_OFFSETS
    for port, count, spacing in zip(DISTURBED, knots, KNOT_SPACING, strict=True):
        own = Slot(port=port, variable="time", origin=0.0, spacing=spacing, values=offsets[at : at + count])
        slots = (*slots, own)
        at += count
    return moved, slots


def set_disturbance_prior(
    evidence: RunEvidence, tolerances: Tolerances, disturbance: Disturbance
) -> RunEvidence:
    """Return the same run under another prior of the disturbances.

    Parameters
    ----------
    evidence : the run
    tolerances, disturbance : prior of its offsets and disturbances
    """
    precision = compute_prior_precision(evidence.knots, tolerances, disturbance)[0]
    factor = cholesky(evidence.information + precision, lower=True, check_finite=False)
    changed = replace(evidence, factor=factor)
    return replace(changed, session_q=changed.project_on_nuisances(changed.session))


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
