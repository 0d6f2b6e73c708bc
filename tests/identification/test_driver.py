"""A driver who holds his speed until he brakes: told by the speed before the brake, which is then left out."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.campaign.campaign import CHANNELS, Campaign
from tasks.campaign.planned_runs import plan_experiments
from tasks.identification.decision import experiment
from tasks.identification.decision.verdict import judge_runs
from tasks.identification.inference.driver import begin_at_brake, find_brake_onset, measure_drive
from tasks.identification.inference.forward import (
    SENSED,
    compute_instrument_readings,
    prepare_run,
    simulate_run,
)
from tasks.vehicle.effects.grown import apply_effects
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector
from tests.identification.synthetic import NOISE, SURFACE, TOLERANCES, VEHICLE, plain_run

RULES = load("set of decision rules")
SHARE = RULES.brake_onset_share
RESISTANCE = {"drag_area": 0.8, "rolling_coefficient": 0.012}
KNOWN = apply_effects(VEHICLE, RESISTANCE)
"""The car of a file that knows its resistance."""
LAG = {"lag": 0.09}
NOTHING = np.zeros(len(EFFECT_TABLE))
STOPS = ((27.0, 1.2), (20.0, 2.0), (24.0, 1.6), (16.0, 1.8), (29.0, 1.9), (22.0, 1.3))
SEEN = np.isin(CHANNELS, ("speed", "longitudinal_acceleration"))


@pytest.fixture(scope="module", autouse=True)
def one_experiment():
    """No test asks for the next experiment: all but one of those that could be planned are left out."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "plan_experiments", lambda gain: plan_experiments(gain)[-1:])
        yield


def resist(speed: float) -> float:
    """Resistance over mass at a speed [m/s2]."""
    return 0.5 * 1.2 * 0.8 * speed**2 / KNOWN.mass + 0.012 * KNOWN.gravity


def make_campaign(effects, *, held: bool, seconds: float = 3.0) -> Campaign:
    """Stops of a car with resistance, coasting before the brake or with a torque that no channel shows."""
    rng, theta, runs = np.random.default_rng(4), build_parameter_vector(effects), []
    for i, (speed, pressure) in enumerate(STOPS):
        run = replace(plain_run(speed, pressure, name=f"run-{i}", seconds=seconds), held_out=i > 2)
        clear = prepare_run(run, KNOWN, SURFACE)
        torque = resist(speed) * KNOWN.mass * KNOWN.wheel_radius
        drive = held * torque * np.clip((0.95 - 0.01 * np.arange(len(run.pressure))) / 0.1, 0.0, 1.0)
        driven = replace(clear, run=replace(run, drive_torque=drive))
        simulated = simulate_run(driven, theta, initial_speed=speed)
        y = compute_instrument_readings(clear, theta, simulated.history[:, SENSED])
        y += NOISE * rng.standard_normal(y.shape)
        runs.append(replace(run, pressure=run.pressure[: len(y)], response=np.where(SEEN, y, 0.0)))
    return Campaign(
        name="stops", vehicle="paper-reference", runs=tuple(runs), tolerances=TOLERANCES, content_hash="",
        split_hash="", channels=("speed", "longitudinal_acceleration"),
    )  # fmt: skip


def measure(campaign: Campaign, car) -> float:
    return measure_drive([prepare_run(run, car, SURFACE) for run in campaign.runs], NOTHING, (), SHARE)


def test_a_held_speed_shows_the_force_that_the_model_would_lose_and_a_coasting_car_none():
    force = np.mean([resist(speed) for speed, _ in STOPS])
    assert measure(make_campaign({}, held=True), KNOWN) == pytest.approx(force, abs=0.05)
    assert abs(measure(make_campaign({}, held=False), KNOWN)) < 0.03


def test_runs_begin_as_the_foot_changes_to_the_brake_and_coasting_runs_stay_whole():
    campaign = make_campaign({}, held=True)
    coasting = replace(campaign.runs[0], pressure=np.zeros(len(campaign.runs[0].pressure)))
    over_hump = replace(campaign.runs[1], hazard_length=3.0)
    begun = begin_at_brake(
        replace(campaign, runs=(*campaign.runs[:2], coasting, over_hump)), KNOWN, SURFACE, SHARE
    )
    assert begun.runs[2] is coasting and begun.runs[3] is over_hump
    for whole, run in zip(campaign.runs[:2], begun.runs[:2], strict=True):
        onset = find_brake_onset(prepare_run(whole, KNOWN, SURFACE), SHARE)
        assert whole.pressure[onset - 1] <= SHARE * whole.pressure.max() < whole.pressure[onset]
        assert np.array_equal(run.response, whole.response[onset - 10 :])
        assert np.array_equal(run.pressure, whole.pressure[onset - 10 :])


def test_an_effect_of_the_brake_is_found_although_the_speed_was_held_and_the_verdict_says_from_where():
    library = tuple(
        e for e in load("library of effects") if e.name in ("brake_lag", "aerodynamic_drag", "pad_drag")
    )
    campaign = make_campaign(LAG, held=True)
    outcome = judge_runs(campaign, KNOWN, SURFACE, library, RULES)
    (found,) = outcome.verdict.effects
    assert found.name == "brake_lag"
    assert found.parameters[0].ci_low < LAG["lag"] < found.parameters[0].ci_high
    assert any("before the brake the car was driven with 0." in reason for reason in outcome.verdict.reasons)
    assert all(np.argmax(run.model.run.pressure > 0.0) < 10 for run in outcome.finding.evidence.train)
