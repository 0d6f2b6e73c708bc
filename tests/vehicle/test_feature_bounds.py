"""Road features that a grid may ask for: no wall, and no car that leaves one faster than it came."""

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.scenario import Scenario, find_scenario_problems
from tasks.surface.road_profile import RoadHazard
from tasks.vehicle.rollout import MODES
from tasks.vehicle.strut_travel import compute_strut_travel
from tests.vehicle.conftest import command

HARDEST_G = 3.0
"""Vertical acceleration of the body that no allowed feature exceeds [g]; 1.7 occurred in 120 drawn ones."""


def draw_allowed(vehicle, count: int) -> list[tuple[RoadHazard, float]]:
    """Features and speeds [m/s] over the whole allowed range, half of them on its edges."""
    draw, limits = np.random.default_rng(20261127), load("table of physical limits")
    found: list[tuple[RoadHazard, float]] = []
    while len(found) < count:
        length, speed = 10 ** draw.uniform(-1, 1.5), 10 ** draw.uniform(0.3, 2.1)
        slope = limits.hazard_slope.value * (1.0 if len(found) % 2 else draw.uniform(0.05, 1.0))
        height = min(slope * length / np.pi, limits.hazard_height.value) * draw.choice([-1, 1])
        feature = RoadHazard(center_m=6.0 + length / 2, length_m=length, height_m=height)
        if compute_strut_travel(vehicle, feature, speed) <= limits.strut_travel.value:
            found.append((feature, speed))
    return found


@pytest.mark.parametrize("mode", MODES)
def test_no_feature_gives_a_coasting_car_energy_or_throws_its_body(vehicle, drive, mode):
    for feature, speed in draw_allowed(vehicle, 16):
        seconds = np.ceil(1e3 * ((12.0 + feature.length_m) / speed + 1.0)) / 1e3
        ride = drive(
            hazard=feature,
            speed_km_h=3.6 * speed,
            mode=mode,
            brake=command(0.0, onset=None),
            duration=float(seconds),
        ).columns
        told = f"{feature} at {3.6 * speed:.1f} km/h"
        assert ride["speed"][-1] <= speed, told
        assert np.abs(np.diff(ride["heave_rate"])).max() / 0.001 < HARDEST_G * vehicle.gravity, told


def test_a_wall_is_no_feature():
    """A metre of height in a tenth of a metre threw the body with 313 g."""
    (problem,) = find_scenario_problems(
        Scenario(hazard_center_m=20, hazard_length_m=0.1, hazard_height_m=1.0)
    )
    assert (
        "pi hazard_height_m / hazard_length_m must be at most 0.53 (own choice" in problem
        and "31.4" in problem
    )
    assert not find_scenario_problems(Scenario(hazard_center_m=20, hazard_length_m=0.6, hazard_height_m=0.1))


def test_the_travel_of_the_struts_is_that_of_the_drive(vehicle, drive):
    hump = RoadHazard(center_m=20.0, length_m=3.7, height_m=0.075)
    ride = drive(hazard=hump, speed_km_h=40.0, brake=command(0.0, onset=None), duration=4.0).columns
    struts = (
        ride["heave"] - ride["unsprung_heave_f"] - vehicle.cg_to_front_axle * ride["pitch"],
        ride["heave"] - ride["unsprung_heave_r"] + vehicle.cg_to_rear_axle * ride["pitch"],
    )
    assert compute_strut_travel(vehicle, hump, 40 / 3.6) == pytest.approx(np.abs(struts).max(), rel=0.03)
    # a long hill does not move them
    assert compute_strut_travel(vehicle, RoadHazard(center_m=500, length_m=900, height_m=1.0), 10.0) == 0.0
