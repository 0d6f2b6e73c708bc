"""Identifiability of the calibrated scalars: which ones the reference runs determine, and which are confounded."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.identification.calibration.jacobian import (
    build_smoothness_rows,
    compute_case_jacobian,
    compute_stage_jacobian,
)
from tasks.identification.calibration.procedure import Procedure, Stage
from tasks.identification.calibration.residual import (
    EVERY_RESPONSE,
    CalibrationCase,
    compute_residuals,
    simulate_case,
)
from tasks.identification.calibration.scalars import (
    CalibrationScalar,
    list_calibration_scalars,
    read_scalar,
    set_scalars,
)
from tasks.vehicle.parameters import Vehicle

Floats = NDArray[np.float64]
CONFOUNDED = 0.95
"""Correlation from which two scalars count as confounded [1]."""
DETERMINED = 0.5
"""Share of the prior's standard deviation below which a scalar counts as determined [1]."""
REACHES = (-3.0, -1.5, 1.5, 3.0)
"""Standard deviations from its value at which a scalar must be determined too [1]: where another part takes over, as
where brakes no longer reach the tyre's limit, the derivatives at the value promise what is not there."""


@dataclass(frozen=True, kw_only=True)
class ScalarKnowledge:
    """Uncertainty of one scalar.

    Parameters
    ----------
    name : name of the scalar
    value : calibrated value [unit]
    unit : unit of the value
    sd : standard deviation, with all others unknown too [unit]
    sd_alone : standard deviation, with all others known [unit]
    share_of_prior : sd over that of a uniform distribution between the bounds [1]
    determined : whether that share is below `DETERMINED`, at the value and with the derivatives by the scalar
        three standard deviations to either side of it, and halfway there
    """

    name: str
    value: float
    unit: str
    sd: float
    sd_alone: float
    share_of_prior: float
    determined: bool


@dataclass(frozen=True, kw_only=True)
class Identifiability:
    """Identifiability report of one calibration.

    Parameters
    ----------
    scalars : one entry each
    confounded : pairs of names with their correlation, strongest first
    eigenvalues : eigenvalues of the prior-scaled information, descending; the bounds alone give 1 [1]
    weakest : direction of the smallest eigenvalue: share of each scalar with more than a tenth, by name [1]
    """

    scalars: tuple[ScalarKnowledge, ...]
    confounded: tuple[tuple[str, str, float], ...]
    eigenvalues: tuple[float, ...]
    weakest: dict[str, float]


def compute_identifiability(
    vehicle: Vehicle, cases: Sequence[CalibrationCase], procedure: Procedure
) -> Identifiability:
    """Return the identifiability of all scalars by the joint information of all cases.

    Bounds and smoothness are the prior. Every response of every case counts as one observation, whose standard
    deviation is the response's scale, because the residual of a deterministic model is one smooth curve per case and
    not thousands of independent samples.

    A procedure that converges is reported for the values at which its stages rest, so that a response informs only
    the stage that is fitted to it; any other by the Fisher information of all responses.

    Parameters
    ----------
    vehicle : calibrated vehicle
    cases : development cases
    procedure : groups, bounds and scales
    """
    scalars = list_calibration_scalars(vehicle, procedure.groups)
    bounds = [procedure.bounds[s.group] for s in scalars]
    widths = np.array([b.upper - b.lower for b in bounds])
    prior_sd = widths / np.sqrt(12.0)
    staged = procedure.tolerance is not None
    list_rows = compute_stage_rows if staged else _compute_joint_rows
    owned = [
        np.array([s.group in stage.groups for s in scalars]) for stage in procedure.stages
    ] if staged else [np.full(len(scalars), True)]  # fmt: skip
    rows = [part * prior_sd for part in list_rows(vehicle, cases, procedure, scalars)]
    x = np.array([read_scalar(vehicle, s) for s in scalars])
    report = summarise_information(
        compute_staged_information(rows, owned), scalars, x, [b.unit for b in bounds], widths
    )

    def stays_determined(index: int, known: ScalarKnowledge) -> bool:
        """Whether the derivatives by a scalar determine it at all of `REACHES` as well."""
        scalar, limits = scalars[index], bounds[index]
        for reach in REACHES:
            value = np.clip(
                known.value + reach * known.sd, limits.lower + limits.step, limits.upper - limits.step
            )
            there = [part.copy() for part in rows]
            column = list_rows(set_scalars(vehicle, {scalar: float(value)}), cases, procedure, [scalar])
            for part, derivative in zip(there, column, strict=True):
                part[: len(derivative), index] = derivative[:, 0] * prior_sd[index]
            covariance = np.linalg.inv(compute_staged_information(there, owned))
            if not np.sqrt(covariance[index, index]) < DETERMINED:
                return False
        return True

    return replace(
        report,
        scalars=tuple(
            replace(known, determined=known.determined and stays_determined(index, known))
            for index, known in enumerate(report.scalars)
        ),
    )


def compute_staged_information(rows: Sequence[Floats], owned: Sequence[NDArray[np.bool_]]) -> Floats:
    """Return the information about the values at which stages come to rest that hold each other's scalars.

    They solve one equation a scalar: the derivative of its own stage's loss is 0. With A, the derivatives of these
    equations by all scalars, and B, their covariance, the information is A' inv(B) A (Godambe 1960,
    doi:10.1214/aoms/1177705693). A single stage with all scalars gives the Fisher information.

    Parameters
    ----------
    rows, owned : as in ``compute_stage_equations``

    Returns
    -------
    Shape (n, n) [1].
    """
    slope, spread = compute_stage_equations(rows, owned)
    information: Floats = slope.T @ np.linalg.solve(spread, slope)
    return information


def compute_stage_equations(
    rows: Sequence[Floats], owned: Sequence[NDArray[np.bool_]]
) -> tuple[Floats, Floats]:
    """Return the derivatives and the covariance of the equations that the stages solve, the prior's part included.

    Parameters
    ----------
    rows : of each stage, derivatives of its residuals by scalars in units of their prior's deviation, shape (m, n) [1]
    owned : of each stage, the scalars that it moves, shape (n,)

    Returns
    -------
    Both of shape (n, n) [1].
    """
    slope, spread = (np.eye(len(owned[0])) for _ in range(2))
    for jacobian, own in zip(rows, owned, strict=True):
        slope[own] += jacobian[:, own].T @ jacobian
        spread[np.ix_(own, own)] += jacobian[:, own].T @ jacobian[:, own]
    return slope, spread


def compute_stage_rows(
    vehicle: Vehicle,
    cases: Sequence[CalibrationCase],
    procedure: Procedure,
    scalars: Sequence[CalibrationScalar],
) -> list[Floats]:
    """Return the derivatives of each stage's residuals by all scalars, with a stage's smoothness; one run serves all.

    Parameters
    ----------
    vehicle : calibrated vehicle
    cases : development cases
    procedure : stages and steps of the differences
    scalars : the n scalars

    Returns
    -------
    One array a stage, shape (m, n) [1 / unit].
    """

    def list_residuals(changed: Vehicle, case: CalibrationCase) -> list[Floats]:
        ride = simulate_case(changed, case, procedure.mode, procedure.yardstick.margin_s)
        return [
            compute_residuals(ride, case, stage.responses, stage.phase, procedure.yardstick)
            if case.kind in stage.kinds
            else np.empty(0)
            for stage in procedure.stages
        ]

    jacobian = compute_case_jacobian(
        vehicle, cases, lambda car, case: np.concatenate(list_residuals(car, case)), procedure, scalars
    )
    stage_of_row = np.concatenate(
        [
            np.repeat(np.arange(len(procedure.stages)), [len(r) for r in list_residuals(vehicle, case)])
            for case in cases
        ]
    )
    smooth = build_smoothness_rows(scalars, procedure)
    return [
        np.vstack(
            [
                jacobian[stage_of_row == k],
                smooth[[scalars[np.flatnonzero(row)[0]].group in stage.groups for row in smooth]],
            ]
        )
        for k, stage in enumerate(procedure.stages)
    ]


def _compute_joint_rows(
    vehicle: Vehicle,
    cases: Sequence[CalibrationCase],
    procedure: Procedure,
    scalars: Sequence[CalibrationScalar],
) -> list[Floats]:
    """Return the derivatives of every response in every case by scalars, one array of shape (m, n) [1 / unit]."""
    everything = Stage(
        name="all", groups=procedure.groups, responses=EVERY_RESPONSE, kinds=("flat", "hump", "depression"),
        phase="event",
    )  # fmt: skip
    x = np.array([read_scalar(vehicle, s) for s in scalars])
    coasting = replace(everything, responses=("speed_drop",), phase="start")
    rows = [
        compute_stage_jacobian(vehicle, cases, everything, procedure, scalars, x),
        compute_stage_jacobian(vehicle, cases, coasting, procedure, scalars, x),
        build_smoothness_rows(scalars, procedure),
    ]
    return [np.vstack(rows)]


def summarise_information(
    information: Floats,
    scalars: Sequence[CalibrationScalar],
    values: Floats,
    units: Sequence[str],
    widths: Floats,
) -> Identifiability:
    """Return standard deviations, correlations and the weakest direction that follow from an information matrix.

    Parameters
    ----------
    information : of scalars in units of their prior's standard deviation, prior included, shape (n, n) [1]
    scalars, units : the n scalars and their units
    values : calibrated values, shape (n,) [unit]
    widths : distances between the bounds, shape (n,) [unit]
    """
    prior_sd = widths / np.sqrt(12.0)
    covariance = np.linalg.inv(information)
    share = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(share, share)
    alone = 1.0 / np.sqrt(np.diag(information))
    eigenvalues, vectors = np.linalg.eigh(information)
    names = [s.name for s in scalars]
    pairs = [
        (names[i], names[j], float(correlation[i, j]))
        for i in range(len(names))
        for j in range(i + 1, len(names))
        if abs(correlation[i, j]) >= CONFOUNDED
    ]
    weakest = {n: float(w**2) for n, w in zip(names, vectors[:, 0], strict=True) if w**2 > 0.1}
    return Identifiability(
        scalars=tuple(
            ScalarKnowledge(
                name=name, value=float(value), unit=unit, sd=float(s * sd), sd_alone=float(a * sd),
                share_of_prior=float(s), determined=bool(s < DETERMINED),
            )
            for name, value, unit, s, a, sd in zip(names, values, units, share, alone, prior_sd, strict=True)
        ),
        confounded=tuple(sorted(pairs, key=lambda pair: -abs(pair[2]))),
        eigenvalues=tuple(float(e) for e in eigenvalues[::-1]),
        weakest=weakest,
    )  # fmt: skip
