"""Derivatives of one run's readings: by its own offsets and disturbances, by the session, and by the library."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, Tolerances
from tasks.identification.inference.disturbance import DISTURBED, KNOT_SPACING, Disturbance
from tasks.identification.inference.evidence import (
    SESSION_INDEX,
    RunEvidence,
    set_disturbance_prior,
)
from tasks.identification.inference.forward import RunModel, compute_starting_speed
from tasks.identification.inference.noise import whiten_channels
from tasks.identification.inference.quotients import (
    compute_quotient,
    compute_slot_quotients,
    simulate_point,
)
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import PARAMETER_INDEX

SECOND_SHARES = (0.3, 0.6)
"""Shares of the range of an effect's second parameter at which it is tried, besides its first value."""
STEPS = (5e-4, 0.02)
"""Smallest and largest step of a number of the file: a car that stops sooner stands where another brakes [1]."""
KNOT_STEP = (30.0, 0.01, 30.0)
"""Step of a knot at each disturbed port [N, 1, N m]."""
HAT = np.array([0.0, 1.0, 0.0])
"""A disturbance that is 1 at one knot [1]."""


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
    point = simulate_point(model, base, slots)
    speed, friction = compute_starting_speed(model, base) + 0.02, PARAMETER_INDEX["friction"]
    columns = [
        compute_quotient(point, base, 0.02, initial_speed=speed),
        compute_quotient(point, _shift_parameter(base, friction, 0.01), 0.01),
    ]
    for name in ("longitudinal_acceleration", "pitch"):
        offset = np.zeros_like(columns[0])
        offset[:, CHANNELS.index(name)] = 1.0
        columns.append(offset)
    dt = model.run.interval
    knots = tuple(int(np.ceil(model.samples * dt / spacing)) + 1 for spacing in KNOT_SPACING)
    hats = [
        Slot(port=port, variable="time", origin=(k - 1) * spacing, spacing=spacing, values=step * HAT)
        for port, spacing, step, count in zip(DISTURBED, KNOT_SPACING, KNOT_STEP, knots, strict=True)
        for k in range(count)
    ]
    firsts = [min(max(int(hat.origin / dt), 0), model.samples - 1) for hat in hats]
    own = np.concatenate((columns, compute_slot_quotients(point, hats, firsts)))
    steps = np.clip(0.5 * np.array(tolerances.file_numbers), *STEPS)
    session = [
        compute_quotient(point, _shift_parameter(base, i, step), step)
        for i, step in zip(SESSION_INDEX, steps, strict=True)
    ]
    nuisance = whiten_channels(np.moveaxis(own, 0, -1), rho, sigma, model.sampled)
    evidence = RunEvidence(
        model=model,
        rho=rho,
        sigma=sigma,
        nuisance=nuisance,
        knots=knots,
        information=nuisance.T @ nuisance,
        session=whiten_channels(np.moveaxis(np.array(session), 0, -1), rho, sigma, model.sampled),
        library=np.zeros((len(nuisance), 1)),
        others=np.zeros((len(nuisance), 1)),
        factor=np.empty(0),
        session_q=np.empty(0),
    )
    evidence = set_disturbance_prior(evidence, tolerances, disturbance)
    return differentiate_by_library(evidence, base, effects, slots) if effects else evidence


def differentiate_by_library(
    run: RunEvidence, base: NDArray[np.float64], effects: tuple[Effect, ...], slots: tuple[Slot, ...] = ()
) -> RunEvidence:
    """Return a run with its derivatives by every effect of the library.

    Parameters
    ----------
    run : the run, differentiated about the same point
    base : float64 [len(EFFECT_TABLE)] parameters at which derivatives are taken
    effects : library of effects
    slots : forms that belong to that point
    """
    point = simulate_point(run.model, base, slots)
    library, others = [], []
    for effect in effects:
        theta = base.copy()
        leading = effect.parameters[0]
        if base[leading.index] == 0.0:
            for parameter in effect.parameters[1:]:
                theta[parameter.index] = parameter.start
        moved = _shift_parameter(theta, leading.index, leading.step)
        library.append(compute_quotient(point, moved, leading.step))
    for index, value in list_second_values(effects):
        leading, second = effects[index].parameters
        theta = base.copy()
        theta[second.index] = value
        # an effect that the model has already is not screened
        there = base[leading.index] != 0.0
        others.append(
            np.zeros_like(library[0])
            if there
            else compute_quotient(point, _shift_parameter(theta, leading.index, leading.step), leading.step)
        )
    columns, more = (
        whiten_channels(np.moveaxis(np.array(part), 0, -1), run.rho, run.sigma, run.model.sampled)
        for part in (library, others or [np.zeros_like(library[0])])
    )
    return replace(run, library=columns, others=more)


def list_second_values(effects: tuple[Effect, ...]) -> list[tuple[int, float]]:
    """Return positions of the effects with a second parameter, and the values at which it is tried.

    Parameters
    ----------
    effects : library of effects
    """
    return [
        (index, second.lower + share * (second.upper - second.lower))
        for index, effect in enumerate(effects)
        for second in effect.parameters[1:]
        for share in SECOND_SHARES
    ]


def _shift_parameter(theta: NDArray[np.float64], index: int, step: float) -> NDArray[np.float64]:
    """Return a copy of the vector with one parameter moved by a step."""
    moved = theta.copy()
    moved[index] += step
    return moved
