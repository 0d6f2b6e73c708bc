"""The search for one effect at a time judges a campaign; a car whose runs disagree goes to the joint fit."""

from types import SimpleNamespace

import pytest

from catalogs.effects import load_effects
from flows.measured import searches
from tasks.identification.decision.disputes import ForeignCarError


@pytest.mark.parametrize(
    ("says_little", "foreign", "judge"),
    [
        (False, False, "one"),
        (False, True, "joint, because the runs disagree"),
        (True, False, "joint, because "),
    ],
)
def test_the_search_is_chosen_by_what_is_known_and_by_whether_the_runs_agree(
    monkeypatch, says_little, foreign, judge
):
    def find_one(*_: object) -> str:
        if foreign:
            raise ForeignCarError("the runs disagree")
        return "one"

    monkeypatch.setattr(searches, "needs_joint_fit", lambda *_: says_little)
    monkeypatch.setattr(searches, "find_effects_in_two_looks", find_one)
    monkeypatch.setattr(searches, "judge_jointly", lambda *_, disagreement: f"joint, because {disagreement}")
    assert searches.judge_campaign(SimpleNamespace(), SimpleNamespace(), SimpleNamespace(), ()) == judge


def test_single_effects_leave_out_what_only_a_joint_fit_looks_for(monkeypatch):
    monkeypatch.setattr(searches, "needs_joint_fit", lambda *_: False)
    monkeypatch.setattr(searches, "find_effects_in_two_looks", lambda *given: {e.name for e in given[3]})
    asked = searches.judge_campaign(SimpleNamespace(), SimpleNamespace(), SimpleNamespace(), load_effects())
    left = {effect.name for effect in load_effects()} - asked
    assert left == {"retuned_wet_friction", "retuned_snow_friction", "engine_braking_gears"}
