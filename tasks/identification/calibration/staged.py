"""The paper's staged calibration: each stage fits a group of scalars to the responses that it acts on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tasks.identification.calibration.residual import (
    CalibrationCase,
    Phase,
    Response,
    Yardstick,
    compute_residuals,
    simulate_case,
)
from tasks.identification.calibration.scalars import (
    CalibrationScalar,
    list_calibration_scalars,
    read_scalar,
    set_scalars,
)
from tasks.vehicle.effects.table import EFFECT_UNITS
from tasks.vehicle.parameters import Vehicle, compute_surface_response
from tasks.vehicle.rollout import Mode

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Limits of one group.

    Parameters
    ----------
    unit : unit of the group's scalars
    lower, upper : limits of every scalar [unit]
    step : step of finite differences [unit]
    smooth : standard deviation of the difference between neighbouring knots of a family; infinite for none [unit]
    start : first value of an effect that the vehicle does not have yet; None for 0 [unit]
    """

    unit: str
    lower: float
    upper: float
    step: float
    smooth: float = inf
    start: float | None = None


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One step of the procedure (paper, Table frozen_calibration_count).

    Parameters
    ----------
    name : name of the stage
    groups : groups whose scalars move together
    responses : responses that they are fitted to
    kinds : kinds of the cases that are used: flat, hump, depression
    phase : start, braking, tail or event
    """

    name: str
    groups: tuple[str, ...]
    responses: tuple[Response, ...]
    kinds: tuple[str, ...]
    phase: Phase


@dataclass(frozen=True, kw_only=True)
class Procedure:
    """Procedure of a whole calibration.

    Parameters
    ----------
    mode : paper or coupled
    stages : stages, in order
    passes : number of passes through all stages
    evaluations : largest number of residual evaluations of one stage
    bounds : bounds by group
    yardstick : scales and speeds
    """

    mode: Mode
    stages: tuple[Stage, ...]
    passes: int
    evaluations: int
    bounds: Mapping[str, Bounds]
    yardstick: Yardstick

    @property
    def groups(self) -> tuple[str, ...]:
        """Return every group that some stage moves, in order of first appearance."""
        return tuple(dict.fromkeys(group for stage in self.stages for group in stage.groups))


@dataclass(frozen=True, kw_only=True)
class StageRecord:
    """Result of one stage.

    Parameters
    ----------
    stage, turn : name of the stage, and number of the pass, from 1
    before, after : loss of the stage, the sum of (RMSE / scale)^2 over its cases [1]
    moved : largest change of a scalar over the distance between its bounds [1]
    at_bounds : scalars that ended on a bound
    """

    stage: str
    turn: int
    before: float
    after: float
    moved: float
    at_bounds: tuple[str, ...]


def calibrate_vehicle(
    vehicle: Vehicle, cases: Sequence[CalibrationCase], procedure: Procedure
) -> tuple[Vehicle, tuple[StageRecord, ...]]:
    """Calibrate a vehicle stage by stage; a stage that does not lower its own loss is not accepted.

    Parameters
    ----------
    vehicle : vehicle to start from
    cases : development cases
    procedure : stages, bounds, scales

    Returns
    -------
    The calibrated vehicle and a record of every stage.
    """
    records: list[StageRecord] = []
    vehicle = _add_missing_effects(vehicle, procedure)
    for turn in range(1, procedure.passes + 1):
        for stage in procedure.stages:
            vehicle, record = run_stage(vehicle, cases, stage, procedure)
            records.append(replace(record, turn=turn))
    return vehicle, tuple(records)


def run_stage(
    vehicle: Vehicle, cases: Sequence[CalibrationCase], stage: Stage, procedure: Procedure
) -> tuple[Vehicle, StageRecord]:
    """Fit one stage's scalars by bounded nonlinear least squares.

    The method is that of Branch, Coleman and Li (1999, doi:10.1137/S1064827595289108). The bounds act as a weak prior
    about the start, so that a scalar that no run is sensitive to keeps its value.

    Parameters
    ----------
    vehicle : vehicle to start from
    cases : development cases
    stage : scalars and the responses that they are fitted to
    procedure : bounds, scales, number of evaluations
    """
    scalars = list_calibration_scalars(vehicle, stage.groups)
    chosen = [case for case in cases if case.kind in stage.kinds]
    limits = np.array([(procedure.bounds[s.group].lower, procedure.bounds[s.group].upper) for s in scalars])
    width = limits[:, 1] - limits[:, 0]
    start = np.array([read_scalar(vehicle, s) for s in scalars])
    start = np.clip(start, limits[:, 0] + 1e-6 * width, limits[:, 1] - 1e-6 * width)

    prior = np.diag(np.sqrt(12.0) / width)
    smooth = build_smoothness_rows(scalars, procedure)

    def compute_residual(x: Floats) -> Floats:
        changed = set_scalars(vehicle, dict(zip(scalars, map(float, x), strict=True)))
        parts = [_compute_case_residual(changed, case, stage, procedure) for case in chosen]
        return np.concatenate([*parts, prior @ (x - start), smooth @ x])

    def compute_jacobian(x: Floats) -> Floats:
        return np.vstack(
            [compute_stage_jacobian(vehicle, chosen, stage, procedure, scalars, x), prior, smooth]
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


def compute_stage_jacobian(
    vehicle: Vehicle,
    cases: Sequence[CalibrationCase],
    stage: Stage,
    procedure: Procedure,
    scalars: Sequence[CalibrationScalar],
    x: Floats,
) -> Floats:
    """Return the derivatives of a stage's residuals by central differences.

    A case that a scalar cannot influence is not simulated.

    Parameters
    ----------
    vehicle : vehicle with all values that stay fixed
    cases, stage, procedure : as in ``run_stage``
    scalars : scalars that move
    x : their values, shape (n,) [units of the scalars]

    Returns
    -------
    Shape (residuals, n) [1 / unit].
    """
    here = set_scalars(vehicle, dict(zip(scalars, map(float, x), strict=True)))
    unmoved = [np.zeros_like(_compute_case_residual(here, case, stage, procedure)) for case in cases]
    columns = []
    for scalar in scalars:
        step, value = procedure.bounds[scalar.group].step, read_scalar(here, scalar)
        above, below = (set_scalars(here, {scalar: value + side * step}) for side in (1.0, -1.0))
        parts = []
        for case, zeros in zip(cases, unmoved, strict=True):
            if _hides_difference(above, below, case):
                parts.append(zeros)
                continue
            up, down = (_compute_case_residual(side, case, stage, procedure) for side in (above, below))
            parts.append((up - down) / (2 * step))
        columns.append(np.concatenate(parts))
    return np.stack(columns, axis=1)


def build_smoothness_rows(scalars: Sequence[CalibrationScalar], procedure: Procedure) -> Floats:
    """Return the rows that penalise differences between neighbouring knots of a family.

    They keep the interpolation between knots sensible where the runs determine one of them poorly.

    Parameters
    ----------
    scalars : the n scalars
    procedure : procedure with the standard deviation of these differences

    Returns
    -------
    Shape (pairs, n) [1 / unit].
    """
    rows = []
    for i, (one, other) in enumerate(pairwise(scalars)):
        spread = procedure.bounds[one.group].smooth
        neighbours = one.group == other.group and len(one.places) == len(other.places) == 1
        if isfinite(spread) and neighbours and one.places[0][0] == other.places[0][0]:
            row = np.zeros(len(scalars))
            row[i], row[i + 1] = 1 / spread, -1 / spread
            rows.append(row)
    return np.array(rows).reshape(-1, len(scalars))


def _add_missing_effects(vehicle: Vehicle, procedure: Procedure) -> Vehicle:
    """Return the vehicle with the start values of effects that it does not have yet."""
    missing = [group for group in procedure.groups if group in EFFECT_UNITS and group not in vehicle.effects]
    starts = {group: procedure.bounds[group].start or 0.0 for group in missing}
    return replace(vehicle, effects={**vehicle.effects, **starts})


def _compute_case_residual(
    vehicle: Vehicle, case: CalibrationCase, stage: Stage, procedure: Procedure
) -> Floats:
    """Return a stage's residuals of one case [1]."""
    ride = simulate_case(vehicle, case, procedure.mode, procedure.yardstick.margin_s)
    return compute_residuals(ride, case, stage.responses, stage.phase, procedure.yardstick)


def _hides_difference(one: Vehicle, other: Vehicle, case: CalibrationCase) -> bool:
    """Return whether a case's conditions hide all that differs between two vehicles."""
    if replace(one, families={}) != replace(other, families={}):
        return False
    at = (case.family, case.surface_friction)
    return compute_surface_response(one, *at) == compute_surface_response(other, *at)
