"""A verdict says where held-out stops are missed by more than their noise, whatever is named."""

from dataclasses import replace

import pytest

from catalogs.entries import load
from tasks.identification.decision.answer import ChannelError, Verdict
from tasks.identification.decision.verdict import report_miss
from tests.flows.measured.findings import found_effect, verdict_of

LAG = found_effect(next(e for e in load("library of effects") if e.name == "brake_lag"), {"lag": 0.08})


def missing(error: float, verdict: Verdict) -> Verdict:
    """A verdict on stops whose speed is missed by an error beside a noise of 0.02 m/s."""
    speed = ChannelError(
        frozen=1.0, retuned=1.0, after=error, ci_low=0.0, ci_high=1.0, change_low=-1.0, change_high=0.0, wins=1,
        worst_run="r", unit="m/s",
    )  # fmt: skip
    return report_miss(replace(verdict, error={"speed": speed}, noise={"speed": (0.6, 0.02)}), 5.0)


@pytest.mark.parametrize(("error", "missed"), [(0.099, False), (0.101, True)])
def test_stops_that_are_missed_by_five_times_their_noise_lack_more_than_what_is_named(
    error: float, missed: bool
) -> None:
    told = missing(error, verdict_of(LAG))
    assert told.misses is missed and told.disagreement == ""
    assert any("what is named is not all that the model lacks" in reason for reason in told.reasons) is missed


def test_beside_no_name_they_contradict_the_model_and_what_contradicts_it_already_is_told_once() -> None:
    nothing = replace(verdict_of(), verdict="NOTHING")
    told = missing(0.3, nothing)
    assert told.misses and told.disagreement == told.reasons[0] and "15 times its noise" in told.disagreement
    foreign = replace(nothing, disagreement="the runs disagree")
    assert missing(0.3, foreign).disagreement == "the runs disagree" and not missing(0.3, foreign).misses
