"""Residuals of a stage, and their derivatives by the scalars."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from tasks.identification.calibration.procedure import Procedure, Stage
from tasks.identification.calibration.residual import CalibrationCase, compute_residuals, simulate_case
from tasks.identification.calibration.scalars import CalibrationScalar, read_scalar, set_scalars
from tasks.vehicle.parameters import Vehicle, compute_surface_response

Floats = NDArray[np.float64]


def compute_case_residual(
    vehicle: Vehicle, case: CalibrationCase, stage: Stage, procedure: Procedure
) -> Floats:
    """Return a stage's residuals of one case [1].

    Parameters
    ----------
    vehicle : the vehicle
    case : reference run
    stage : responses and phase
    procedure : mode and scales
    """
    ride = simulate_case(vehicle, case, procedure.mode, procedure.yardstick.margin_s)
    return compute_residuals(ride, case, stage.responses, stage.phase, procedure.yardstick)


def compute_stage_jacobian(
    vehicle: Vehicle,
    cases: Sequence[CalibrationCase],
    stage: Stage,
    procedure: Procedure,
    scalars: Sequence[CalibrationScalar],
    x: Floats,
) -> Floats:
    """Return the derivatives of a stage's residuals by central differences.

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

    def compute_residual(changed: Vehicle, case: CalibrationCase) -> Floats:
        return compute_case_residual(changed, case, stage, procedure)

    here = set_scalars(vehicle, dict(zip(scalars, map(float, x), strict=True)))
    return compute_case_jacobian(here, cases, compute_residual, procedure, scalars)


def compute_case_jacobian(
    vehicle: Vehicle,
    cases: Sequence[CalibrationCase],
    compute_residual: Callable[[Vehicle, CalibrationCase], Floats],
    procedure: Procedure,
    scalars: Sequence[CalibrationScalar],
) -> Floats:
    """Return the derivatives of any residuals of cases by central differences, case after case.

    A case that a scalar cannot influence is not simulated.

    Parameters
    ----------
    vehicle : vehicle at which the derivatives are taken
    cases : reference runs
    compute_residual : residuals of one case [1]
    procedure : steps of the differences
    scalars : scalars that move

    Returns
    -------
    Shape (residuals, n) [1 / unit].
    """
    unmoved = [np.zeros_like(compute_residual(vehicle, case)) for case in cases]
    columns = []
    for scalar in scalars:
        step, value = procedure.bounds[scalar.group].step, read_scalar(vehicle, scalar)
        above, below = (set_scalars(vehicle, {scalar: value + side * step}) for side in (1.0, -1.0))
        parts = []
        for case, zeros in zip(cases, unmoved, strict=True):
            if _hides_difference(above, below, case):
                parts.append(zeros)
                continue
            up, down = (compute_residual(side, case) for side in (above, below))
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
        neighbours = one.group == other.group and len(one.knots) == len(other.knots) == 1
        if isfinite(spread) and neighbours and one.knots[0][0] == other.knots[0][0]:
            row = np.zeros(len(scalars))
            row[i], row[i + 1] = 1 / spread, -1 / spread
            rows.append(row)
    return np.array(rows).reshape(-1, len(scalars))


def _hides_difference(one: Vehicle, other: Vehicle, case: CalibrationCase) -> bool:
    """Return whether a case's conditions hide all that differs between two vehicles."""
    if replace(one, families={}) != replace(other, families={}):
        return False
    at = (case.family, case.surface_friction)
    return compute_surface_response(one, *at) == compute_surface_response(other, *at)
