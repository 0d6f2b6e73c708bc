"""Stops of a car whose truth is known, and the verdict on it: what the tests of the joint fit start from."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from catalogs.decision_rules import load_decision_rules
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import CHANNELS, Campaign, Run
from tasks.identification.joint.fit import JointFit
from tasks.identification.joint.numbers import JointNumber
from tasks.identification.joint.verdict import JointOutcome, judge_jointly
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import Vehicle
from tests.identification.synthetic import SURFACE, TOLERANCES, VEHICLE, measured, plain_run

SPEED_AND_ACCELERATION = ("speed", "longitudinal_acceleration")
RULES = load_decision_rules()
NUMBERS = load_joint_numbers()
FEW = tuple(
    n
    for n in NUMBERS
    if n.name in {"pressure_gain", "lag", "drag_area", "rolling_coefficient", "engine_torque", "mass"}
)
"""For what follows from a name, and not for how it is found: all sixteen take twice as long."""
STOPS = ((29.0, 0.9), (17.0, 2.0), (22.0, 2.0))
"""Speed [m/s] and brake pressure [MPa] of the runs; the last is held out."""


def campaign_of(
    truth: dict[str, float], channels: tuple[str, ...] = SPEED_AND_ACCELERATION, engine: float | None = None
) -> Campaign:
    """Return runs of a car with other numbers than the file's; an engine holds it back once the brake is on."""
    runs = []
    for i, (speed, pressure) in enumerate(STOPS):
        run = shortened(plain_run(speed, pressure, name=f"run-{i}"))
        if engine is not None:
            run = replace(run, drive_torque=np.where(run.pressure > 0.0, engine, 0.0))
        runs.append(
            own_channels(
                measured(run, build_parameter_vector(truth), 70 + i).run, channels, i == len(STOPS) - 1
            )
        )
    return Campaign(
        name="known", vehicle="paper-reference", runs=tuple(runs), channels=channels, content_hash="", split_hash="",
        tolerances=replace(TOLERANCES, session=(0.2, *TOLERANCES.session[1:])),
    )  # fmt: skip


def shortened(run: Run) -> Run:
    """One second of braking, after one without, says as much of the brakes as three."""
    return replace(run, pressure=run.pressure[:200], response=run.response[:200])


def own_channels(run: Run, channels: tuple[str, ...], held_out: bool) -> Run:
    seen = np.array([name in channels for name in CHANNELS])
    return replace(run, response=np.where(seen, run.response, 0.0), held_out=held_out)


def judge_car(
    campaign: Campaign,
    vehicle: Vehicle = VEHICLE,
    rules: DecisionRules = RULES,
    numbers: Sequence[JointNumber] = NUMBERS,
) -> JointOutcome:
    return judge_jointly(campaign, vehicle, SURFACE, numbers, rules)


def fit_of(residuals: Sequence[np.ndarray], grids: Sequence[np.ndarray] | None = None) -> JointFit:
    """Return a fit of a lag whose derivative is 1 in every sample, of one channel where no grids are given.

    Nothing is known of it before.
    """
    (lag,) = (replace(n, sigma=1e6) for n in NUMBERS if n.name == "lag")
    return JointFit(
        numbers=(lag,), values=np.array([0.1]), offsets=np.zeros((len(residuals), 3)), cost=0.0,
        residuals=tuple(residuals), slopes=tuple(np.ones((len(r), 1)) for r in residuals),
        grids=tuple(grids or [np.ones((len(r), 1), dtype=bool) for r in residuals]),
        information=np.array([[sum(len(r) for r in residuals) + 1e-9]]), scales=np.ones(7), interval=0.01,
        delay_doubt=0.0,
    )  # fmt: skip


@cache
def slow_brakes() -> JointOutcome:
    return judge_car(campaign_of({"pressure_gain": 0.3, "lag": 0.09}))


def named_intervals(outcome: JointOutcome) -> dict[str, tuple[float, float, float]]:
    return {
        effect.name: (effect.parameters[0].ci_low, effect.parameters[0].value, effect.parameters[0].ci_high)
        for effect in (*outcome.verdict.effects, *outcome.calibrated)
    }
