"""Physical limits: every scenario that ships keeps them, and what lies beyond is refused with its reason."""

from dataclasses import replace

import pytest

from catalogs.entries import load
from catalogs.scenario import Scenario, find_scenario_problems
from studies.paper.ablation import load_ablation

BRAKING = Scenario(peak_pressure_mpa=2.3, brake_onset_s=1.0)
SNOW = Scenario(weather="snow", precipitation_mm_h=1.0, snow_accumulation_h=1.0)


def test_the_heaviest_rain_is_that_of_one_minute_in_an_hour():
    assert load("table of physical limits").rain_rate.value == pytest.approx(31.2 * 60)


def test_the_papers_scenarios_lie_within_the_limits():
    scenarios = [condition.scenario for condition in load("list of conditions")]
    scenarios += [scenario for stops in load_ablation().stops.values() for scenario in stops]
    assert [find_scenario_problems(scenario) for scenario in scenarios] == [[]] * len(scenarios)


@pytest.mark.parametrize(
    ("scenario", "words"),
    [
        (
            Scenario(weather="rain", precipitation_mm_h=50_000.0),
            "precipitation_mm_h must be at most 1872 mm h-1",
        ),
        (replace(SNOW, precipitation_mm_h=51.0), "precipitation_mm_h must be at most 50 mm h-1"),
        (replace(SNOW, snow_accumulation_h=169.0), "snow_accumulation_h must be at most 168 h"),
        (
            replace(SNOW, precipitation_mm_h=20.0, snow_accumulation_h=60.0),
            "precipitation_mm_h times snow_accumulation_h must be at most 1182 mm",
        ),
        (Scenario(initial_speed_km_h=1e308), "initial_speed_km_h must be at most 490.484 km h-1"),
        (Scenario(initial_speed_km_h=1e-300), "initial_speed_km_h must be at least 0.1 km h-1"),
        (Scenario(initial_speed_km_h=-5.0), "initial_speed_km_h must be at least 0.1 km h-1"),
        (replace(BRAKING, peak_pressure_mpa=23.0), "peak_pressure_mpa must be at most 20 MPa"),
        (replace(BRAKING, ramp_s=1e9), "ramp_s must be at most 600 s"),
        (replace(BRAKING, hold_s=1e9), "hold_s must be at most 600 s"),
        (replace(BRAKING, release_s=1e9), "release_s must be at most 600 s"),
        (replace(BRAKING, brake_onset_s=1e9), "brake_onset_s must be at most 600 s"),
        (replace(BRAKING, brake_onset_s=None, brake_onset_m=1e9), "brake_onset_m must be at most 100000 m"),
        (Scenario(hazard_center_m=1e9), "hazard_center_m must be at most 100000 m"),
        (Scenario(hazard_length_m=1e9, hazard_height_m=0.1), "hazard_length_m must be at most 1000 m"),
        (Scenario(hazard_length_m=1e-9, hazard_height_m=1.0), "hazard_length_m must be at least 0.1 m"),
        (Scenario(hazard_length_m=3.0, hazard_height_m=-2.0), "hazard_height_m must be at most 1 m"),
    ],
)
def test_what_lies_beyond_a_limit_is_refused_with_the_limits_reason(scenario, words):
    (problem,) = find_scenario_problems(scenario)
    assert words in problem
    assert any(limit.source in problem for _, limit in load("table of physical limits"))


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_number_that_is_not_finite_is_refused(value):
    problems = find_scenario_problems(replace(SNOW, precipitation_mm_h=value))
    assert f"precipitation_mm_h must be a finite number; it is {value}" in problems
