"""Derivatives of one run's readings: by its own offsets and disturbances, by the session, and by the library."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, Tolerances
from tasks.identification.inference.disturbance import DISTURBED, KNOT_SPACING, Disturbance
from tasks.identification.inference.evidence import (
    SESSION_INDEX,
    RunEvidence,
    set_disturbance_prior,
)
from tasks.identification.inference.forward import (
    RunModel,
    compute_instrument_readings,
    compute_starting_speed,
    equip_vehicle,
    moves_alike,
    simulate_run,
)
from tasks.identification.inference.noise import whiten_channels
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import PARAMETER_INDEX
from tasks.vehicle.model.simulation import Simulation

SECOND_SHARES = (0.3, 0.6)
"""Shares of the range of an effect's second parameter at which it is tried, besides its first value."""
STEPS = (5e-4, 0.02)
"""Smallest and largest step of a number of the file: a car that stops sooner stands where another brakes [1]."""
KNOT_STEP = (30.0, 0.01, 30.0)
"""Step of a knot at each disturbed port [N, 1, N m]."""
Quotient = Callable[..., NDArray[np.float64]]
"""Function that returns the difference quotient of the readings for a moved parameter vector and its step."""


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
    simulated, compute_quotient = _prepare_quotients(model, base, slots)
    columns = [
        compute_quotient(base, 0.02, initial_speed=compute_starting_speed(model, base) + 0.02),
        compute_quotient(_shift_parameter(base, PARAMETER_INDEX["friction"], 0.01), 0.01),
    ]
    for name in ("longitudinal_acceleration", "pitch"):
        offset = np.zeros_like(columns[0])
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
            columns.append(compute_quotient(base, step, (slot,), branch=(first, simulated)))
    steps = np.clip(0.5 * np.array(tolerances.file_numbers), *STEPS)
    session = [
        compute_quotient(_shift_parameter(base, i, step), step)
        for i, step in zip(SESSION_INDEX, steps, strict=True)
    ]
    nuisance = whiten_channels(np.stack(columns, axis=-1), rho, sigma, model.sampled)
    evidence = RunEvidence(
        model=model,
        rho=rho,
        sigma=sigma,
        nuisance=nuisance,
        knots=tuple(knots),
        information=nuisance.T @ nuisance,
        session=whiten_channels(np.stack(session, axis=-1), rho, sigma, model.sampled),
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
    _, compute_quotient = _prepare_quotients(run.model, base, slots)
    library, others = [], []
    for effect in effects:
        theta = base.copy()
        leading = effect.parameters[0]
        if base[leading.index] == 0.0:
            for parameter in effect.parameters[1:]:
                theta[parameter.index] = parameter.start
        library.append(compute_quotient(_shift_parameter(theta, leading.index, leading.step), leading.step))
    for index, value in list_second_values(effects):
        leading, second = effects[index].parameters
        theta = base.copy()
        theta[second.index] = value
        # an effect that the model has already is not screened
        there = base[leading.index] != 0.0
        others.append(
            np.zeros_like(library[0])
            if there
            else compute_quotient(_shift_parameter(theta, leading.index, leading.step), leading.step)
        )
    columns, more = (
        whiten_channels(np.stack(part, axis=-1), run.rho, run.sigma, run.model.sampled)
        for part in (library, others or [np.zeros_like(library[0])])
    )
    return replace(run, library=columns, others=more)


def _prepare_quotients(
    model: RunModel, base: NDArray[np.float64], slots: tuple[Slot, ...]
) -> tuple[Simulation, Quotient]:
    """Return the simulation of a run at a point with its states, and the function that differentiates about it."""
    equipped = equip_vehicle(model, base)
    simulated = simulate_run(model, base, slots=slots, keep_states=True, equipped=equipped)
    y = compute_instrument_readings(model, base, simulated)

    def compute_quotient(
        theta: NDArray[np.float64], step: float, extra: tuple[Slot, ...] = (), **options: Any
    ) -> NDArray[np.float64]:
        """Return the difference quotient of the readings."""
        moved = simulated
        if extra or options or not moves_alike(theta, base):
            car = equipped if theta is base else None
            moved = simulate_run(model, theta, slots=(*slots, *extra), equipped=car, **options)
        return (compute_instrument_readings(model, theta, moved) - y) / step

    return simulated, compute_quotient


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
