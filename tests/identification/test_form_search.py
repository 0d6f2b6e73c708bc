"""Forms outside the library: which are named beside effects, and beside which the disturbances are scaled."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from tasks.identification.decision import discovery, form_search
from tasks.identification.decision.attribution import Candidate
from tasks.identification.decision.search import Round, SearchState
from tasks.identification.decision.verdict import _choose_verdict_name

RULES = load_decision_rules()
RUNS = SimpleNamespace(rules=RULES, session_sigma=np.ones(7))


def make_candidate(name: str, kind: str, gain: float, score: float = 30.0) -> Candidate:
    return Candidate(
        hypothesis=SimpleNamespace(
            name=name, effect_class=kind, names=("a",), port="suspension_force", variable="suspension_speed"
        ),
        fitted=SimpleNamespace(at_bound=False), gain=gain, inflation=1.3, score=score, held_out_gain=11.0,
        cross_validated_gain=0.0, informed=5, rules=RULES,
    )  # fmt: skip


def make_state(effect: Candidate) -> SearchState:
    return SearchState(
        evidence=RUNS, base=None, rounds=(Round(base=None, tried=(), accepted=effect, evidence=RUNS),)
    )


@pytest.mark.parametrize(("gain", "kept"), [(50.0, False), (200.0, True)])
def test_a_form_beside_an_effect_that_makes_good_nearly_all_alone_is_not_named(
    gain: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    form = make_candidate("suspension_force ~ a tanh(4x)", "form", gain)
    monkeypatch.setattr(form_search, "_find_credible_form", lambda *_: (RUNS, form))
    monkeypatch.setattr(form_search, "find_best_form", lambda *_, **__: None)
    reasons: list[str] = []
    found, _ = form_search.search_forms(
        make_state(make_candidate("anti_dive", "effect", 900.0)), make_state(form), reasons
    )
    assert (len(found.rounds) == 2) is kept
    assert any("makes good 95% of the gain" in reason for reason in reasons) is not kept


@pytest.mark.parametrize(("variable", "kept"), [("suspension_speed", True), ("suspension_travel", False)])
def test_an_effect_of_a_forms_port_and_variable_that_was_tried_in_vain_is_held_against_it(
    variable: str, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    form = make_candidate("suspension_force ~ a tanh(4x)", "form", 200.0)
    tried = make_candidate("damper_asymmetry", "effect", 190.0, 12.0)
    tried.hypothesis.variable = variable  # type: ignore[misc]
    start = replace(make_state(form), rounds=(), tried=(tried,))
    monkeypatch.setattr(form_search, "_find_credible_form", lambda *_: (RUNS, form))
    found, _ = form_search.search_forms(start, start, [])
    assert found.rounds[-1].accepted is form
    assert (found.rounds[-1].tried == (tried,)) is kept


@pytest.mark.parametrize(
    ("kind", "port", "verdict"),
    [
        ("effect", "suspension_force", "SET"),
        ("effect", "friction", "UNKNOWN_FORM"),
        ("retune", "suspension_force", "UNKNOWN_FORM"),
        ("form", "suspension_force", "UNKNOWN_FORM"),
    ],
)
def test_a_form_whose_rival_the_library_holds_is_no_unknown_form(kind: str, port: str, verdict: str) -> None:
    form = SimpleNamespace(name="a tanh(4x)", effect_class="form", port="suspension_force", variable="speed")
    rival = SimpleNamespace(name="other", effect_class=kind, port=port, variable="speed")
    assert _choose_verdict_name([form], [(form.name, rival)]) == verdict  # type: ignore[list-item]
    assert _choose_verdict_name([form], [("another name", rival)]) == "UNKNOWN_FORM"  # type: ignore[list-item]


@pytest.mark.parametrize(("score", "added"), [(46.0, True), (19.0, False)])
def test_disturbances_are_scaled_beside_a_form_that_the_training_runs_show(
    score: float, added: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    form = make_candidate("friction ~ a exp(-(4x - 1)^2)", "form", 150.0, score)
    monkeypatch.setattr(discovery, "find_best_form", lambda *_, **__: form)
    explored = discovery._add_best_form(make_state(make_candidate("brake_lag", "effect", 900.0)), ())
    assert ([r.accepted for r in explored.rounds[1:]] == [form]) is added
    assert (explored.base is form.fitted) is added


@pytest.mark.parametrize(("share", "followed"), [(0.9, False), (1.1, True)])
def test_a_weak_linear_hint_leads_to_forms(
    share: float, followed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    needed = RULES.hopeful_share * (RULES.accept_score + np.log(1000.0))
    runs = SimpleNamespace(rules=RULES, samples=1000)
    form = make_candidate("friction ~ a exp(-(4x - 1)^2)", "form", 150.0)
    monkeypatch.setattr(form_search, "compute_inflation", lambda *_: 1.0)
    monkeypatch.setattr(
        form_search, "fit_residual_splines", lambda *_: [SimpleNamespace(gain=share * needed)]
    )
    monkeypatch.setattr(form_search, "make_form_hypotheses", lambda *_: [form.hypothesis])
    monkeypatch.setattr(form_search, "judge_hypothesis", lambda *_: form)
    monkeypatch.setattr(form_search, "is_session_number", lambda _: False)
    assert form_search.find_best_form(runs, None, gated=False) is (form if followed else None)
