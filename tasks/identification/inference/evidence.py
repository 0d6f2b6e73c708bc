"""One run as evidence: derivatives by effects and nuisances, with offsets and disturbances marginalised linearly.

residual = A theta + S session + J d + noise, with d the run's own offsets and disturbances under a Gaussian
prior. Integrating d out leaves inner products x' L y with L = I - J (J'J + P)^-1 J' (Woodbury), which are one small
Gram matrix per run. Screening, bootstrap and leave-one-run-out are therefore sums of small matrices.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from tasks.campaign.campaign import CHANNELS, SESSION, Tolerances
from tasks.identification.inference.disturbance import (
    DISTURBED,
    KNOT_SPACING,
    N_OFFSETS,
    Disturbance,
    compute_prior_precision,
)
from tasks.identification.inference.forward import (
    RunModel,
    compute_instrument_readings,
    compute_starting_speed,
    predict_channels,
    simulate_run,
)
from tasks.identification.inference.noise import whiten_channels
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import PARAMETER_INDEX

SESSION_INDEX = tuple(PARAMETER_INDEX[name] for name in SESSION)
BROKEN = 1e4
"""Whitened residual of a trial whose simulation diverges, so large that no fit accepts the trial."""
SECOND_SHARES = (0.3, 0.6)
"""Shares of the range of an effect's second parameter at which the screen tries it, besides its first value."""
KNOT_STEP = (30.0, 0.01, 30.0)


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
    library_q, others_q : float64 [D, E], [D, X] factor^-1 nuisance' library, and others
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
    library_q: NDArray[np.float64]
    others_q: NDArray[np.float64]
    origin: NDArray[np.float64] | None = None

    def compute_residual(
        self,
        theta: NDArray[np.float64],
        slots: tuple[Slot, ...] = (),
        offsets: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """Return the whitened residual, measured less model, at ``theta`` (full vector), float64 [M].

        With ``offsets`` the model is simulated with this run's own offsets and disturbances, and their linear part is
        added again. To first order this is the same residual, but it is also correct where the run is not linear in
        them, as on a road feature that the vehicle reaches a moment later.

        Parameters
        ----------
        theta : float64 [len(EFFECT_TABLE)] all parameters [units of the table]
        slots : forms
        offsets : float64 [D] the run's offsets and disturbance knots; None for 0
        """
        if offsets is None:
            y = predict_channels(self.model, theta, slots=slots)
            if not np.isfinite(y).all():
                return np.full(len(self.nuisance), BROKEN)
            return whiten_channels(self.model.measured - y, self.rho, self.sigma)
        moved, slots = _add_offsets(theta, slots, offsets, self.knots)
        speed = compute_starting_speed(self.model, theta) + offsets[0]
        simulated = simulate_run(self.model, moved, slots=slots, initial_speed=speed)
        y = compute_instrument_readings(self.model, moved, simulated)
        if not np.isfinite(y).all():
            return np.full(len(self.nuisance), BROKEN)
        y[:, CHANNELS.index("longitudinal_acceleration")] += offsets[2]
        y[:, CHANNELS.index("pitch")] += offsets[3]
        return whiten_channels(self.model.measured - y, self.rho, self.sigma) + self.nuisance @ offsets

    def estimate_offsets(self, projected: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the posterior mean of the run's offsets and disturbance knots, float64 [D].

        Parameters
        ----------
        projected : float64 [D] a residual's `project_on_nuisances`
        """
        return solve_triangular(self.factor, projected, lower=True, trans="T", check_finite=False)

    def project_on_nuisances(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return factor^-1 nuisance' x, the part of x that the nuisances can explain, float64 [D] or [D, P].

        Parameters
        ----------
        x : float64 [M] or [M, P] whitened residuals or derivatives
        """
        return solve_triangular(self.factor, self.nuisance.T @ x, lower=True, check_finite=False)


def differentiate_run(
    model: RunModel,
    rho: NDArray[np.float64],
    sigma: NDArray[np.float64],
    base: NDArray[np.float64],
    effects: tuple[Effect, ...],
    tolerances: Tolerances,
    disturbance: Disturbance,
    slots: tuple[Slot, ...] = (),
) -> RunEvidence:
    """Simulate a run and its derivatives about a linearisation point.

    Parameters
    ----------
    model : the run
    rho, sigma : channel noise
    base : float64 [len(EFFECT_TABLE)] parameters at which derivatives are taken
    effects : library of effects; empty for held-out runs
    tolerances : priors of the run's offsets
    disturbance : prior of the disturbances
    slots : forms that belong to that point
    """
    simulated = simulate_run(model, base, slots=slots, keep_states=True)
    y = compute_instrument_readings(model, base, simulated)

    def differentiate(
        theta: NDArray[np.float64], step: float, extra: tuple[Slot, ...] = (), **options: Any
    ) -> NDArray[np.float64]:
        """Return the difference quotient of the readings."""
        moved = simulate_run(model, theta, slots=(*slots, *extra), **options)
        return (compute_instrument_readings(model, theta, moved) - y) / step

    columns = [
        differentiate(base, 0.02, initial_speed=compute_starting_speed(model, base) + 0.02),
        differentiate(_shift_parameter(base, PARAMETER_INDEX["friction"], 0.01), 0.01),
    ]
    for name in ("longitudinal_acceleration", "pitch"):
        offset = np.zeros_like(y)
        offset[:, CHANNELS.index(name)] = 1.0
        columns.append(offset)
    knots = []
    dt = model.run.interval
    for port, spacing, step in zip(DISTURBED, KNOT_SPACING, KNOT_STEP, strict=True):
        count = int(np.ceil(model.samples * dt / spacing)) + 1
        knots.append(count)
        for k in range(count):
            first = min(max(int((k - 1) * spacing / dt), 0), model.samples - 1)
            slot = Slot(
                port=port,
                variable="time",
                origin=(k - 1) * spacing,
                spacing=spacing,
                values=np.array([0.0, step, 0.0]),
            )
            columns.append(differentiate(base, step, (slot,), branch=(first, simulated)))
    session = [
        differentiate(_shift_parameter(base, i, 0.5 * s), 0.5 * s)
        for i, s in zip(SESSION_INDEX, tolerances.session, strict=True)
    ]
    library, others = [], []
    for effect in effects:
        theta = base.copy()
        leading = effect.parameters[0]
        if base[leading.index] == 0.0:
            for parameter in effect.parameters[1:]:
                theta[parameter.index] = parameter.start
        library.append(differentiate(_shift_parameter(theta, leading.index, leading.step), leading.step))
    for place, value in list_second_values(effects):
        leading, second = effects[place].parameters
        theta = base.copy()
        theta[second.index] = value
        # an effect that the model has already is not screened
        there = base[leading.index] != 0.0
        others.append(
            np.zeros_like(y)
            if there
            else differentiate(_shift_parameter(theta, leading.index, leading.step), leading.step)
        )
    library, others = library or [np.zeros_like(y)], others or [np.zeros_like(y)]
    nuisance = whiten_channels(np.stack(columns, axis=-1), rho, sigma)
    evidence = RunEvidence(
        model=model,
        rho=rho,
        sigma=sigma,
        nuisance=nuisance,
        knots=tuple(knots),
        information=nuisance.T @ nuisance,
        session=whiten_channels(np.stack(session, axis=-1), rho, sigma),
        library=whiten_channels(np.stack(library, axis=-1), rho, sigma),
        others=whiten_channels(np.stack(others, axis=-1), rho, sigma),
        factor=np.empty(0),
        session_q=np.empty(0),
        library_q=np.empty(0),
        others_q=np.empty(0),
    )
    return set_disturbance_prior(evidence, tolerances, disturbance)


def differentiate_about_offsets(
    run: RunEvidence,
    base: NDArray[np.float64],
    slots: tuple[Slot, ...],
    offsets: NDArray[np.float64],
    tolerances: Tolerances,
    disturbance: Disturbance,
) -> RunEvidence:
    """Differentiate a run again about a point that its own offsets and disturbances belong to.

    Parameters
    ----------
    run : the run; the derivatives by the library are kept
    base : float64 [len(EFFECT_TABLE)] parameters at which derivatives are taken
    slots : forms that belong to that point
    offsets : float64 [D] the run's offsets and disturbance knots
    tolerances, disturbance : prior of its offsets and disturbances
    """
    moved, forms = _add_offsets(base, slots, offsets, run.knots)
    faster = offsets[0] * (1.0 + float(base[PARAMETER_INDEX["speed_scale"]]))
    model = replace(run.model, initial_speed=run.model.initial_speed + faster)
    fresh = differentiate_run(model, run.rho, run.sigma, moved, (), tolerances, disturbance, forms)
    kept = replace(fresh, model=run.model, library=run.library, others=run.others, origin=offsets)
    return set_disturbance_prior(kept, tolerances, disturbance)


def _add_offsets(
    theta: NDArray[np.float64], slots: tuple[Slot, ...], offsets: NDArray[np.float64], knots: tuple[int, ...]
) -> tuple[NDArray[np.float64], tuple[Slot, ...]]:
    """Return parameters and forms of a run with its own friction and disturbances."""
    moved = theta.copy()
    moved[PARAMETER_INDEX["friction"]] += offsets[1]
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
    return replace(
        changed,
        session_q=changed.project_on_nuisances(changed.session),
        library_q=changed.project_on_nuisances(changed.library),
        others_q=changed.project_on_nuisances(changed.others),
    )


def list_second_values(effects: tuple[Effect, ...]) -> list[tuple[int, float]]:
    """Return positions of the effects with a second parameter, and the values at which the screen tries it.

    Parameters
    ----------
    effects : library of effects
    """
    return [
        (place, second.lower + share * (second.upper - second.lower))
        for place, effect in enumerate(effects)
        for second in effect.parameters[1:]
        for share in SECOND_SHARES
    ]


def _shift_parameter(theta: NDArray[np.float64], index: int, step: float) -> NDArray[np.float64]:
    """Return a copy of the vector with one parameter moved by a step."""
    moved = theta.copy()
    moved[index] += step
    return moved
