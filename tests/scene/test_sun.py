"""Where a scene's sun may stand."""

import pytest

from tasks.scene.scene import LOWEST_SUN_DEG, find_sun_problems


@pytest.mark.parametrize("elevation", [LOWEST_SUN_DEG, 30.0, 90.0])
def test_a_sun_from_the_lowest_elevation_to_the_zenith_is_sound(elevation: float) -> None:
    assert find_sun_problems((0.0, elevation)) == []


@pytest.mark.parametrize("sun", [(0.0, 0.9), (0.0, 90.1), (float("inf"), 30.0)])
def test_a_sun_below_it_beyond_the_zenith_or_nowhere_is_told(sun: tuple[float, float]) -> None:
    assert len(find_sun_problems(sun)) == 1
