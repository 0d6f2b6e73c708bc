"""The search for one effect at a time judges a campaign; a car whose runs disagree goes to the joint fit."""

from types import SimpleNamespace

import pytest

from flows.measured import searches
from tasks.identification.decision.disputes import ForeignCarError


@pytest.mark.parametrize(
    ("says_little", "foreign", "judge"),
    [
        (False, None, "one"),
        (False, "find_single_effects", "joint"),
        (True, None, "joint"),
    ],
)
def test_the_search_is_chosen_by_what_is_known_and_by_whether_the_runs_agree(
    monkeypatch, says_little, foreign, judge
):
    def answer_as(name: str, answer: object) -> object:
        def answer_or_refuse(*_: object, **__: object) -> object:
            if foreign == name:
                raise ForeignCarError
            return answer

        return answer_or_refuse

    monkeypatch.setattr(searches, "needs_joint_fit", lambda *_: says_little)
    for name, answer in (("find_single_effects", "one"), ("judge_jointly", "joint")):
        monkeypatch.setattr(searches, name, answer_as(name, answer))
    assert searches.judge_campaign(SimpleNamespace(), SimpleNamespace(), SimpleNamespace(), ()) == judge
