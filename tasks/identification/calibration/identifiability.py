"""Identifiability of the calibrated scalars: which ones the reference runs determine, and which are confounded."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.identification.calibration.residual import CalibrationCase
from tasks.identification.calibration.scalars import CalibrationScalar, list_calibration_scalars, read_scalar
from tasks.identification.calibration.staged import (
    Procedure,
    Stage,
    build_smoothness_rows,
    compute_stage_jacobian,
)
from tasks.vehicle.parameters import Vehicle

Floats = NDArray[np.float64]
CONFOUNDED = 0.95
"""Correlation from which two scalars count as confounded [1]."""
DETERMINED = 0.5
"""Share of the prior's standard deviation below which a scalar counts as determined [1]."""


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
    determined : whether that share is below `DETERMINED`
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
    eigenvalues : eigenvalues of the prior-scaled Fisher information, descending; the bounds alone give 1 [1]
    weakest : direction of the smallest eigenvalue: share of each scalar with more than a tenth, by name [1]
    """

    scalars: tuple[ScalarKnowledge, ...]
    confounded: tuple[tuple[str, str, float], ...]
    eigenvalues: tuple[float, ...]
    weakest: dict[str, float]


def compute_identifiability(
    vehicle: Vehicle, cases: Sequence[CalibrationCase], procedure: Procedure
) -> Identifiability:
    """Return the identifiability of all scalars by their Fisher information over all cases.

    Bounds and smoothness are the prior. Every response of every case counts as one observation, whose standard
    deviation is the response's scale, because the residual of a deterministic model is one smooth curve per case and
    not thousands of independent samples.

    Parameters
    ----------
    vehicle : calibrated vehicle
    cases : development cases
    procedure : groups, bounds and scales
    """
    scalars = list_calibration_scalars(vehicle, procedure.groups)
    everything = Stage(
        name="all", groups=procedure.groups, responses=("speed", "pitch", "slip", "wheel_load", "stop"),
        kinds=("flat", "hump", "depression"), phase="event",
    )  # fmt: skip
    x = np.array([read_scalar(vehicle, s) for s in scalars])
    coasting = replace(everything, responses=("speed_drop",), phase="start")
    jacobian = np.vstack(
        [
            compute_stage_jacobian(vehicle, cases, everything, procedure, scalars, x),
            compute_stage_jacobian(vehicle, cases, coasting, procedure, scalars, x),
            build_smoothness_rows(scalars, procedure),
        ]
    )
    bounds = [procedure.bounds[s.group] for s in scalars]
    return summarise_jacobian(
        jacobian, scalars, x, [b.unit for b in bounds], np.array([b.upper - b.lower for b in bounds])
    )


def summarise_jacobian(
    jacobian: Floats,
    scalars: Sequence[CalibrationScalar],
    values: Floats,
    units: Sequence[str],
    widths: Floats,
) -> Identifiability:
    """Return standard deviations, correlations and the weakest direction that follow from a Jacobian.

    Parameters
    ----------
    jacobian : derivatives of residuals in units of their standard deviation, shape (m, n) [1 / unit]
    scalars, units : the n scalars and their units
    values : calibrated values, shape (n,) [unit]
    widths : distances between the bounds, shape (n,) [unit]
    """
    prior_sd = widths / np.sqrt(12.0)
    scaled = jacobian * prior_sd
    fisher = scaled.T @ scaled + np.eye(len(values))
    covariance = np.linalg.inv(fisher)
    share = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(share, share)
    alone = 1.0 / np.sqrt(np.diag(fisher))
    eigenvalues, vectors = np.linalg.eigh(fisher)
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
