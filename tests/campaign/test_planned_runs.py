"""The words of an experiment that a verdict proposes are those of the run that it plans."""

import re

import pytest

from tasks.campaign.planned_runs import EXPERIMENTS, RunPlan, make_planned_run


@pytest.mark.parametrize(("words", "plan"), EXPERIMENTS, ids=[words for words, _ in EXPERIMENTS])
def test_every_number_of_an_experiments_words_is_one_of_its_run(words: str, plan: RunPlan) -> None:
    said = {float(number) for number in re.findall(r"\d+(?:\.\d+)?", words)}
    _, length, height = plan.hazard
    driven = {plan.speed, abs(plan.peak), plan.rate, plan.duration, length, round(1000 * height, 6)}
    assert said <= driven
    assert {plan.speed, abs(plan.peak)} - {0.0} <= said
    assert ("hot" in words) == (plan.disc_rise > RunPlan(speed=1.0, peak=0.0).disc_rise)
    assert plan.weather == next((kind for kind in ("rain", "snow") if kind in words), "dry")


@pytest.mark.parametrize("interval", [0.01, 0.05])
def test_a_plan_is_the_same_run_at_any_rate(interval: float) -> None:
    run = make_planned_run(RunPlan(speed=30.0, peak=2.0, duration=6.0), "stop", interval=interval)
    assert run.interval == interval and len(run.pressure) == len(run.response) == round(6.0 / interval)
    assert run.pressure[round(1.15 / interval)] == pytest.approx(1.0)
