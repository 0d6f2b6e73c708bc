"""What is told of the explanations that were weighed, and which of them the runs leave open."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from catalogs.entries import load
from tasks.identification.decision.candidates import Candidate
from tasks.identification.decision.odds import RunGrams, search_explanations
from tasks.identification.decision.open_explanations import OpenExplanation, list_open_explanations
from tasks.identification.rules import DecisionRules
from tests.identification.explained import effect_of, form_of, grams_of

RULES = replace(load("set of decision rules"), signature_error=0.0)
LAG, DRAG = effect_of("brake_lag", 0), effect_of("aerodynamic_drag", 1)


def open_explanations(
    candidates: Sequence[Candidate],
    design: NDArray[np.float64],
    values: Sequence[float],
    rules: DecisionRules = RULES,
) -> list[OpenExplanation]:
    """The explanations that runs of a car with these values leave open, without noise."""
    designs = [design] * 4
    grams: RunGrams = grams_of(candidates, designs, [x @ np.array(values) for x in designs])
    return list_open_explanations(grams, search_explanations(grams, most=2, width=8), rules)


def names(opened: Sequence[OpenExplanation]) -> list[set[str]]:
    return [set(one.names) for one in opened]


@pytest.mark.parametrize(("matters", "told"), [(2.5, {"brake_lag"}), (2.95, set()), (3.5, set())])
def test_a_member_is_told_where_it_is_surely_larger_than_what_matters(matters: float, told: set[str]) -> None:
    """A lag of 3 +- 0.05: that 2.95 is smaller has odds of 5 : 1, and that something is there e^1800."""
    opened = open_explanations([replace(LAG, matters=matters)], np.array([[10.0]]), [3.0])
    assert names(opened) == [told]
    assert opened[0].explanation.log_odds > 100.0


@pytest.mark.parametrize(
    ("log_prior", "told"), [(-7.0, {"brake_lag"}), (0.0, {"brake_lag", "aerodynamic_drag"})]
)
def test_the_simpler_of_two_explanations_is_told_unless_the_odds_speak_for_the_other(
    log_prior: float, told: set[str]
) -> None:
    """A drag of 4.5 standard errors gains 6.6 beside its slab: e^-7 before the runs leaves 0.7 : 1 for it."""
    drag = replace(DRAG, log_prior=log_prior, matters=0.1)
    opened = open_explanations([LAG, drag], np.diag([10.0, 2.25]), [3.0, 1.0])
    assert names(opened) == [told], "one that adds to the first is no other explanation"
    assert opened[0].log_odds == 0.0


def test_two_numbers_that_the_runs_hardly_tell_apart_are_both_open_with_their_odds() -> None:
    """Beside each other neither is certain nor needed, and yet it is not nothing."""
    push = effect_of("push_out_pressure", 1, log_prior=-1.0)
    alike = np.array([[10.0, 10.0], [0.0, 0.1]])
    opened = open_explanations([LAG, push], alike, [3.0, 0.0])
    assert names(opened) == [{"brake_lag"}, {"push_out_pressure"}]
    assert opened[1].log_odds == pytest.approx(-1.0, abs=0.3)
    apart = np.array([[10.0, 10.0], [0.0, 3.0]])
    assert names(open_explanations([LAG, push], apart, [3.0, 0.0])) == [{"brake_lag"}]


@pytest.mark.parametrize(
    ("miss", "signature_error", "told"),
    [
        (0.3, 0.01, {"pressure_nonlinearity"}),
        (6.0, 0.01, {"form brake_torque(pressure)"}),
        (6.0, 0.3, {"pressure_nonlinearity"}),  # as far off as the effect's signature in another car
    ],
)
def test_a_form_is_told_where_no_effect_of_the_library_is_as_likely(
    miss: float, signature_error: float, told: set[str]
) -> None:
    curve = effect_of("pressure_nonlinearity", 0)
    form = form_of("brake_torque", "pressure", (1, 2))
    # the form holds what the effect is, and what the effect misses
    design = np.array([[10.0, 10.0, 0.0], [0.0, 0.0, 10.0]])
    rules = replace(RULES, signature_error=signature_error)
    opened = open_explanations([curve, form], design, [0.0, 3.0, 0.1 * miss], rules=rules)
    assert names(opened) == [told], "nor is the form the rival of what it is without its law"


def test_of_laws_that_explain_as_much_as_a_form_the_simplest_is_told() -> None:
    """One run of four asks for a second member: the pair is as good as the form, and the first alone as the pair."""
    curve, push = effect_of("pressure_nonlinearity", 0), effect_of("push_out_pressure", 1)
    form = form_of("brake_torque", "pressure", (2, 3), log_prior=1.0)
    designs = [np.array([[10.0, 0.0, 10.0, 0.0], [0.0, size, 0.0, size]]) for size in (0.1, 0.1, 0.1, 5.0)]
    residuals = [design @ (3.0, 1.6, 0.0, 0.0) for design in designs]
    grams = grams_of([curve, push, form], designs, residuals)
    found = search_explanations(grams, most=2, width=8)
    assert [e.names for e in found[:2]] == [(form.name,), (curve.name, push.name)]
    assert names(list_open_explanations(grams, found, RULES)) == [{"pressure_nonlinearity"}]


def test_a_form_of_another_port_stands_beside_the_effect_that_it_cannot_be() -> None:
    lag, form = replace(LAG, log_prior=-4.0), form_of("friction", "speed", (1,), log_prior=-3.5)
    opened = open_explanations([lag, form], np.array([[10.0, 10.0]]), [3.0, 0.0])
    assert names(opened) == [{"brake_lag"}, {"form friction(speed)"}], "the effect first, whatever the odds"
