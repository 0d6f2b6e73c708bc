"""A campaign is judged by rules, effects and numbers of the catalogues, by the joint fit where it asks for that."""

from types import SimpleNamespace

import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from catalogs.joint_numbers import load_joint_numbers
from flows.measured import searches


@pytest.mark.parametrize("says_little", [False, True])
def test_a_campaign_is_judged_by_the_whole_library_or_by_the_numbers_of_the_joint_fit(
    monkeypatch: pytest.MonkeyPatch, says_little: bool
) -> None:
    given = SimpleNamespace(), SimpleNamespace(), SimpleNamespace()
    monkeypatch.setattr(searches, "needs_joint_fit", lambda *_: says_little)
    for name in ("judge_runs", "judge_jointly"):
        monkeypatch.setattr(searches, name, lambda *asked, name=name: (name, *asked))
    judge, *same, looked_for, rules = searches.judge_campaign(*given, load_effects())
    assert tuple(same) == given and rules == load_decision_rules()
    if says_little:
        assert (judge, looked_for) == ("judge_jointly", load_joint_numbers())
    else:
        assert (judge, looked_for) == ("judge_runs", load_effects())
