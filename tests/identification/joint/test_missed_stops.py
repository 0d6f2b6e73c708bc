"""A verdict says where held-out stops are missed by more than the noise of their speed, whatever it names."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.campaign.campaign import CHANNELS
from tasks.identification.decision.missed import compare_with_noise, tell_miss
from tasks.identification.joint import verdict
from tests.identification.joint.known_car import FEW, RULES, campaign_of, judge_car, slow_brakes


def test_no_claim_that_nothing_is_missing_stands_beside_a_stop_that_is_missed():
    calm, strong = campaign_of({}), campaign_of({"pressure_gain": 0.8})
    outcome = judge_car(replace(calm, runs=(*calm.runs[:-1], strong.runs[-1])), numbers=FEW)
    why = outcome.verdict.disagreement
    assert (
        outcome.verdict.verdict == "NOTHING" and outcome.verdict.misses and outcome.verdict.reasons[0] == why
    )
    missed = outcome.verdict.error["speed"].after
    assert why.startswith(f"the speed of the held-out runs is missed by {missed:.3g} m/s, ")
    assert compare_with_noise(calm, outcome.verdict.error) == pytest.approx(missed / 0.03, rel=0.2)


def test_noise_is_no_larger_than_what_a_fit_leaves_on_its_training_runs(monkeypatch):
    """At 5 Hz whole stops counted as noise: nothing was missed beside 0.9 m/s."""
    campaign, error = campaign_of({}), slow_brakes().verdict.error
    noise = error["speed"].after / compare_with_noise(campaign, error)
    for follows, taken in ((0.5 * noise, 0.5 * noise), (2.0 * noise, noise)):
        assert compare_with_noise(campaign, error, follows) == pytest.approx(error["speed"].after / taken)
    assert not judge_car(campaign).verdict.disagreement
    monkeypatch.setattr(verdict, "measure_misfit", lambda *_: np.full(len(CHANNELS), 0.1 * noise))
    assert judge_car(campaign).verdict.disagreement.startswith("the speed of the held-out runs is missed by")


def test_a_stop_that_is_missed_beside_a_name_is_told():
    assert not any("is missed by" in reason for reason in slow_brakes().verdict.reasons)
    late, windy = campaign_of({"lag": 0.2}), campaign_of({"lag": 0.2, "drag_area": 3.0})
    outcome = judge_car(replace(late, runs=(*late.runs[:-1], windy.runs[-1])), numbers=FEW)
    assert outcome.verdict.effects and outcome.verdict.disagreement == ""
    said = "what is named is not all that the model lacks"
    *_, missed, driver = outcome.verdict.reasons
    assert missed.endswith(said)
    assert driver.startswith("no channel says what drove the car before the brake")
    assert driver not in slow_brakes().verdict.reasons
    logged = [
        replace(run, drive_torque=np.zeros(len(run.pressure))) for run in (*late.runs[:-1], windy.runs[-1])
    ]
    told = judge_car(replace(late, runs=tuple(logged)), numbers=FEW).verdict
    assert told.misses and driver not in told.reasons
    # why single effects could not be told does not say that these stops are missed
    foreign = replace(outcome.verdict, reasons=("the runs disagree",), disagreement="the runs disagree")
    assert tell_miss(foreign, late, RULES.joint.foreign_misfit).reasons[-1].endswith(said)
    nothing = replace(foreign, effects=())
    assert tell_miss(nothing, late, RULES.joint.foreign_misfit) is nothing


def test_a_stop_that_is_just_missed_is_not_told_by_the_limit_itself():
    campaign, told = campaign_of({}), slow_brakes().verdict
    speed = told.error["speed"]
    noise = speed.after / compare_with_noise(campaign, told.error)
    missed = replace(told, error={**told.error, "speed": replace(speed, after=5.3 * noise)})
    assert "5.3 times its noise (at most 5)" in tell_miss(missed, campaign, 5.0).reasons[-1]
