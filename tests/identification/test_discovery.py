"""Forms outside the library: which are named beside effects, and beside which the disturbances are scaled."""

from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from tasks.identification.decision import discovery
from tasks.identification.decision.attribution import Candidate
from tasks.identification.decision.search import Round, SearchState

RULES = load_decision_rules()
RUNS = SimpleNamespace(rules=RULES, session_sigma=np.ones(7))


def judged(name: str, kind: str, gain: float, score: float = 30.0) -> Candidate:
    return Candidate(
        hypothesis=SimpleNamespace(name=name, effect_class=kind, names=("a",), port="suspension_force"),
        fitted=SimpleNamespace(at_bound=False), gain=gain, inflation=1.3, score=score, held_out_gain=11.0,
        cross_validated_gain=0.0, informed=5, rules=RULES,
    )  # fmt: skip


def named(effect: Candidate) -> SearchState:
    return SearchState(
        evidence=RUNS, base=None, rounds=(Round(base=None, tried=(), accepted=effect, evidence=RUNS),)
    )


@pytest.mark.parametrize(("gain", "kept"), [(50.0, False), (200.0, True)])
def test_a_form_beside_an_effect_that_makes_good_nearly_all_alone_is_not_named(
    gain: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    form = judged("suspension_force ~ a tanh(4x)", "form", gain)
    monkeypatch.setattr(discovery, "_find_credible_form", lambda *_: (RUNS, form))
    monkeypatch.setattr(discovery, "find_best_form", lambda *_, **__: None)
    reasons: list[str] = []
    found, _ = discovery.search_forms(named(judged("anti_dive", "effect", 900.0)), named(form), reasons)
    assert (len(found.rounds) == 2) is kept
    assert any("makes good 95% of the gain" in reason for reason in reasons) is not kept


@pytest.mark.parametrize(("score", "added"), [(46.0, True), (19.0, False)])
def test_disturbances_are_scaled_beside_a_form_that_the_training_runs_show(
    score: float, added: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    form = judged("friction ~ a exp(-(4x - 1)^2)", "form", 150.0, score)
    monkeypatch.setattr(discovery, "find_best_form", lambda *_, **__: form)
    explored = discovery._add_best_form(named(judged("brake_lag", "effect", 900.0)), ())
    assert ([r.accepted for r in explored.rounds[1:]] == [form]) is added
    assert (explored.base is form.fitted) is added
