"""The paper's staged calibration: each stage fits a group of scalars to the responses that it acts on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tasks.identification.calibration.jacobian import (
    build_smoothness_rows,
    compute_case_residual,
    compute_stage_jacobian,
)
from tasks.identification.calibration.procedure import Procedure, Stage
from tasks.identification.calibration.residual import EVERY_RESPONSE, CalibrationCase
from tasks.identification.calibration.scalars import list_calibration_scalars, read_scalar, set_scalars
from tasks.vehicle.effects.table import EFFECT_UNITS
from tasks.vehicle.parameters import Vehicle

Floats = NDArray[np.float64]
STEP_SHARES = (1.0, 0.5, 0.25, 0.125)
"""Shares of a stage's step that are tried until all cases together are no worse [1]."""


@dataclass(frozen=True, kw_only=True)
class StageRecord:
    """Result of one stage.

    Parameters
    ----------
    stage, turn : name of the stage, and number of the pass, from 1
    before, after : loss of the stage before and after its whole step: the sum of (RMSE / scale)^2 over its cases, with
        weak prior and smoothness [1]
    moved : largest change of a scalar over the distance between its bounds [1]
    at_bounds : scalars that the whole step takes to a bound
    accepted : share of the stage's step that was taken [1]
    """

    stage: str
    turn: int
    before: float
    after: float
    moved: float
    at_bounds: tuple[str, ...]
    accepted: float = 1.0


def calibrate_vehicle(
    vehicle: Vehicle, cases: Sequence[CalibrationCase], procedure: Procedure
) -> tuple[Vehicle, tuple[StageRecord, ...]]:
    """Calibrate a vehicle stage by stage, by the procedure's rule of acceptance.

    Parameters
    ----------
    vehicle : vehicle to start from
    cases : development cases
    procedure : stages, bounds, scales, and when it has converged

    Returns
    -------
    The calibrated vehicle and a record of every stage.
    """
    records: list[StageRecord] = []
    vehicle = start = _add_missing_effects(vehicle, procedure)
    for turn in range(1, procedure.passes + 1):
        for stage in procedure.stages:
            if procedure.tolerance is None:
                vehicle, record = run_stage(vehicle, cases, stage, procedure)
            else:
                fitted, record = run_stage(vehicle, cases, stage, procedure, prior=start)
                vehicle, record = accept_jointly(vehicle, fitted, record, cases, procedure)
            records.append(replace(record, turn=turn))
        moved = max(record.moved for record in records[-len(procedure.stages) :])
        if procedure.tolerance is not None and moved <= procedure.tolerance:
            break
    return vehicle, tuple(records)


def run_stage(
    vehicle: Vehicle,
    cases: Sequence[CalibrationCase],
    stage: Stage,
    procedure: Procedure,
    prior: Vehicle | None = None,
) -> tuple[Vehicle, StageRecord]:
    """Fit one stage's scalars by bounded nonlinear least squares; without a lower loss they stay.

    The method is that of Branch, Coleman and Li (1999, doi:10.1137/S1064827595289108). The bounds act as a weak prior,
    so that a scalar that no run is sensitive to keeps its value.

    Parameters
    ----------
    vehicle : vehicle to start from
    cases : development cases
    stage : scalars and the responses that they are fitted to
    procedure : bounds, scales, number of evaluations
    prior : vehicle with the scalars about which the weak prior lies; None for those to start from
    """
    scalars = list_calibration_scalars(vehicle, stage.groups)
    chosen = [case for case in cases if case.kind in stage.kinds]
    limits = np.array([(procedure.bounds[s.group].lower, procedure.bounds[s.group].upper) for s in scalars])
    width = limits[:, 1] - limits[:, 0]

    def read_inside(source: Vehicle) -> Floats:
        values = np.array([read_scalar(source, s) for s in scalars])
        return np.clip(values, limits[:, 0] + 1e-6 * width, limits[:, 1] - 1e-6 * width)

    start, centre = read_inside(vehicle), read_inside(prior or vehicle)
    weights = np.diag(np.sqrt(12.0) / width)
    smooth = build_smoothness_rows(scalars, procedure)

    def compute_residual(x: Floats) -> Floats:
        changed = set_scalars(vehicle, dict(zip(scalars, map(float, x), strict=True)))
        parts = [compute_case_residual(changed, case, stage, procedure) for case in chosen]
        return np.concatenate([*parts, weights @ (x - centre), smooth @ x])

    def compute_jacobian(x: Floats) -> Floats:
        return np.vstack(
            [compute_stage_jacobian(vehicle, chosen, stage, procedure, scalars, x), weights, smooth]
        )

    before = float(np.sum(compute_residual(start) ** 2))
    solution = least_squares(
        compute_residual, start, compute_jacobian, bounds=(limits[:, 0], limits[:, 1]), x_scale=width,
        max_nfev=procedure.evaluations, xtol=1e-5, ftol=1e-5,
    )  # fmt: skip
    after = float(np.sum(solution.fun**2))
    best = solution.x if after < before else start
    on_bound = np.minimum(best - limits[:, 0], limits[:, 1] - best) < 1e-3 * width
    record = StageRecord(
        stage=stage.name,
        turn=0,
        before=before,
        after=min(after, before),
        moved=float(np.max(np.abs(best - start) / width)),
        at_bounds=tuple(s.name for s, hit in zip(scalars, on_bound, strict=True) if hit),
    )
    return set_scalars(vehicle, dict(zip(scalars, map(float, best), strict=True))), record


def accept_jointly(
    before: Vehicle,
    after: Vehicle,
    record: StageRecord,
    cases: Sequence[CalibrationCase],
    procedure: Procedure,
) -> tuple[Vehicle, StageRecord]:
    """Return the largest share of a stage's step after which all cases together are no worse (paper, Appendix C.1).

    Parameters
    ----------
    before, after : vehicle before and after the stage
    record : the stage's record
    cases : all development cases
    procedure : scales of the responses
    """
    scalars = list_calibration_scalars(before, procedure.groups)
    starts, ends = ([read_scalar(vehicle, s) for s in scalars] for vehicle in (before, after))
    limit = compute_joint_loss(before, cases, procedure)
    for share in STEP_SHARES:
        values = {s: a + share * (b - a) for s, a, b in zip(scalars, starts, ends, strict=True)}
        tried = set_scalars(before, values)
        if compute_joint_loss(tried, cases, procedure) <= limit:
            return tried, replace(record, accepted=share, moved=share * record.moved)
    return before, replace(record, accepted=0.0, moved=0.0, after=record.before)


def compute_joint_loss(vehicle: Vehicle, cases: Sequence[CalibrationCase], procedure: Procedure) -> float:
    """Return the sum of (RMSE / scale)^2 of every response over the events of all cases [1].

    Parameters
    ----------
    vehicle : the vehicle
    cases : all development cases
    procedure : scales of the responses
    """
    every = Stage(name="all", groups=(), responses=EVERY_RESPONSE, kinds=(), phase="event")
    return float(sum(np.sum(compute_case_residual(vehicle, case, every, procedure) ** 2) for case in cases))


def _add_missing_effects(vehicle: Vehicle, procedure: Procedure) -> Vehicle:
    """Return the vehicle with the start values of effects that it does not have yet."""
    missing = [group for group in procedure.groups if group in EFFECT_UNITS and group not in vehicle.effects]
    starts = {group: procedure.bounds[group].start or 0.0 for group in missing}
    return replace(vehicle, effects={**vehicle.effects, **starts})
