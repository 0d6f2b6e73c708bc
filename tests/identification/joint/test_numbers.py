"""Which numbers a campaign can show follows from what its runs reach, by the rules of the catalogue."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import CHANNELS, SESSION, Campaign
from tasks.identification.inference.forward import RunModel, simulate_run
from tasks.identification.joint.numbers import (
    choose_numbers,
    coasts_down,
    free_numbers,
    measure_peak_deceleration,
)
from tasks.identification.joint.stops import make_stop
from tasks.identification.rules import JointRules
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import compute_surface_response
from tests.identification.synthetic import SURFACE, TOLERANCES, VEHICLE, measured, plain_run

RULES = load_decision_rules().joint
(LAG,) = (number for number in load_joint_numbers() if number.name == "lag")


@cache
def stops() -> list[RunModel]:
    """Three stops; made when a test first asks for them, not while tests are collected."""
    braked = ((27, 1.2), (20, 2.4), (16, 1.5))
    return [measured(plain_run(v, p), build_parameter_vector({}), 3) for v, p in braked]


@cache
def coast() -> RunModel:
    return measured(plain_run(20.0, 0.0), build_parameter_vector({"rolling_coefficient": 0.1}), 3)


def campaign_of(
    models: list[RunModel], channels: tuple[str, ...] = CHANNELS, gain_tolerance: float = 0.05
) -> Campaign:
    return Campaign(
        name="known", vehicle="paper-reference", runs=tuple(model.run for model in models), channels=channels,
        content_hash="", split_hash="",
        tolerances=replace(TOLERANCES, session=(gain_tolerance, *TOLERANCES.session[1:])),
    )  # fmt: skip


def chosen_priors(
    models: list[RunModel], rules: JointRules, gain_tolerance: float = 0.05
) -> dict[str, float]:
    campaign = campaign_of(models, gain_tolerance=gain_tolerance)
    return {n.name: n.sigma for n in choose_numbers(load_joint_numbers(), campaign, models, rules)}


def test_the_curve_of_the_brake_needs_enough_runs_that_brake_hard_enough():
    slowest = min(map(measure_peak_deceleration, stops()))
    assert "pressure_curve" in chosen_priors(stops(), RULES)
    assert "pressure_curve" not in chosen_priors(stops(), replace(RULES, fewest_curve_stops=4))
    assert "pressure_curve" not in chosen_priors(stops(), replace(RULES, braking_deceleration=slowest))


def test_friction_is_free_only_where_a_run_passes_the_limit_of_the_models_tyres():
    """Slicks twice as good as the asphalt were at their limit from half of it, and grip was found 31 % too low."""
    table = VEHICLE.find_tyre_family("dry")
    sticky = replace(table, efficiency=tuple(2.0 * e for e in table.efficiency))
    slicks = replace(VEHICLE, families={**VEHICLE.families, "dry": sticky})
    hardest = max(map(measure_peak_deceleration, stops())) / VEHICLE.gravity
    for vehicle, grip in ((VEHICLE, 1.0), (slicks, 2.0)):
        runs = [replace(model, vehicle=vehicle) for model in stops()]
        (model, *_) = runs
        peak = compute_surface_response(vehicle, "dry", model.surface_friction).tyre.peak
        assert peak == pytest.approx(
            grip * compute_surface_response(VEHICLE, "dry", model.surface_friction).tyre.peak
        )
        ratio = hardest / peak
        assert "friction" in chosen_priors(runs, replace(RULES, saturation_ratio=0.99 * ratio))
        assert "friction" not in chosen_priors(runs, replace(RULES, saturation_ratio=ratio))


def test_fade_is_free_where_discs_begin_at_different_temperatures():
    assert "fade" not in chosen_priors(stops(), RULES)
    hot = replace(stops()[0], run=replace(stops()[0].run, disc_rise=250.0))
    assert "fade" in chosen_priors([hot, *stops()[1:]], RULES)


def test_what_slopes_have_in_common_is_free_where_the_accelerometer_told_them_and_no_map():
    models = stops()
    assert "slope" not in chosen_priors(models, RULES)
    felt = [replace(m, run=replace(m.run, felt_slope=0.02)) for m in models]
    assert chosen_priors(felt, RULES)["slope"] == TOLERANCES.session[SESSION.index("slope")]
    mapped = [replace(m, run=replace(m.run, road_slope=np.full(len(m.run.pressure), 0.02))) for m in felt]
    assert "slope" not in chosen_priors(mapped, RULES)


@pytest.mark.parametrize("engine", [None, -150.0])
def test_a_mass_stands_in_for_another_number_until_the_engine_says_how_heavy_the_car_is(engine: float | None):
    """A van 28 % heavier than its file was told to have a dead band of 0.17 MPa though its engine was logged."""
    models = stops()
    if engine is not None:
        models = [
            replace(m, run=replace(m.run, drive_torque=np.full(len(m.run.pressure), engine))) for m in models
        ]
    (mass,) = (
        n
        for n in choose_numbers(load_joint_numbers(), campaign_of(models), models, RULES)
        if n.name == "mass"
    )
    assert mass.stands_in is (engine is None)
    assert all(
        (mass in numbers) is not mass.stands_in for numbers in free_numbers([LAG, mass], models, RULES)
    )


def test_a_number_is_at_a_bound_where_the_fit_had_to_stop_and_not_at_the_files_value():
    assert LAG.lower == 0.0 and not LAG.is_at_bound(0.0)
    assert LAG.is_at_bound(LAG.upper) and not LAG.is_at_bound(0.9 * LAG.upper)


def test_a_prior_is_a_share_of_the_largest_pressure_or_of_the_least_range_of_a_campaign():
    share = next(n.sigma for n in load_joint_numbers() if n.name == "push_out")
    peak = max(float(m.run.pressure.max()) for m in stops())
    assert chosen_priors(stops(), RULES)["push_out"] == pytest.approx(share * peak)
    assert chosen_priors(stops(), replace(RULES, least_pressure_range=9.0))["push_out"] == pytest.approx(
        9.0 * share
    )


def test_resistances_are_one_number_until_a_car_has_coasted_down():
    speed = coast().measured[:, CHANNELS.index("speed")]
    lost = float(1.0 - speed[-1] / speed[0])
    resistances = [n for n in load_joint_numbers() if n.group == "resistance"]
    enough, too_little = (replace(RULES, coasted_share=share * lost) for share in (0.99, 1.01))
    (together,) = free_numbers(resistances, [coast()], enough)
    assert len(together) == len(resistances) > 1
    # which of them stands for the sum is the runs' to say
    assert free_numbers(resistances, [coast()], too_little) == [(one,) for one in resistances]


def test_a_car_that_is_driven_does_not_coast_down():
    pedal = replace(coast(), run=replace(coast().run, throttle=np.full(len(coast().run.pressure), 0.2)))
    shut, driven = (replace(RULES, coasted_share=0.01, closed_throttle=most) for most in (0.2, 0.19))
    assert coasts_down(pedal, shut) and not coasts_down(pedal, driven)


def test_a_brake_behind_the_used_samples_counts_for_nothing():
    """A coast-down to walking pace, and the foot on the brake there."""
    slow = len(coast().run.pressure) - 30
    pressure = np.where(np.arange(slow + 30) < slow, 0.0, 6.0)
    late = replace(coast(), samples=slow, run=replace(coast().run, pressure=pressure))
    assert coasts_down(late, replace(RULES, coasted_share=0.01))
    assert chosen_priors([*stops(), late], RULES) == chosen_priors([*stops(), coast()], RULES)


def test_a_lag_and_a_dead_time_are_one_delay_in_a_slow_log():
    delays = [n for n in load_joint_numbers() if n.group == "delay"]
    interval = stops()[0].run.interval
    quick, slow = (replace(RULES, delay_interval=share * interval) for share in (1.0, 0.99))
    for rules, names in ((quick, ["lag", "dead_time"]), (slow, ["lag"])):
        (free,) = free_numbers(delays, stops(), rules)
        assert [n.name for n in free] == names


def test_a_driver_brakes_from_a_share_of_the_largest_pressure():
    onsets = []
    for share in (0.1, 0.9):
        rules = replace(RULES, brake_onset_share=share)
        stop = make_stop(stops()[0].run, VEHICLE, SURFACE, ("speed",), rules)
        pressure = stop.model.run.pressure
        assert pressure[stop.onset - 1] <= share * pressure[: stop.model.samples].max() < pressure[stop.onset]
        onsets.append(stop.onset)
    assert onsets[0] < onsets[1]


def test_a_late_speed_stands_in_for_a_late_brake_unless_an_accelerometer_tells_the_two_apart():
    for channels, free in ((("speed",), False), (("speed", "longitudinal_acceleration"), True)):
        shown = choose_numbers(load_joint_numbers(), campaign_of(stops(), channels), stops(), RULES)
        assert "speed_delay" in [n.name for n in shown]
        for numbers in free_numbers(shown, stops(), RULES):
            assert ("speed_delay" in [n.name for n in numbers]) is free


@cache
def at_the_limit() -> dict[str, RunModel]:
    """Full stops on dry and wet roads and on snow, by a car that does what its file says."""
    rain = replace(plain_run(22.0, 12.0), weather="rain", precipitation_mm_h=2.0)
    snow = replace(plain_run(12.0, 12.0), weather="snow", precipitation_mm_h=2.0, snow_accumulation_h=1.0)
    runs = {"dry": plain_run(22.0, 12.0), "rain": rain, "snow": snow}
    return {kind: measured(run, build_parameter_vector({}), 5) for kind, run in runs.items()}


@pytest.mark.parametrize(
    ("kinds", "free"),
    [
        (("dry",), {"friction"}),
        (("rain",), {"friction"}),
        (("dry", "rain"), {"friction", "wet_friction"}),
        (("rain", "snow"), {"wet_friction", "snow_friction"}),
        ((), set()),
    ],
)
def test_a_friction_is_free_for_each_kind_of_weather_whose_stops_come_to_the_files_limit(
    kinds: tuple[str, ...], free: set[str]
):
    """Full stops on wet asphalt with 20 % less friction than the mapping's were missed by 9 m, with nothing named."""
    models = [stops()[0], *(at_the_limit()[kind] for kind in kinds)]
    if kinds and "dry" not in kinds:
        models = models[1:]
    frictions = {name for name in chosen_priors(models, RULES) if name.endswith("friction")}
    assert frictions == free


@pytest.mark.parametrize(
    ("kinds", "told"),
    [(("dry",), False), (("rain",), True), (("dry", "rain"), True), (("dry", "snow"), False), ((), False)],
)
def test_a_fall_of_wet_friction_with_speed_is_never_free_and_stands_in_for_a_lower_one(kinds, told):
    """A car whose wet tyres lose grip with speed was told that its wet roads grip 13 % less, and nothing else."""
    models = [at_the_limit()[kind] for kind in kinds] or [stops()[0]]
    shown = choose_numbers(load_joint_numbers(), campaign_of(models), models, RULES)
    assert [n.stands_in for n in shown if n.name == "wet_speed"] == [True] * told
    assert not any(n.name == "wet_speed" for numbers in free_numbers(shown, models, RULES) for n in numbers)


def test_a_stop_at_the_files_limit_is_as_long_as_the_catalogue_says_for_the_weakest_brakes_that_the_file_allows():
    full = [at_the_limit()["dry"]]
    assert "friction" in chosen_priors(full, RULES)
    assert "friction" in chosen_priors(
        full, RULES, gain_tolerance=0.2
    )  # brakes 20 % weaker still lock the wheels
    assert "friction" not in chosen_priors(full, RULES, gain_tolerance=0.85)
    command = replace(campaign_of(full), brake_signal="brake_command")
    assert "friction" not in [n.name for n in choose_numbers(load_joint_numbers(), command, full, RULES)]
    limited = full[0].run.interval * np.sum(
        simulate_run(full[0], build_parameter_vector({})).column("abs_scale_f") < 1.0
    )
    assert "friction" in chosen_priors(full, replace(RULES, limited_time=0.99 * float(limited)))
    assert "friction" not in chosen_priors(full, replace(RULES, limited_time=1.01 * float(limited)))
