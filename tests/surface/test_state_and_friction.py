"""Golden values of the surface mapping, computed by hand from the paper's Appendix E, and its properties."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogs.entries import load
from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.surface.weather import Weather, surface_state

ASPHALT = load("surface", "dense-asphalt")


def of(weather: Weather, parameters: SurfaceParameters = ASPHALT) -> tuple[SurfaceState, float]:
    state = surface_state(weather, parameters)
    return state, state.friction


def rain(rate: float) -> Weather:
    return Weather(kind="rain", precipitation_mm_h=rate)


def snow(rate: float, hours: float = 1.0) -> Weather:
    return Weather(kind="snow", precipitation_mm_h=rate, snow_accumulation_h=hours)


@pytest.mark.parametrize(
    ("rate", "film", "friction"),
    [
        (2, 0.18907, 0.595585),
        (5, 0.32464, 0.502657),
        (10, 0.48867, 0.434150),
        (15, 0.62074, 0.400622),
        (25, 0.83907, 0.369279),
        (35, 1.02333, 0.355843),
        (50, 1.26301, 0.347126),
    ],
)
def test_rain_gives_the_published_film_and_friction(rate, film, friction):
    state, mu = of(rain(rate))
    assert round(state.film_depth_mm, 5) == film
    assert round(mu, 6) == friction


@pytest.mark.parametrize(
    ("rate", "friction"), [(0.5, 0.51), (0.75, 0.465), (1, 0.42), (1.5, 0.33), (2, 0.24), (3, 0.24)]
)
def test_an_hour_of_snow_gives_the_published_friction(rate, friction):
    state, mu = of(snow(rate))
    assert mu == pytest.approx(friction, abs=1e-12)
    assert state.snow_depth_mm == pytest.approx(10 * rate)


def test_a_dry_road_keeps_its_friction_and_carries_nothing():
    state, mu = of(Weather(kind="dry"))
    assert mu == 0.82
    assert state == SurfaceState(kind="dry", friction=0.82)


def test_quantities_of_another_weather_are_zero():
    assert of(rain(50))[0].snow_depth_mm == of(rain(50))[0].snow_coverage == 0
    assert of(snow(3))[0].film_depth_mm == 0


@given(st.floats(0.01, 200), st.floats(1.0001, 3))
def test_friction_falls_and_film_grows_with_rain(rate, factor):
    (less, mu_less), (more, mu_more) = of(rain(rate)), of(rain(rate * factor))
    assert more.film_depth_mm > less.film_depth_mm
    assert mu_more < mu_less or mu_less - ASPHALT.flooded_friction < 1e-9


@given(st.floats(0.01, 10), st.floats(0.01, 5), st.floats(1.0001, 3))
def test_friction_falls_with_snow_until_it_covers_the_road(rate, hours, factor):
    (less, mu_less), (more, mu_more) = of(snow(rate, hours)), of(snow(rate * factor, hours))
    assert mu_more < mu_less or less.snow_coverage == more.snow_coverage == 1


@given(st.sampled_from(["rain", "snow"]), st.floats(0, 500), st.floats(0, 24))
def test_friction_stays_between_its_anchors(kind, rate, hours):
    _, mu = of(Weather(kind=kind, precipitation_mm_h=rate, snow_accumulation_h=hours))
    low, high = (0.34, 0.82) if kind == "rain" else (0.24, 0.60)
    assert low - 1e-12 <= mu <= high + 1e-12


def test_vanishing_rain_is_the_dry_road_and_vanishing_snow_is_bare_and_wet():
    assert of(rain(1e-12))[1] == pytest.approx(0.82, abs=1e-6)
    assert of(snow(1e-12))[1] == pytest.approx(0.60, abs=1e-9)


def test_film_grows_with_texture_and_drainage_length_and_falls_with_crossfall():
    film = of(rain(20))[0].film_depth_mm
    assert of(rain(20), replace(ASPHALT, texture_depth_mm=0.6))[0].film_depth_mm > film
    assert of(rain(20), replace(ASPHALT, drainage_length=4.5))[0].film_depth_mm > film
    assert of(rain(20), replace(ASPHALT, crossfall=0.024))[0].film_depth_mm < film
