"""A campaign is judged by the rules, effects and numbers of the catalogues."""

from types import SimpleNamespace

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from catalogs.joint_numbers import load_joint_numbers
from flows.measured import searches


def test_single_effects_leave_out_what_only_a_joint_fit_looks_for(monkeypatch):
    given = SimpleNamespace(), SimpleNamespace(), SimpleNamespace()
    monkeypatch.setattr(searches, "judge_by_two_searches", lambda *asked: asked)
    *same, single, numbers, rules = searches.judge_campaign(*given, load_effects())
    assert tuple(same) == given and numbers == load_joint_numbers() and rules == load_decision_rules()
    left = {effect.name for effect in load_effects()} - {effect.name for effect in single}
    assert left == {"retuned_wet_friction", "retuned_snow_friction", "engine_braking_gears"}
