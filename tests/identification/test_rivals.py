"""When two explanations cannot be told apart on a model that is not exact."""

from types import SimpleNamespace

import pytest

from catalogs.decision_rules import load_decision_rules
from tasks.identification.decision.rivals import _is_as_wrong, is_close
from tasks.identification.decision.superseded import is_named

RULES = load_decision_rules()


def candidate(score: float, gain: float) -> SimpleNamespace:
    return SimpleNamespace(score=score, gain=gain, rules=RULES)


@pytest.mark.parametrize(
    ("score", "gain", "close"),
    [
        (124.0, 199.0, True),  # itself
        (115.0, 100.0, True),  # within the span of scores
        (95.0, 181.0, True),  # a rolling resistance beside a pad drag: 91 % of the gain
        (22.0, 134.0, False),
    ],
)
def test_a_rival_is_near_in_score_or_makes_good_most_of_the_gain(score: float, gain: float, close: bool):
    own = candidate(124.0, 199.0)
    assert is_close(own, 1.0, candidate(score, gain), 0.0) is close


def test_a_rival_that_wins_many_resamples_is_near_where_the_named_effect_wins_too_few():
    assert is_close(candidate(124.0, 199.0), 0.5, candidate(60.0, 100.0), 0.3)
    assert not is_close(candidate(124.0, 199.0), 0.9, candidate(60.0, 100.0), 0.3)


def test_a_named_effect_that_wins_just_the_share_that_is_asked_for_wins_enough():
    assert not is_close(candidate(124.0, 199.0), RULES.win_share, candidate(60.0, 100.0), 0.3)


@pytest.mark.parametrize(
    ("gain", "at_bound", "rival"), [(5.2, False, True), (5.2, True, False), (0.0, False, False)]
)
def test_a_number_that_looks_like_the_named_one_needs_no_score_to_be_its_rival(
    gain: float, at_bound: bool, rival: bool
) -> None:
    number = candidate(-3.7, gain)
    number.fitted = SimpleNamespace(at_bound=at_bound)
    assert _is_as_wrong(number) is rival


def test_a_form_is_no_rival_of_itself_where_the_effect_that_it_was_held_against_was_taken_back():
    form, effect = (SimpleNamespace(hypothesis=SimpleNamespace(name=n)) for n in ("form", "load_sensitivity"))
    assert is_named(form, [SimpleNamespace(own=form)])
    assert not is_named(form, [SimpleNamespace(own=effect)])
