"""Explanations that no search of one effect at a time meets: a wrong number beside it, two effects together."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from tasks.campaign.campaign import CHANNELS
from tasks.identification.decision import attribution, search
from tasks.identification.decision.alternatives import find_pairs, find_pulled_numbers
from tasks.identification.decision.answer import ChannelError
from tasks.identification.decision.attribution import Candidate, judge_hypothesis
from tasks.identification.decision.forms import ResidualSpline, is_session_number, make_form_hypotheses
from tasks.identification.decision.held_out import find_missed_channels, find_worse_channels, is_noticed
from tasks.identification.decision.rivals import (
    RivalComparison,
    compare_with_rivals,
    is_close_on_unseen_runs,
)
from tasks.identification.decision.search import Round, SearchState
from tasks.identification.decision.superseded import drop_superseded
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.derivatives import differentiate_run
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.inference.fit import Fit, compute_misfit_by_run, fit_hypotheses
from tasks.identification.inference.hypothesis import make_library_hypothesis
from tasks.vehicle.effects.table import EFFECT_TABLE, build_parameter_vector
from tests.identification.synthetic import NOISE, TOLERANCES, measured, plain_run

QUIET = Disturbance(scale=(5.0, 0.001, 5.0), time=(1.0, 0.3, 0.3))
NAMES = (
    "aerodynamic_drag",
    "pad_drag",
    "rolling_resistance_speed",
    "retuned_pressure_gain",
    "brake_fade",
    "brake_lag",
)
LIBRARY = {e.name: e for e in load_effects() if e.name in NAMES}


@cache
def evidence_of(**truth: float) -> tuple[Evidence, Fit]:
    theta = build_parameter_vector(truth)
    runs = [(32.0, 0.0, 1), (22.0, 0.0, -1), (28.0, 1.5, -1), (14.0, 0.0, 1), (15.0, 1.0, -1)]
    derived = tuple(
        differentiate_run(
            measured(plain_run(v, p, name=str(i), direction=d), theta, i), np.zeros(7), NOISE,
            np.zeros(len(EFFECT_TABLE)), tuple(LIBRARY.values()), TOLERANCES, QUIET,
        )
        for i, (v, p, d) in enumerate(runs)
    )  # fmt: skip
    evidence = Evidence(
        train=derived, held_out=derived[-2:], effects=tuple(LIBRARY.values()), tolerances=TOLERANCES,
        disturbance=QUIET, sensors=(np.zeros(7), NOISE), rules=load_decision_rules(),
    )  # fmt: skip
    return evidence, fit_hypotheses(derived, (), evidence.session_sigma)


def name_effect(
    evidence: Evidence, null: Fit, name: str, tried: tuple[str, str] = ("aerodynamic_drag", "pad_drag")
) -> tuple[SearchState, list[RivalComparison]]:
    """One name as if it had been found, beside two effects that were tried in its place."""

    def judge_effect(other: str) -> Candidate:
        return judge_hypothesis(evidence, null, None, make_library_hypothesis(LIBRARY[other]))

    own = judge_effect(name)
    others = tuple((judge_effect(other), 0.0) for other in tried if other != name)
    rounds = (Round(base=null, tried=(), accepted=own, evidence=evidence),)
    found = SearchState(evidence=evidence, base=own.fitted, rounds=rounds)
    return found, [RivalComparison(own=own, share=1.0, others=others, near=())]


def test_two_effects_that_together_explain_as_much_stand_beside_the_one_that_is_named() -> None:
    evidence, null = evidence_of(drag_area=0.8, pad_drag=60.0)
    pairs = find_pairs(*name_effect(evidence, null, "rolling_resistance_speed"))
    values = {other.candidate.hypothesis.name: other.candidate.fitted.values[-1] for other in pairs}
    assert values == {
        "aerodynamic_drag": pytest.approx(0.8, rel=0.3),
        "pad_drag": pytest.approx(60.0, rel=0.3),
    }
    assert "together" in pairs[0].reason


def test_two_effects_do_not_stand_beside_the_truth() -> None:
    evidence, null = evidence_of(rolling_speed=0.0009)
    assert find_pairs(*name_effect(evidence, null, "rolling_resistance_speed")) == []


def test_what_the_car_lacks_besides_makes_no_pair_with_a_worse_explanation() -> None:
    evidence, null = evidence_of(pad_drag=40.0, lag=0.1)
    found, compared = name_effect(evidence, null, "pad_drag", ("aerodynamic_drag", "brake_lag"))
    own, ((worse, _), (lag, _)) = compared[0].own, compared[0].others
    both = judge_hypothesis(evidence, worse.fitted, None, lag.hypothesis)
    assert worse.gain < own.gain < 0.5 * (null.objective - both.fitted.objective)
    assert find_pairs(found, compared) == []


@pytest.mark.parametrize(
    ("unseen", "close"), [((3, 3), True), ((0, 1), False), ((0, 3), True)], ids=["slow", "fast", "one fast"]
)
def test_unseen_runs_may_tell_a_rival_from_the_named_effect(unseen: tuple[int, ...], close: bool) -> None:
    evidence, _ = evidence_of(rolling_speed=0.0005)
    # one slow coast-down trains: there, speed says nothing
    evidence = replace(evidence, train=evidence.train[3:4], held_out=tuple(evidence.train[i] for i in unseen))
    null = fit_hypotheses(evidence.train, (), evidence.session_sigma)
    own, other = (
        judge_hypothesis(evidence, null, None, make_library_hypothesis(LIBRARY[name]))
        for name in ("rolling_resistance_speed", "pad_drag")
    )
    before = compute_misfit_by_run(evidence.held_out, null)
    assert is_close_on_unseen_runs(evidence, before, own, own)
    assert is_close_on_unseen_runs(evidence, before, own, other) is close


def test_a_number_that_stays_pulled_beyond_belief_stands_beside_what_is_named() -> None:
    evidence, null = evidence_of(pressure_gain=0.15)
    found, _ = name_effect(evidence, null, "brake_fade")
    (other,) = [
        a for a in find_pulled_numbers(found) if a.candidate.hypothesis.name == "retuned_pressure_gain"
    ]
    assert other.candidate.fitted.values[-1] == pytest.approx(0.15, abs=0.03)
    plain, null = evidence_of()
    assert find_pulled_numbers(name_effect(plain, null, "brake_fade")[0]) == []


class TestHeldOutChannels:
    ERROR = ChannelError(
        frozen=1.0, retuned=1.0, after=0.5, ci_low=0.4, ci_high=0.6, change_low=-0.6, change_high=-0.4, wins=5,
        worst_run="run", unit="1",
    )  # fmt: skip
    WORSE = replace(ERROR, after=1.2, change_low=0.1, change_high=0.3)

    def test_one_channel_does_not_veto_what_the_others_prove(self) -> None:
        error = dict.fromkeys(CHANNELS, self.ERROR) | {"vertical_acceleration": self.WORSE}
        assert find_worse_channels(error, 1.05) == []

    def test_the_speed_does(self) -> None:
        error = dict.fromkeys(CHANNELS, self.ERROR) | {"speed": self.WORSE}
        assert find_worse_channels(error, 1.05) == ["speed"]

    def test_a_channel_is_missed_where_retuning_predicts_it_much_better(self) -> None:
        error = dict.fromkeys(CHANNELS, self.ERROR)
        for ratio, missed in ((1.39, []), (1.41, ["longitudinal_acceleration"])):
            one = replace(self.ERROR, retuned=0.5, after=0.5 * ratio)
            assert find_missed_channels(error | {"longitudinal_acceleration": one}, 1.4) == missed
            assert find_missed_channels(error | {"pitch": one}, 1.4) == []

    def test_the_speed_does_not_where_the_effects_leave_it_alone(self) -> None:
        error = dict.fromkeys(CHANNELS, self.ERROR) | {"speed": self.WORSE}
        assert find_worse_channels(error, 1.05, speed_decides=False) == []

    def test_channels_that_are_worse_on_the_whole_do(self) -> None:
        error = {"speed": replace(self.ERROR, after=0.99), "pitch": self.WORSE}
        assert find_worse_channels(error, 1.05) == ["pitch"]

    def test_what_no_prediction_feels_is_not_noticed(self) -> None:
        before = {"speed": replace(self.ERROR, after=1.0), "pitch": replace(self.ERROR, after=0.5)}
        assert not is_noticed(before | {"pitch": replace(self.ERROR, after=0.495)}, before, 0.98)
        assert is_noticed(before | {"pitch": replace(self.ERROR, after=0.485)}, before, 0.98)


def test_what_was_named_first_goes_where_a_later_name_explains_it() -> None:
    evidence, null = evidence_of(drag_area=0.8)
    rolling = name_effect(evidence, null, "rolling_resistance_speed")[0]
    later = judge_hypothesis(
        evidence, rolling.base, None, make_library_hypothesis(LIBRARY["aerodynamic_drag"])
    )
    rounds = (*rolling.rounds, Round(base=rolling.base, tried=(), accepted=later, evidence=evidence))
    both = SearchState(evidence=evidence, base=later.fitted, rounds=rounds)
    left = drop_superseded(both, compare_with_rivals(evidence, both.base, rounds))
    assert left is not None and [p.name for p in left.base.parts] == ["aerodynamic_drag"]
    assert left.base.values == pytest.approx([0.8], rel=0.2)
    assert left.rounds[0].base.parts == () and left.rounds[0].accepted.score > evidence.rules.accept_score
    assert drop_superseded(left, compare_with_rivals(evidence, left.base, left.rounds)) is None


@pytest.mark.parametrize(
    ("port", "variable", "slope", "is_number"),
    [
        ("suspension_force", "suspension_speed", 1.0, True), ("suspension_force", "suspension_speed", 0.0, False),
        ("pitch_moment", "deceleration", 1.0, False),
    ],
)  # fmt: skip
def test_a_force_in_proportion_to_the_suspensions_speed_is_damping_and_no_form(
    port: str, variable: str, slope: float, is_number: bool
) -> None:
    grid = np.linspace(-0.6, 0.6, 5)
    values = 400.0 * (slope * grid / 0.6 + (1.0 - slope) * np.abs(grid))
    spline = ResidualSpline(
        port=port, variable=variable, grid=grid, values=values, covariance=np.eye(5), gain=100.0, score=50.0
    )
    assert is_session_number(make_form_hypotheses(spline, 10_000)[0]) is is_number


def test_a_fit_also_starts_from_a_session_at_rest_where_it_bends_to_make_up_for_what_is_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    evidence, null = evidence_of()
    begun: list[float] = []

    def follow(*arguments: Any, session: np.ndarray, **options: Any) -> Fit:
        begun.append(float(np.abs(session).max()))
        return fit_hypotheses(*arguments, session=session, **options)

    monkeypatch.setattr(attribution, "fit_hypotheses", follow)
    fade = make_library_hypothesis(LIBRARY["brake_fade"])
    judge_hypothesis(evidence, null, None, fade, 100.0)
    assert 0.0 not in begun
    bent = replace(null, session=null.session + 5.0 * evidence.session_sigma)
    judge_hypothesis(evidence, bent, None, fade, 100.0)
    assert 0.0 in begun


@pytest.mark.parametrize(
    ("gain", "chosen"), [(200.0, "rolling_resistance_speed"), (20.0, "aerodynamic_drag")]
)
def test_what_pulls_the_session_beyond_belief_gives_way_to_what_does_not_and_explains_enough(
    gain: float, chosen: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    evidence, null = evidence_of()

    def passing(name: str, score: float, gain: float, pull: float) -> Candidate:
        judged = judge_hypothesis(evidence, null, None, make_library_hypothesis(LIBRARY[name]))
        bent = replace(judged.fitted, values=np.array([0.0005]), session=pull * evidence.session_sigma)
        return replace(judged, fitted=bent, score=score, gain=gain, held_out_gain=50.0)

    tried = [
        passing("aerodynamic_drag", 200.0, 250.0, 5.0),
        passing("rolling_resistance_speed", 100.0, gain, 1.0),
    ]
    left = iter((tried, []))
    monkeypatch.setattr(search, "refine_candidates", lambda *arguments, **options: next(left))
    found = search.search_library(SearchState(evidence=evidence, base=null), gated=True)
    assert [r.accepted.hypothesis.name for r in found.rounds] == [chosen]
