"""The search for one effect at a time judges a campaign; a car whose runs disagree goes to the joint fit."""

from types import SimpleNamespace

import pytest

from flows.measured import searches
from tasks.identification.decision.disputes import ForeignCarError


@pytest.mark.parametrize(
    ("hardly_known", "foreign", "judge"),
    [(False, False, "one"), (False, True, "joint"), (True, False, "joint")],
)
def test_the_search_is_chosen_by_what_is_known_and_by_whether_the_runs_agree(
    monkeypatch, hardly_known, foreign, judge
):
    def find(*_: object) -> str:
        if foreign:
            raise ForeignCarError
        return "one"

    monkeypatch.setattr(searches, "needs_joint_fit", lambda *_: hardly_known)
    monkeypatch.setattr(searches, "find_missing_effects", find)
    monkeypatch.setattr(searches, "judge_jointly", lambda *_: "joint")
    assert searches.judge_campaign(SimpleNamespace(), SimpleNamespace(), SimpleNamespace(), ()) == judge
