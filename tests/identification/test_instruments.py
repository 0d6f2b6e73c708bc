"""What a fault of the log looks like exactly is told beside the name, for no search can tell the two apart."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.answer import NamedEffect, Parameter
from tasks.identification.decision.instruments import tell_like_instruments
from tests.identification.synthetic import TOLERANCES, plain_run


def named(name: str) -> NamedEffect:
    p = Parameter(name=name, value=0.1, ci_low=0.0, ci_high=1.0, lower=0.0, upper=1.0, unit="s")
    return NamedEffect(
        name=name, effect_class="effect", port="", variable="", parameters=(p,), score=0.0, gain=0.0,
        inflation=1.0, held_out_gain=0.0, cross_validated_gain=0.0, win_share=1.0,
    )  # fmt: skip


def campaign_at_rest(pressure: float, signal: str = "brake_pressure") -> Campaign:
    runs = [replace(plain_run(20.0, peak), name=f"run-{peak:g}") for peak in (1.0, 2.0, 3.0)]
    return Campaign(
        name="gauge", vehicle="paper-reference", tolerances=TOLERANCES, content_hash="", split_hash="",
        runs=tuple(replace(run, pressure=run.pressure + pressure * np.ones(400)) for run in runs), brake_signal=signal,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["push_out_pressure", "brake_fade"])
def test_a_gauge_that_rests_above_0_is_told_and_looks_like_pads_that_touch_late(name: str) -> None:
    (told,) = tell_like_instruments(campaign_at_rest(0.08), [named(name)], ())
    assert "rests at 0.080 MPa" in told and "offset: -0.080" in told
    assert ("touch look the same" in told) is (name == "push_out_pressure")
    assert tell_like_instruments(campaign_at_rest(0.0), [named(name)], ()) == []
    assert tell_like_instruments(campaign_at_rest(0.08, "brake_command"), [named(name)], ()) == []


def test_a_late_brake_is_told_to_look_like_a_late_clock_unless_the_speeds_own_delay_is_a_rival() -> None:
    campaign, late = campaign_at_rest(0.0), [named("brake_dead_time")]
    (told,) = tell_like_instruments(campaign, late, ["brake_lag"])
    assert "share a clock" in told
    assert tell_like_instruments(campaign, late, ["sensor_speed_delay"]) == []
    assert tell_like_instruments(campaign, [named("brake_lag")], ()) == []
