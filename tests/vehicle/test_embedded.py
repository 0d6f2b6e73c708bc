"""Parts of the compiled model of an FMU: knots without NumPy, a road under the axles, a late trace."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.surface.road_profile import RoadHazard
from tasks.vehicle.model.brake_input import compute_input_pressure, make_trace_input
from tasks.vehicle.model.embedded import count_held_samples
from tasks.vehicle.model.embedded_variables import INPUTS, OUTPUTS
from tasks.vehicle.model.simulation import INTERNAL_STEP_S
from tasks.vehicle.parameters import interpolate_knots
from tasks.vehicle.road import RoadLine, compute_road_height, compute_road_slope, make_road_feature


def test_a_table_at_its_knots_between_and_beyond_them_is_numpys_to_the_bit():
    draw = np.random.default_rng(3)
    for _ in range(200):
        knots, values = np.sort(draw.uniform(0, 1, 5)), draw.normal(size=5)
        for x in (*knots, *draw.uniform(-0.2, 1.2, 6)):
            assert interpolate_knots(x, knots, values) == np.interp(x, knots, values)
    one = np.array([0.4])
    assert interpolate_knots(0.1, one, one) == interpolate_knots(0.9, one, one) == 0.4


def test_a_road_told_under_the_axles_is_added_to_the_feature_at_the_nearer_axle():
    bump = make_road_feature(RoadHazard(center_m=10.0, length_m=4.0, height_m=0.1))
    told = bump._replace(under_axles=True, front=RoadLine(10.0, 0.2, 0.05), rear=RoadLine(7.0, -0.1, 0.5))
    assert compute_road_height(10.2, told) == compute_road_height(10.2, bump) + (0.2 + 0.05 * (10.2 - 10.0))
    assert compute_road_slope(10.2, told) == compute_road_slope(10.2, bump) + 0.05
    assert (compute_road_height(7.1, told), compute_road_slope(7.1, told)) == (-0.1 + 0.5 * (7.1 - 7.0), 0.5)


def test_a_trace_that_begins_later_is_the_end_of_a_longer_one():
    samples = np.random.default_rng(5).uniform(0, 3, 40)
    whole, end = make_trace_input(samples, 0.01), make_trace_input(samples[15:], 0.01)._replace(begin=0.15)
    for time in (0.21, 0.2437, 0.3333, 0.6):
        one, other = (compute_input_pressure(time, 0.0, 0.05, drive) for drive in (whole, end))
        assert abs(one - other) < 1e-12


def test_every_variable_has_a_place_of_its_own_and_parameters_come_first():
    names = [row.name for row in (*INPUTS, *OUTPUTS)]
    assert len({*names}) == len(names)
    roles = [row.role for row in INPUTS]
    assert roles == sorted(roles, reverse=True) and {*roles} == {"parameter", "input"}
    assert all(row.minimum <= row.start <= row.maximum for row in INPUTS)


@pytest.mark.parametrize("dead_time", [0.0, 0.0004, 0.0005, 0.0337])
def test_the_samples_that_are_held_reach_back_to_the_dead_time(vehicle, dead_time):
    held = count_held_samples(replace(vehicle, effects={"dead_time": dead_time}))
    assert dead_time <= (held - 2) * INTERNAL_STEP_S <= dead_time + 2 * INTERNAL_STEP_S


def test_a_weather_without_a_tyre_family_is_none_of_a_vehicles(vehicle):
    assert vehicle.find_weathers() == ["dry", "rain", "snow", "ice", "fog"]
    assert replace(vehicle, shared_families={}).find_weathers() == ["dry", "rain", "snow", "fog"]
