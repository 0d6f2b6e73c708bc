"""The raised cosine: its shape, its derivative, and the rules of a hazard."""

import numpy as np
import pytest

from tasks.errors import InputError
from tasks.surface.road_profile import FLAT_ROAD, RoadHazard, road_elevation, road_slope

HUMP = RoadHazard(center_m=20.0, length_m=3.7, height_m=0.075)


def test_height_is_full_in_the_middle_half_at_a_quarter_and_nothing_outside():
    heights = road_elevation([20.0, 20.0 + 3.7 / 4, 20.0 - 3.7 / 2, 18.0, 25.0], HUMP)
    np.testing.assert_allclose(heights, [0.075, 0.0375, 0, 0, 0], atol=1e-15)


def test_slope_is_the_derivative_of_the_height():
    station = np.linspace(17, 23, 4001)
    numeric = (road_elevation(station + 1e-6, HUMP) - road_elevation(station - 1e-6, HUMP)) / 2e-6
    np.testing.assert_allclose(road_slope(station, HUMP), numeric, atol=1e-6)


def test_steepest_slope_is_pi_height_over_length():
    assert np.abs(road_slope(np.linspace(18, 22, 100_001), HUMP)).max() == pytest.approx(np.pi * 0.075 / 3.7)


def test_a_depression_is_a_hump_upside_down():
    hole = RoadHazard(center_m=20.0, length_m=3.7, height_m=-0.075)
    station = np.linspace(15, 25, 101)
    np.testing.assert_array_equal(road_elevation(station, hole), -road_elevation(station, HUMP))
    np.testing.assert_array_equal(road_slope(station, hole), -road_slope(station, HUMP))


def test_a_flat_road_is_flat_everywhere():
    station = np.linspace(-5, 5, 11)
    assert not road_elevation(station, FLAT_ROAD).any() and not road_slope(station, FLAT_ROAD).any()


def test_shape_of_the_stations_is_kept():
    assert road_elevation(20.0, HUMP).shape == ()
    assert road_slope(np.zeros((2, 3)), HUMP).shape == (2, 3)


def test_all_that_is_wrong_with_a_hazard_is_said_at_once():
    with pytest.raises(InputError) as error:
        RoadHazard(center_m=float("nan"), length_m=0.0, height_m=0.1)
    assert len(error.value.problems) == 2
    assert "center_m" in error.value.problems[0] and "needs length_m above 0" in error.value.problems[1]
