"""What drives and holds a car and no channel tells: a slope that all runs share, and when the driver lifts."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import Campaign
from tasks.identification.joint import verdict
from tasks.identification.joint.numbers import measure_peak_deceleration
from tasks.vehicle.effects.table import build_parameter_vector
from tests.identification.joint.known_car import campaign_of, judge_car, named_intervals, own_channels
from tests.identification.synthetic import VEHICLE, measured


def driven_campaign(earlier: float, *, logged: bool) -> Campaign:
    """Slow brakes of a car that is driven with 1 m/s2 until its driver lifts [s before he brakes]."""
    flat, runs = campaign_of({}), []
    for i, run in enumerate(flat.runs):
        braked = int(np.flatnonzero(run.pressure > 0.05)[0])
        late = (np.arange(len(run.pressure)) - braked) * run.interval + earlier
        pushed = np.clip(0.5 - late / 0.2, 0.0, 1.0)
        pulled = replace(run, drive_torque=VEHICLE.mass * VEHICLE.wheel_radius * pushed)
        driven = measured(pulled, build_parameter_vector({"lag": 0.15}), 70 + i).run
        seen = own_channels(driven, flat.channels, run.held_out)
        runs.append(replace(seen, drive_torque=None, throttle=pushed if logged else None))
    return replace(flat, runs=tuple(runs))


@pytest.mark.parametrize("earlier", [-0.1, 0.1])
def test_a_lag_is_no_surer_than_when_the_driver_lifts_where_no_throttle_was_logged(earlier: float):
    """A racing car's lag of 0.12 s had the interval [0.085, 0.10]."""
    numbers = [n for n in load_joint_numbers() if n.name in {"pressure_gain", "lag"}]
    outcome = judge_car(driven_campaign(earlier, logged=False), numbers=numbers)
    low, value, high = named_intervals(outcome)["brake_lag"]
    assert low < 0.15 < high and 0.01 < abs(value - 0.15) < outcome.fitted.delay_doubt
    shares = [1.0 / measure_peak_deceleration(stop.model) for stop in outcome.train]
    assert outcome.fitted.delay_doubt == pytest.approx(0.1 * float(np.median(shares)), rel=0.2)
    errors = dict(zip(outcome.fitted.by_name, outcome.errors, strict=True))
    assert errors["lag"] > outcome.fitted.delay_doubt
    sure = judge_car(driven_campaign(earlier, logged=True), numbers=numbers)
    assert named_intervals(sure)["brake_lag"][1] == pytest.approx(0.15, abs=0.005)
    assert sure.fitted.delay_doubt == 0.0


def hilly_campaign(common: float, tolerance: float = 0.01, lag: float = 0.0) -> Campaign:
    """Runs on three slopes, of which an import knows all but what they have in common [rad]."""
    flat, slopes = campaign_of({}), (-0.01, 0.0, 0.02)
    runs = []
    for i, (run, slope) in enumerate(zip(flat.runs, slopes, strict=True)):
        steep = replace(run, felt_slope=slope + common)
        driven = measured(steep, build_parameter_vector({"lag": lag}), 70 + i).run
        seen = own_channels(driven, flat.channels, run.held_out)
        runs.append(replace(seen, felt_slope=slope))
    session = (*flat.tolerances.session[:-1], tolerance)
    return replace(flat, runs=tuple(runs), tolerances=replace(flat.tolerances, session=session))


BRAKES_AND_ROAD = tuple(
    n for n in load_joint_numbers() if n.name in {"pressure_gain", "lag", "push_out", "slope"}
)


def test_what_all_felt_slopes_have_in_common_is_the_roads_and_no_fault_of_the_brakes():
    """A car that lacked nothing had a dead band of 0.11 MPa, for its runs were on slopes 1.5 % lower than taken."""
    outcome = judge_car(hilly_campaign(-0.012), numbers=BRAKES_AND_ROAD)
    assert outcome.verdict.verdict == "NOTHING"
    assert outcome.fitted.by_name["slope"] == pytest.approx(-0.012, abs=0.002)
    assert outcome.fitted.by_name["pressure_gain"] == pytest.approx(0.0, abs=0.02)
    # re-tuning moves what is no name
    steeper = judge_car(hilly_campaign(0.012), numbers=BRAKES_AND_ROAD).verdict.error["speed"]
    assert steeper.retuned == pytest.approx(steeper.after, rel=1e-3)
    unknown = judge_car(hilly_campaign(-0.012), numbers=[n for n in BRAKES_AND_ROAD if n.name != "slope"])
    assert abs(unknown.fitted.by_name["pressure_gain"]) > 0.03 or len(unknown.fitted.by_name) > 1


def test_a_common_slope_that_would_be_steeper_than_two_tolerances_is_none():
    """A force that holds a racing car back looks like a hill of 8 %: it is not one."""
    outcome = judge_car(hilly_campaign(-0.03), numbers=BRAKES_AND_ROAD)
    assert "slope" not in outcome.fitted.by_name
    assert any("the road's slope is off by -2" in reason for reason in outcome.verdict.reasons)


def test_a_re_tuned_slope_that_makes_up_for_a_name_is_given_up_at_its_bound_too(monkeypatch):
    retuned = []
    predict = verdict.predict_held_out
    monkeypatch.setattr(
        verdict, "predict_held_out", lambda runs, fit, grown: retuned.append(fit) or predict(runs, fit, grown)
    )
    outcome = judge_car(hilly_campaign(-0.008, tolerance=0.005, lag=0.3), numbers=BRAKES_AND_ROAD)
    assert {"slope", "lag"} <= outcome.fitted.by_name.keys()
    assert "slope" not in retuned[0].by_name
