"""What the renderer is told about road and air rises with the rate and stays physical."""

from itertools import pairwise

import pytest

from catalogs.surfaces import load_surface
from tasks.surface.appearance import atmosphere_appearance, road_appearance
from tasks.surface.state import Weather, surface_state

RATES = (0.1, 0.5, 1, 2, 5, 10, 25, 50, 100)


def road(weather):
    return road_appearance(weather, surface_state(weather, load_surface("dense-asphalt")))


def weather(kind, rate):
    return Weather(kind=kind, precipitation_mm_h=rate, snow_accumulation_h=1.0 if kind == "snow" else 0.0)


@pytest.mark.parametrize("kind", ["rain", "snow"])
def test_one_sees_less_far_the_more_falls(kind):
    ranges = [atmosphere_appearance(weather(kind, rate)).visibility_m for rate in RATES]
    assert all(near < far for far, near in pairwise(ranges))
    assert ranges[0] < atmosphere_appearance(Weather(kind="dry")).visibility_m == pytest.approx(23_000)


def test_rain_extinguishes_as_lowtran_says():
    """Shettle 1989: 0.365 R^0.63 km-1; clear rural air adds ln(50)/23 km."""
    extinction = atmosphere_appearance(weather("rain", 10)).extinction_per_km
    assert extinction == pytest.approx(0.365 * 10**0.63 + 3.912 / 23, rel=1e-4)


def test_snow_hides_more_than_rain_of_the_same_rate():
    assert (
        atmosphere_appearance(weather("snow", 2)).visibility_m
        < atmosphere_appearance(weather("rain", 2)).visibility_m
    )


def test_heavy_snowfall_leaves_less_than_half_a_kilometre():
    """Reported snowfall intensity is heavy below about 0.4 to 0.5 km (Rasmussen et al. 1999)."""
    assert 300 < atmosphere_appearance(weather("snow", 3)).visibility_m < 500


def test_water_and_snow_on_the_road_rise_with_the_rate():
    wet = [road(weather("rain", rate)) for rate in RATES]
    white = [road(weather("snow", rate)) for rate in RATES]
    assert all(a.wetness <= b.wetness and a.film_depth_mm < b.film_depth_mm for a, b in pairwise(wet))
    assert all(
        a.snow_coverage <= b.snow_coverage and a.snow_depth_mm < b.snow_depth_mm for a, b in pairwise(white)
    )
    assert wet[-1].wetness == white[-1].snow_coverage == 1


def test_a_dry_road_is_neither_wet_nor_white():
    dry = road(Weather(kind="dry"))
    assert dry.wetness == dry.snow_coverage == dry.film_depth_mm == dry.free_film_mm == dry.snow_depth_mm == 0


def test_pavement_between_the_flakes_is_wet():
    light = road(weather("snow", 0.5))
    assert 0 < light.snow_coverage < 1 and light.wetness == 1
