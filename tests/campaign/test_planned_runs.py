"""The words of an experiment that a verdict proposes are those of the run that it plans."""

import re
from dataclasses import replace

import pytest

from tasks.campaign.channels import describe_brake
from tasks.campaign.planned_runs import RunPlan, make_planned_run, plan_experiments

GAIN = 2.389
"""Deceleration per brake pressure of the paper's car [m/s2/MPa]."""
EXPERIMENTS = plan_experiments(GAIN)


@pytest.mark.parametrize(("words", "plan"), EXPERIMENTS, ids=[words for words, _ in EXPERIMENTS])
def test_every_number_of_an_experiments_words_is_one_of_its_run(words: str, plan: RunPlan) -> None:
    said = {float(number) for number in re.findall(r"\d+(?:\.\d+)?", words)}
    _, length, height = plan.hazard
    assert said <= {plan.speed, plan.rate, plan.duration, length, round(1000 * height, 6)}
    assert plan.speed in said
    assert ("hot" in words) == (plan.disc_rise > RunPlan(speed=1.0, peak=0.0).disc_rise)
    assert plan.weather == next((kind for kind in ("rain", "snow") if kind in words), "dry")


def test_a_car_with_weaker_brakes_is_asked_for_more_pressure_and_the_same_stops() -> None:
    for (words, plan), (_, weak) in zip(EXPERIMENTS, plan_experiments(0.3 * GAIN), strict=True):
        assert weak.peak == pytest.approx(plan.peak / 0.3, abs=0.2)
        assert replace(weak, peak=plan.peak) == plan, words
    assert [abs(plan.peak) for _, plan in EXPERIMENTS] == [0.0, 0.0, 2.4, 2.4, 0.6, 2.4, 2.6, 2.0, 0.0]


def test_a_stop_is_asked_for_by_the_signal_that_the_driver_sees() -> None:
    signals = ("brake_pressure", "brake_command", "pedal_force", "v")
    said = ["2.4 MPa", "0.24 of the brake command", "120 N of the pedal force", "2.4 MPa"]
    assert [describe_brake(2.4, signal) for signal in signals] == said


@pytest.mark.parametrize("interval", [0.01, 0.05])
def test_a_plan_is_the_same_run_at_any_rate(interval: float) -> None:
    run = make_planned_run(RunPlan(speed=30.0, peak=2.0, duration=6.0), "stop", interval=interval)
    assert run.interval == interval and len(run.pressure) == len(run.response) == round(6.0 / interval)
    assert run.pressure[round(1.15 / interval)] == pytest.approx(1.0)
