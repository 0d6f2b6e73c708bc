"""Which search judges a campaign: by what is known of the car, whether its runs agree, and what predicts better."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.answer import Verdict
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.decision.verdict import SearchOutcome
from tasks.identification.joint import two_searches
from tasks.identification.joint.two_searches import judge_by_two_searches, measure_error_from_brake
from tasks.identification.joint.verdict import JointOutcome
from tests.identification.joint.known_car import RULES, SURFACE, VEHICLE, campaign_of, slow_brakes

NOISE, LIMIT, SHARE = 0.03, RULES.joint.foreign_misfit, RULES.joint.better_prediction_share
CAMPAIGN = campaign_of({})
"""Its speed has a noise of `NOISE`."""


def make_verdict(error: float, names: bool = False) -> Verdict:
    """A verdict whose speed misses held-out runs by an error [m/s]."""
    told = slow_brakes().verdict
    return replace(
        told, effects=told.effects[:1] if names else (), verdict="FOUND" if names else "NOTHING",
        error={"speed": replace(told.error["speed"], after=error)}, reasons=("as it was",), disagreement="",
    )  # fmt: skip


def off_by(error: float, verdict: Verdict, before: float = 0.0) -> JointOutcome:
    """A joint fit whose speed is off by an error from the brake on, and by another one before it [m/s]."""
    told = slow_brakes()
    predicted = []
    for stop, readings in zip(told.held_out, told.predicted, strict=True):
        off = np.where(np.arange(stop.model.samples) < stop.onset - 10, before, error)
        moved = readings.copy()
        moved[-1, :, 0] = stop.model.measured[:, 0] + off
        predicted.append(moved)
    return replace(told, verdict=verdict, predicted=tuple(predicted))


@dataclass(frozen=True, kw_only=True)
class SingleOutcome(SearchOutcome):
    """A verdict on single effects whose speed is off by an error [m/s]."""

    off: float

    def predict_readings(self, runs):
        return [run.model.measured + self.off for run in runs]


def judge_answers(
    monkeypatch,
    single: Verdict | Exception,
    joint: Verdict,
    *,
    says_little: bool = False,
    stops_off: float | None = None,
) -> tuple[SearchOutcome | JointOutcome, list[tuple[str, bool]]]:
    """The verdict where both searches answer so; why joint fits were asked for, and if numbers alone may be named."""
    asked: list[tuple[str, bool]] = []

    def find_one(*_: object) -> SearchOutcome:
        if isinstance(single, Exception):
            raise single
        judged = [SimpleNamespace(model=stop.model) for stop in slow_brakes().held_out]
        start = SimpleNamespace(evidence=SimpleNamespace(held_out=judged))
        off = single.error["speed"].after if stops_off is None else stops_off
        return SingleOutcome(verdict=single, start=start, end=start, compared=(), off=off)

    def fit_all(*_: object, disagreement: str, names_numbers: bool) -> JointOutcome:
        asked.append((disagreement, names_numbers))
        return off_by(joint.error["speed"].after, joint)

    monkeypatch.setattr(two_searches, "needs_joint_fit", lambda *_: says_little)
    monkeypatch.setattr(two_searches, "find_effects_in_two_looks", find_one)
    monkeypatch.setattr(two_searches, "judge_jointly", fit_all)
    return judge_by_two_searches(CAMPAIGN, VEHICLE, SURFACE, (), (), RULES), asked


def test_a_car_that_is_hardly_known_and_runs_that_disagree_are_left_to_the_joint_fit(monkeypatch):
    foreign = ForeignCarError("the runs disagree")
    for single, says_little, why in ((make_verdict(0.0), True, ""), (foreign, False, "the runs disagree")):
        outcome, asked = judge_answers(monkeypatch, single, make_verdict(1.0), says_little=says_little)
        assert isinstance(outcome, JointOutcome) and asked == [(why, True)]


def test_stops_that_are_followed_are_left_to_the_single_search_and_a_name_leaves_more_than_nothing_named(
    monkeypatch,
):
    """Right names leave up to 15 times the noise; a dead time of 0.013 s stood beside stops missed by 10 m."""
    for most, names in ((LIMIT, False), (RULES.joint.questioned_misfit, True)):
        for share, by_both in ((0.8, False), (1.2, True)):
            outcome, asked = judge_answers(
                monkeypatch, make_verdict(share * most * NOISE, names), make_verdict(0.0)
            )
            assert isinstance(outcome, JointOutcome) is by_both and len(asked) == by_both
            named = outcome.verdict.reasons[0].split(" names ")[-1].split(" and ")[0]
            assert named == ("brake_lag" if names else "nothing") or not by_both


@pytest.mark.parametrize(("pull", "by_both"), [(-3.9, False), (3.9, False), (-4.1, True), (4.1, True)])
def test_a_name_that_stands_on_a_session_far_off_its_tolerances_is_held_against_a_joint_fit(
    monkeypatch, pull: float, by_both: bool
):
    """A racing car's lag of 0.12 s was a dead time of 0.075 s beside a road that fell by eight tolerances."""
    for share, missed in ((0.8, False), (1.2, True)):
        named = make_verdict(share * LIMIT * NOISE, names=True)
        single = replace(named, session_pulls={"slope": (0.0, pull), "mass": (9.0, 0.0)})
        outcome, asked = judge_answers(monkeypatch, single, make_verdict(0.0))
        assert isinstance(outcome, JointOutcome) is (by_both and missed) is bool(asked)


@pytest.mark.parametrize(("share", "is_better"), [(0.99 * SHARE, True), (1.01 * SHARE, False)])
def test_where_nothing_is_named_and_stops_are_missed_the_better_prediction_counts(
    monkeypatch, share, is_better
):
    """A log of 10 Hz whose driver held his speed: nothing beside a metre, where the joint fit saw its pads."""
    missed = 2.0 * LIMIT * NOISE
    outcome, asked = judge_answers(
        monkeypatch, make_verdict(missed), make_verdict(share * missed, names=True)
    )
    assert isinstance(outcome, JointOutcome) is is_better and asked == [("", False)]
    if is_better:
        reason, *rest = outcome.verdict.reasons
        assert (
            f"leaves an error of {missed:.3g} m/s" in reason and f"one of {share * missed:.3g} m/s" in reason
        )
        # the car is the model's, with other numbers: nothing says that its runs disagree
        assert rest == ["as it was"] and outcome.verdict.disagreement == ""
    else:
        assert outcome.verdict.misses and "is missed by" in outcome.verdict.disagreement
        assert f"leaves an error of {share * missed:.3g} m/s" in outcome.verdict.reasons[-1]


def test_a_quiet_second_before_the_brake_makes_no_prediction_better(monkeypatch):
    """A joint fit fits what precedes the brake, so that a single search would have a smaller error by that alone."""
    missed = 2.0 * LIMIT * NOISE
    outcome, _ = judge_answers(
        monkeypatch, make_verdict(0.7 * missed), make_verdict(0.72 * missed, names=True), stops_off=missed
    )
    assert (
        isinstance(outcome, JointOutcome)
        and f"leaves an error of {missed:.3g} m/s" in outcome.verdict.reasons[0]
    )


def test_errors_are_measured_from_the_brake_on_and_where_the_speed_was_sampled():
    models, share = [stop.model for stop in slow_brakes().held_out], RULES.joint.brake_onset_share
    for before in (0.0, 5.0):
        readings = [y[-1] for y in off_by(0.2, slow_brakes().verdict, before).predicted]
        assert measure_error_from_brake(models, readings, share) == pytest.approx(0.2)
    (stop,) = slow_brakes().held_out
    sampled = np.arange(stop.model.samples)[:, np.newaxis] < np.full(7, stop.onset - 20)
    silent = replace(stop.model, run=replace(stop.model.run, sampled=sampled))
    assert measure_error_from_brake([silent], readings, share) == np.inf


def test_a_miss_is_told_beside_a_name_too(monkeypatch):
    outcome, _ = judge_answers(monkeypatch, make_verdict(2.0 * LIMIT * NOISE, names=True), make_verdict(0.0))
    assert outcome.verdict.misses and outcome.verdict.reasons[-1].endswith("not all that the model lacks")


def test_a_miss_is_measured_by_the_noise_of_whole_runs(monkeypatch):
    """A stop that is cut at its brake has no quiet part: its braking passed for noise of 0.9 m/s."""
    seen = []

    def tell(verdict: Verdict, campaign: Campaign, limit: float) -> Verdict:
        seen.append((campaign, limit))
        return verdict

    monkeypatch.setattr(two_searches, "tell_miss", tell)
    judge_answers(monkeypatch, make_verdict(0.0), make_verdict(0.0))
    assert seen == [(CAMPAIGN, LIMIT)]
