"""A car that its file hardly knows has wide priors and the same engine: few runs, a command, a throttle."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from catalogs.entries import load
from tasks.campaign.campaign import CHANNELS, FILE_NUMBERS, SESSION, Campaign
from tasks.identification.decision.candidates import determines_curve
from tasks.identification.decision.verdict import Outcome, judge_runs
from tasks.identification.inference.driver import leave_out_driving
from tasks.identification.inference.forward import prepare_run
from tasks.identification.inference.noise import LEAST_NOISE, estimate_channel_noise
from tasks.identification.inference.start import GAIN, estimate_session, widen_tolerances
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import Vehicle
from tests.identification.synthetic import SURFACE, TOLERANCES, VEHICLE, measured, plain_run

RULES = load("set of decision rules")
FEW = ("brake_lag", "brake_dead_time", "push_out_pressure", "aerodynamic_drag", "retuned_pressure_gain")
LIBRARY = tuple(e for e in load("library of effects") if e.name in FEW)
STOPS = ((29.0, 0.9), (17.0, 2.0), (22.0, 2.0))
"""Speed [m/s] and brake pressure [MPa] of the runs; the last is held out."""
SEEN = np.isin(CHANNELS, ("speed", "longitudinal_acceleration"))


def campaign_of(truth: dict[str, float], tolerance: float = 0.2) -> Campaign:
    """Two stops and a held-out one of a car with other numbers than the file's, by speed and acceleration."""
    runs = []
    for i, (speed, pressure) in enumerate(STOPS):
        run = measured(plain_run(speed, pressure, name=f"run-{i}"), build_parameter_vector(truth), 70 + i).run
        runs.append(replace(run, response=np.where(SEEN, run.response, 0.0), held_out=i == len(STOPS) - 1))
    return Campaign(
        name="known", vehicle="paper-reference", runs=tuple(runs), content_hash="", split_hash="",
        channels=("speed", "longitudinal_acceleration"),
        tolerances=TOLERANCES.with_session({"pressure_gain": tolerance}),
    )  # fmt: skip


def judge(campaign: Campaign, vehicle: Vehicle = VEHICLE) -> Outcome:
    return judge_runs(campaign, vehicle, SURFACE, LIBRARY, RULES)


def start_of(campaign: Campaign, vehicle: Vehicle = VEHICLE) -> float:
    models = [prepare_run(run, vehicle, SURFACE) for run in campaign.train]
    return float(estimate_session(campaign, models, RULES)[GAIN])


@cache
def slow_brakes() -> Outcome:
    return judge(campaign_of({"pressure_gain": 0.3, "lag": 0.09}))


def test_two_stops_tell_a_lag_and_the_gain_is_calibrated_without_being_a_discovery() -> None:
    outcome = slow_brakes()
    (lag,) = outcome.verdict.effects
    assert lag.name == "brake_lag" and lag.parameters[0].ci_low < 0.09 < lag.parameters[0].ci_high
    (gain,) = [e.parameters[0] for e in outcome.calibrated if e.name == "retuned_pressure_gain"]
    assert gain.ci_low < 0.3 < gain.ci_high
    error = outcome.verdict.error["speed"]
    assert error.after < 0.5 * error.retuned


def test_a_gain_far_from_the_files_is_found_from_the_deceleration_per_pressure() -> None:
    weak = replace(VEHICLE, brake_gain=0.4 * VEHICLE.brake_gain)
    campaign = campaign_of({"pressure_gain": 0.3, "lag": 0.09}, tolerance=2.0)
    assert start_of(campaign, weak) == pytest.approx(1.3 / 0.4 - 1.0, rel=0.2)
    outcome = judge(campaign, weak)
    assert [e.name for e in outcome.verdict.effects] == ["brake_lag"]
    (gain,) = [e.parameters[0] for e in outcome.calibrated if e.name == "retuned_pressure_gain"]
    assert 0.4 * (1.0 + gain.value) == pytest.approx(1.3, abs=0.03)


def test_a_car_that_is_as_its_file_says_lacks_nothing() -> None:
    outcome = judge(campaign_of({}))
    assert outcome.verdict.verdict == "NOTHING" and not outcome.verdict.effects
    assert abs(outcome.fitted.session[GAIN]) < 0.02


def test_a_known_gain_starts_at_the_files_and_calibrates_nothing() -> None:
    known = campaign_of({"pressure_gain": 0.3}, tolerance=0.02)
    assert start_of(known) == 0.0 and start_of(campaign_of({"pressure_gain": 0.3})) > 0.2
    assert judge(known).calibrated == ()


def test_a_command_has_any_gain_and_grip_is_free_where_a_run_reaches_its_limit() -> None:
    gentle = campaign_of({}, tolerance=0.02)
    assert widen_tolerances(gentle, VEHICLE, SURFACE, RULES) == gentle
    command = widen_tolerances(replace(gentle, brake_signal="brake_command"), VEHICLE, SURFACE, RULES)
    assert command.tolerances.session[GAIN] == RULES.command_tolerance
    assert command.tolerances.grip == TOLERANCES.grip
    dry = replace(VEHICLE.families["dry"], efficiency=(0.2,))
    slicks = replace(VEHICLE, families={**VEHICLE.families, "dry": dry})
    limited = widen_tolerances(replace(gentle, brake_signal="brake_command"), slicks, SURFACE, RULES)
    assert limited.tolerances.grip == RULES.hardly_known_grip
    assert len(limited.tolerances.file_numbers) == len(FILE_NUMBERS) == len(SESSION) + 1


def test_a_run_begins_where_its_throttle_closes_and_starts_with_the_speed_before() -> None:
    (run, *_) = campaign_of({}).runs
    throttle = np.where(np.arange(len(run.pressure)) < 60, 0.4, 0.0)
    throttle[150] = 0.3  # a blip while the driver changes down
    one = replace(campaign_of({}), runs=(replace(run, throttle=throttle),))
    cut, drive = leave_out_driving(one, VEHICLE, SURFACE, RULES)
    (left,) = cut.runs
    assert drive == 0.0 and len(left.pressure) == len(run.pressure) - 60
    assert np.array_equal(left.pressure, run.pressure[60:]) and np.array_equal(
        left.speed_before, run.speed[:60]
    )
    start = prepare_run(left, VEHICLE, SURFACE).initial_speed
    assert start == pytest.approx(
        float(np.polyfit(np.arange(100), run.speed[:100], 1) @ (60.0, 1.0)), abs=0.02
    )


def test_one_stop_shows_no_curve_of_the_brake() -> None:
    models = [prepare_run(run, VEHICLE, SURFACE) for run in campaign_of({}).train]
    curve, lag = (next(e for e in LIBRARY if e.name == n) for n in ("push_out_pressure", "brake_lag"))
    assert [determines_curve(curve, models[:n]) for n in (1, 2)] == [False, True] and determines_curve(
        lag, models[:1]
    )


def test_no_sensor_is_quieter_than_a_model_is_right_and_one_signal_for_both_axles_counts_once() -> None:
    (run, *_) = campaign_of({}).runs
    both = run.response.copy()
    both[:, 2] = both[:, 3] = both[:, 0] / 0.33
    quiet = replace(
        campaign_of({}), runs=(replace(run, response=np.round(both, 9)),),
        channels=("speed", "wheel_speed_front", "wheel_speed_rear"),
    )  # fmt: skip
    sigma = estimate_channel_noise(quiet)[1]
    assert np.isinf(sigma[3]) and np.all(sigma[:3] >= LEAST_NOISE[:3])
