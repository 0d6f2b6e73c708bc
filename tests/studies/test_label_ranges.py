"""Percentiles of a clip's labels under the paper's bounds of the surface parameters."""

from math import isnan

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.scenario import Scenario
from flows.making.driving import collect_ranged_figures, controls_of, hazard_of, simulate_drive, weather_of
from tasks.studies.label_ranges import DRIVEN_PERCENTILES, PERCENTILES, label_ranges, sampled_friction
from tasks.studies.sensitivity import latin_hypercube
from tasks.surface.state import SurfaceState
from tasks.vehicle.rollout import simulate_scenario

RAIN = {"weather": "rain", "precipitation_mm_h": 50.0}
SNOW = {"weather": "snow", "precipitation_mm_h": 1.0, "snow_accumulation_h": 1.0}
STOP = {"initial_speed_km_h": 60.0, "peak_pressure_mpa": 2.3, "brake_onset_s": 0.0}


@pytest.fixture(scope="module")
def entries():
    return load("vehicle", "paper-reference"), load("surface", "dense-asphalt"), load("sensitivity study")[0]


def ranges(scenario: Scenario, entries, duration_s: float = 8.0) -> dict[str, float]:
    vehicle, surface, study = entries

    def drive(friction: float) -> dict[str, float]:
        _, ride = simulate_drive(scenario, vehicle, surface, "paper", duration_s, friction=friction)
        return collect_ranged_figures(ride)

    return label_ranges(sampled_friction(weather_of(scenario), surface, study), drive)


@pytest.mark.parametrize(
    ("weather", "stop", "friction"),
    [(RAIN, (43.16, 50.50), (0.318, 0.377)), (SNOW, (34.07, 42.53), None)],
    ids=["rain-50", "snow-1"],
)
def test_envelopes_are_those_that_the_paper_prints(weather, stop, friction, entries):
    """Appendix E; its study has no coast drag, which shortens a stop by some centimetres."""
    found = ranges(Scenario(**weather, **STOP), entries)
    assert [found["stopping_distance_p05"], found["stopping_distance_p95"]] == pytest.approx(stop, abs=0.12)
    if friction:
        assert [found["surface_friction_p05"], found["surface_friction_p95"]] == pytest.approx(
            friction, abs=5e-4
        )


def test_five_drives_find_what_a_drive_of_every_sample_finds(entries):
    """Against the definition: all 128 samples driven, and their percentiles taken."""
    vehicle, surface, study = entries
    scenario = Scenario(**RAIN, **STOP)
    friction = sampled_friction(weather_of(scenario), surface, study)
    driven = []

    def again(mu: float) -> dict[str, float]:
        driven.append(mu)
        ride = simulate_scenario(
            vehicle,
            SurfaceState(kind="rain", friction=mu),
            controls_of(scenario),
            hazard_of(scenario),
            mode="paper",
            duration_s=8.0,
        )
        return collect_ranged_figures(ride)

    found, few = label_ranges(friction, again), label_ranges(friction, again, PERCENTILES)
    assert few == pytest.approx(found, rel=1e-3)
    driven[5:] = []
    assert len(driven) == len(DRIVEN_PERCENTILES) == 5
    every = [again(mu) for mu in friction]
    for name in ("stopping_distance", "peak_pitch"):
        for percentile in (5, 50, 95):
            exact = np.percentile([figures[name] for figures in every], percentile)
            assert found[f"{name}_p{percentile:02d}"] == pytest.approx(exact, rel=2e-3)


def test_a_percentile_that_the_clip_does_not_contain_is_not_represented():
    """Stops on the better half of the roads, and not on the worse one: the shorter percentile is known."""
    friction = np.linspace(0.2, 0.4, 101)
    found = label_ranges(friction, lambda mu: {"stopping_distance": 10 / mu if mu > 0.299 else float("nan")})
    assert found["stopping_distance_p05"] == pytest.approx(10 / 0.39, rel=1e-3)
    assert isnan(found["stopping_distance_p95"])


def test_a_car_that_coasts_has_no_stop_and_a_sure_pitch(entries):
    hump = {"hazard_center_m": 20.0, "hazard_length_m": 3.7, "hazard_height_m": 0.075}
    found = ranges(Scenario(initial_speed_km_h=40.0, **hump), entries)
    assert all(isnan(found[f"stopping_distance_p{p}"]) for p in ("05", "50", "95"))
    assert found["peak_pitch_p95"] - found["peak_pitch_p05"] < 1e-3


def test_percentiles_ascend_around_the_nominal_label(entries):
    found = ranges(Scenario(**RAIN, **STOP), entries)
    for name in ("surface_friction", "stopping_distance", "peak_pitch"):
        assert found[f"{name}_p05"] < found[f"{name}_p50"] < found[f"{name}_p95"]


def test_each_stratum_of_the_hypercube_is_drawn_once():
    samples = latin_hypercube({"a": (1.0, 3.0), "b": (-1.0, 0.0)}, ("a", "b"), 64, 7)
    assert np.array_equal(np.sort(np.floor((samples["a"] - 1) / 2 * 64)), np.arange(64))
    assert np.array_equal(np.sort(np.floor((samples["b"] + 1) * 64)), np.arange(64))
    assert abs(np.corrcoef(samples["a"], samples["b"])[0, 1]) < 0.5
