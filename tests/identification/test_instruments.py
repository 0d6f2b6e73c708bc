"""What a fault of the log looks like exactly is told beside the name, for no search can tell the two apart."""

from dataclasses import replace

import pytest

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.answer import NamedEffect, Parameter
from tasks.identification.decision.instruments import find_resting_pressure, tell_like_instruments
from tests.identification.synthetic import TOLERANCES, plain_run


def named(name: str, value: float) -> NamedEffect:
    p = Parameter(name=name, value=value, ci_low=0.0, ci_high=1.0, lower=0.0, upper=1.0, unit="s")
    return NamedEffect(
        name=name, effect_class="effect", port="", variable="", parameters=(p,), score=0.0, gain=0.0,
        inflation=1.0, held_out_gain=0.0, cross_validated_gain=0.0, win_share=1.0,
    )  # fmt: skip


def campaign_at_rest(pressure: float) -> Campaign:
    runs = [plain_run(20.0, peak) for peak in (1.0, 2.0, 3.0)]
    return Campaign(
        name="gauge", vehicle="paper-reference", tolerances=TOLERANCES, content_hash="", split_hash="",
        runs=tuple(replace(run, pressure=run.pressure + pressure) for run in runs),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("rest", "push_out", "is_told"), [(0.08, 0.07, True), (0.0, 0.07, False), (0.08, 0.3, False)]
)
def test_a_pressure_that_rests_where_the_brakes_begin_to_act_may_be_the_gauges_zero(
    rest: float, push_out: float, is_told: bool
) -> None:
    campaign = campaign_at_rest(rest)
    assert find_resting_pressure(campaign) == pytest.approx(rest)
    told = tell_like_instruments(campaign, [named("push_out_pressure", push_out)], ())
    assert [("give the channel offset: -0.08" in sentence) for sentence in told] == [True] * is_told


def test_a_late_brake_is_told_to_look_like_a_late_clock_unless_the_speed_s_own_delay_is_a_rival() -> None:
    campaign, late = campaign_at_rest(0.0), [named("brake_dead_time", 0.1)]
    (told,) = tell_like_instruments(campaign, late, ["brake_lag"])
    assert "share a clock" in told
    assert tell_like_instruments(campaign, late, ["sensor_speed_delay"]) == []
    assert tell_like_instruments(campaign, [named("brake_lag", 0.1)], ()) == []
