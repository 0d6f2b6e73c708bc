"""The search for one effect at a time judges a campaign; a car whose runs disagree goes to the joint fit."""

from types import SimpleNamespace

import pytest

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
