"""Black ice: the surface that freezing rain leaves, and cars that brake on it."""

import numpy as np
import pytest

from catalogs.entries import entry_names, load
from catalogs.scenario import Scenario, find_scenario_problems
from flows.making.plan import make_plan
from manifests.canonical import sha256_of
from manifests.frozen_run import parameters_that_matter
from tasks.studies.label_ranges import sampled_friction
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceState
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.rollout import MODES, Controls, simulate_scenario

ASPHALT = load("surface", "dense-asphalt")
ICE = surface_state(Weather(kind="ice"), ASPHALT)
SPEED = 30 / 3.6
STOP = Controls(
    initial_speed=SPEED,
    brake=BrakeCommand(
        peak_pressure_mpa=5.0, ramp_s=0.5, onset_s=0.0, onset_station_m=None, hold_s=None, release_s=0.5
    ),
    hold_speed_until_brake=True,
)


def test_ice_is_a_film_that_nothing_falls_on():
    assert SurfaceState(kind="ice", film_depth_mm=0.4, friction=0.1) == ICE
    assert find_scenario_problems(Scenario(weather="ice")) == []
    (problem,) = find_scenario_problems(Scenario(weather="ice", precipitation_mm_h=2.0))
    assert problem.startswith("weather ice has no precipitation; precipitation_mm_h is 2")


def test_its_friction_and_the_range_of_its_labels_are_those_of_the_literature():
    """Wet black ice 0.05 to 0.10, black ice from 0.15 on (Wallman & Astrom 2001, VTI meddelande 911A, p. 36)."""
    low, high = ASPHALT.bounds["ice_friction"]
    assert (low, ICE.friction, high) == (0.05, 0.10, 0.15)
    drawn = sampled_friction(Weather(kind="ice"), ASPHALT, load("sensitivity study")[0])
    assert low <= drawn.min() < 0.052 and 0.148 < drawn.max() <= high


def test_the_tyre_on_ice_is_burckhardts_with_a_top():
    """c1 and c2 of Burckhardt 1993; c3 moves the top from infinity to 3.1 % slip and takes 2 % off a locked wheel."""
    vehicle = load("vehicle", "paper-reference")
    c1, c2, c3 = vehicle.find_tyre_family("ice").burckhardt
    assert (c1, c2) == (0.05, 306.39)
    tyre = compute_surface_response(vehicle, "ice", ICE.friction).tyre
    slip = np.linspace(0, 1, 100_001)
    curve = c1 * (1 - np.exp(-c2 * slip)) - c3 * slip
    assert (
        tyre.target_slip == pytest.approx(slip[curve.argmax()], abs=1e-5) == pytest.approx(0.0315, abs=5e-5)
    )
    assert curve[-1] / curve.max() == pytest.approx(0.98, abs=0.002)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", entry_names("vehicle"))
def test_every_car_takes_several_times_the_way_on_ice_with_its_abs_at_work(name, mode):
    dry = SurfaceState(kind="dry", friction=0.82)
    vehicle = load("vehicle", name)
    on_ice, on_dry = (
        simulate_scenario(vehicle, surface, STOP, FLAT_ROAD, mode=mode, duration_s=16.0)
        for surface in (ICE, dry)
    )
    slowing = 9.81 * ICE.friction + vehicle.coast_deceleration
    assert on_ice.stopping_distance == pytest.approx(SPEED**2 / (2 * slowing), rel=0.03)
    assert on_ice.stopping_distance > 4.5 * on_dry.stopping_distance
    braking = (on_ice.columns["speed"] > 3.0) & (on_ice.columns["t_ns"] > 1e9)
    for axle in "fr":
        assert on_ice.columns[f"abs_scale_{axle}"][braking].mean() < 0.5
        assert on_ice.columns[f"braking_slip_{axle}"][braking].max() < 0.1


def test_a_grid_with_ice_freezes_the_entry_of_ice_and_tags_it_as_not_calibrated():
    grid = load("grid", "ice")
    assert {tag for (_, scenario), (_, tag) in zip(grid.scenarios, grid.tags, strict=True)
            if scenario.weather == "ice"} == {"beyond-calibration"}  # fmt: skip
    plan, inputs = make_plan("ice", "cpu")
    kinds = {name for name in plan.inputs if name.startswith("weather/")}
    assert kinds == {"weather/air.yaml", "weather/sky.yaml", "weather/ice.yaml"}
    assert plan.inputs["weather/ice.yaml"] == sha256_of([inputs["weather/ice.yaml"]])


def test_telemetry_alone_stands_on_the_grip_of_ice_and_not_on_its_looks():
    entry = {"exposure_ev": {"value": 1.6}, "tyre": {"hold_s": {"value": [0.2]}}, "surface": {}}
    kept = parameters_that_matter({"weather/ice.yaml": entry}, pictures=False)
    assert kept == {"weather/ice.yaml": {"tyre": entry["tyre"], "surface": {}}}
