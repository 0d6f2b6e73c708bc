"""A fault of the log that looks exactly like a named effect is told beside it, for no search can tell the two apart."""

from dataclasses import replace

import numpy as np

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.answer import NamedEffect, Parameter
from tasks.identification.decision.log_faults import describe_log_faults
from tests.identification.synthetic import TOLERANCES, plain_run


def make_effect(name: str) -> NamedEffect:
    p = Parameter(name=name, value=0.1, ci_low=0.0, ci_high=1.0, lower=0.0, upper=1.0, unit="s")
    return NamedEffect(
        name=name, effect_class="effect", port="", variable="", parameters=(p,), score=0.0, gain=0.0,
    )  # fmt: skip


def campaign_at_rest(pressure: float) -> Campaign:
    runs = [replace(plain_run(20.0, peak), name=f"run-{peak:g}") for peak in (1.0, 2.0, 3.0)]
    return Campaign(
        name="gauge", vehicle="paper-reference", tolerances=TOLERANCES, content_hash="", split_hash="",
        runs=tuple(replace(run, pressure=run.pressure + pressure) for run in runs),
    )  # fmt: skip


def test_a_gauge_that_drifts_is_told_and_a_zero_that_was_taken_off_is_too() -> None:
    drifting = campaign_at_rest(0.0)
    said = "channel brake_pressure rests at 0.000 (run-1) to 0.080 MPa (run-3)"
    assert describe_log_faults(replace(drifting, resting_gauge=said), (), ()) == [said]
    (told,) = describe_log_faults(replace(drifting, brake_rest=0.08), (), ())
    assert "rests at 0.080 MPa" in told and "begin would look the same" in told
    (told,) = describe_log_faults(replace(drifting, brake_rest=1.5, brake_signal="brake_command"), (), ())
    assert told.startswith("the brake command rests at 0.150 while the car")
    (told,) = describe_log_faults(replace(drifting, throttle_rest=0.155), (), ())
    assert told == "the throttle rests at 0.155 while the brake is applied: counted from there"
    assert describe_log_faults(drifting, (), ()) == []


def test_a_late_brake_is_told_to_look_like_a_late_clock_unless_the_speeds_own_delay_is_a_rival() -> None:
    campaign, late = campaign_at_rest(0.0), [make_effect("brake_dead_time")]
    (told,) = describe_log_faults(campaign, late, ["brake_lag"])
    assert "share a clock" in told
    assert describe_log_faults(campaign, late, ["sensor_speed_delay"]) == []
    assert describe_log_faults(campaign, [make_effect("brake_lag")], ()) == []


def test_a_fade_by_discs_that_nobody_measured_says_so() -> None:
    cold = campaign_at_rest(0.0)
    hot = replace(cold, runs=tuple(replace(run, disc_rise=310.0, braking_heat=2300.0) for run in cold.runs))
    (told,) = describe_log_faults(hot, [make_effect("brake_fade")], ())
    assert told.startswith("no disc temperature was measured: the runs begin up to 310 K above ambient")
    assert describe_log_faults(hot, [make_effect("brake_lag")], ["brake_fade"]) == [told]
    assert describe_log_faults(hot, [make_effect("brake_lag")], ()) == []
    assert describe_log_faults(cold, [make_effect("brake_fade")], ()) == []


def test_slopes_that_only_the_accelerometer_feels_are_told() -> None:
    flat = campaign_at_rest(0.0)
    hilly = replace(
        flat,
        runs=tuple(replace(run, felt_slope=s) for run, s in zip(flat.runs, (-0.01, 0.0, 0.02), strict=True)),
    )
    (told,) = describe_log_faults(hilly, (), ())
    assert told.startswith("no slope of the road was mapped") and "slopes of -1.0 to 2.0 %" in told
    mapped = tuple(replace(run, road_slope=np.zeros(len(run.pressure))) for run in hilly.runs)
    assert describe_log_faults(replace(hilly, runs=mapped), (), ()) == []
