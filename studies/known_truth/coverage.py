"""How often a calibration's scalars lie within two of their standard deviations of the truth."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catalogs.references import ReferenceCase
from studies.known_truth.traces import add_errors, draw_truth, make_known_cases
from tasks.identification.calibration.identifiability import (
    DETERMINED,
    compute_identifiability,
    compute_stage_equations,
    compute_stage_rows,
)
from tasks.identification.calibration.procedure import Procedure
from tasks.identification.calibration.residual import CalibrationCase, compute_residuals, simulate_case
from tasks.identification.calibration.scalars import list_calibration_scalars, read_scalar
from tasks.identification.calibration.staged import calibrate_vehicle
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Rollout

WITHIN = 2.0
"""Standard deviations within which an error counts as covered [1]."""


@dataclass(frozen=True, kw_only=True)
class ScalarOutcome:
    """One scalar of one draw.

    Parameters
    ----------
    name : name of the scalar
    error : fitted less true value over the standard deviation [1]
    determined : whether the report calls the scalar determined
    """

    name: str
    error: float
    determined: bool


@dataclass(frozen=True, kw_only=True)
class FitOutcome:
    """One calibration on one draw.

    Parameters
    ----------
    scalars : one outcome each
    confounded : pairs that the report names
    turns : passes until it converged
    """

    scalars: tuple[ScalarOutcome, ...]
    confounded: tuple[tuple[str, str, float], ...]
    turns: int


def fit_known_truth(
    start: Vehicle,
    conditions: Sequence[ReferenceCase],
    procedure: Procedure,
    interval: float,
    *,
    seed: int,
    errors: bool,
) -> FitOutcome:
    """Calibrate a vehicle on the traces of a drawn one, and compare.

    Parameters
    ----------
    start : vehicle that the fit starts from
    conditions : cases
    procedure, interval : procedure and spacing of its samples [s]
    seed : seed of truth and errors
    errors : whether the traces have errors
    """
    truth = draw_truth(start, procedure, seed)
    cases = make_known_cases(truth, conditions, procedure, interval)
    if errors:
        cases = add_errors(cases, procedure, seed)
    fitted, records = calibrate_vehicle(start, cases, procedure)
    report = compute_identifiability(fitted, cases, procedure)
    scalars = list_calibration_scalars(start, procedure.groups)
    outcomes = tuple(
        ScalarOutcome(
            name=known.name,
            error=(known.value - read_scalar(truth, s)) / known.sd,
            determined=known.determined,
        )
        for s, known in zip(scalars, report.scalars, strict=True)
    )
    return FitOutcome(scalars=outcomes, confounded=report.confounded, turns=records[-1].turn)


def refit_linearly(
    start: Vehicle,
    conditions: Sequence[ReferenceCase],
    procedure: Procedure,
    interval: float,
    *,
    seed: int,
    draws: int,
) -> list[ScalarOutcome]:
    """Return the scalars of many draws of the errors of one truth, refitted by the derivatives at the truth.

    Parameters
    ----------
    start, conditions, procedure, interval : as in ``fit_known_truth``
    seed : seed of the truth; the draws of errors go on from 1000 times it
    draws : draws of the errors
    """
    truth = draw_truth(start, procedure, seed)
    cases = make_known_cases(truth, conditions, procedure, interval)
    scalars = list_calibration_scalars(start, procedure.groups)
    limits = [procedure.bounds[s.group] for s in scalars]
    prior_sd = np.array([b.upper - b.lower for b in limits]) / np.sqrt(12.0)
    rows = [part * prior_sd for part in compute_stage_rows(truth, cases, procedure, scalars)]
    owned = [np.array([s.group in stage.groups for s in scalars]) for stage in procedure.stages]
    slope, spread = compute_stage_equations(rows, owned)
    inverse = np.linalg.inv(slope)
    share = np.sqrt(np.diag(inverse @ spread @ inverse.T))
    away = np.array([read_scalar(truth, s) - read_scalar(start, s) for s in scalars]) / prior_sd
    rides = [simulate_case(truth, case, procedure.mode, procedure.yardstick.margin_s) for case in cases]
    outcomes = []
    yardstick = procedure.yardstick
    for draw in range(draws):
        wrong = add_errors(cases, procedure, 1000 * seed + draw)
        equations = away.copy()
        for stage, jacobian, own in zip(procedure.stages, rows, owned, strict=True):
            residual = np.concatenate(
                [
                    compute_residuals(
                        *_subtract_errors(ride, case, other), stage.responses, stage.phase, yardstick
                    )
                    for ride, case, other in zip(rides, cases, wrong, strict=True)
                    if case.kind in stage.kinds
                ]
            )
            equations[own] += jacobian[: len(residual), own].T @ residual
        errors = -inverse @ equations / share
        outcomes += [
            ScalarOutcome(name=s.name, error=float(error), determined=bool(part < DETERMINED))
            for s, error, part in zip(scalars, errors, share, strict=True)
        ]
    return outcomes


def _subtract_errors(
    ride: Rollout, case: CalibrationCase, wrong: CalibrationCase
) -> tuple[Rollout, CalibrationCase]:
    """Return a run less a case's errors, so that the samples that count stay those of the case without errors."""
    time = ride.columns["t_ns"] * 1e-9
    errors = {
        "speed": wrong.speed - case.speed,
        "pitch": np.deg2rad(wrong.pitch - case.pitch),
        **{f"braking_slip_{axle}": (wrong.slip - case.slip)[0] for axle in "fr"},
        **{f"axle_load_{axle}": 2 * (wrong.wheel_load - case.wheel_load)[0] for axle in "fr"},
    }
    shifted = {name: ride.columns[name] - np.interp(time, case.time, error) for name, error in errors.items()}
    return (
        replace(ride, columns=ride.columns | shifted),
        replace(case, stopping_distance=wrong.stopping_distance),
    )


def format_coverage(outcomes: Iterable[ScalarOutcome]) -> str:
    """Return a table of the share of each scalar's draws that is covered, where it counts as determined.

    Parameters
    ----------
    outcomes : scalars of all draws
    """
    outcomes = list(outcomes)
    chosen = [o for o in outcomes if o.determined]
    counts, hits = Counter(o.name for o in chosen), Counter(o.name for o in chosen if abs(o.error) <= WITHIN)
    lines = [f"all determined: {sum(hits.values())} of {len(chosen)}, {sum(hits.values()) / len(chosen):.1%}"]
    for name in dict.fromkeys(o.name for o in outcomes):
        total = sum(o.name == name for o in outcomes)
        covered = f"{hits[name]} of {counts[name]}" if counts[name] else "-"
        size = np.sqrt(np.mean([o.error**2 for o in outcomes if o.name == name]))
        lines.append(
            f"{name:30s} determined in {counts[name]} of {total}, covered {covered}, rms error {size:.2f} sd"
        )
    return "\n".join(lines)
