"""Particles in the air: distributions, speeds and cross-sections against what was published of them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from tasks.errors import InputError
from tasks.render.weather.falling.precipitation import (
    atlas_fall_speed,
    drawn_optical_depth,
    drawn_reach,
    exponential_moment,
    make_population,
    power_fall_speed,
)

RAIN_RATES = (2.0, 10.0, 25.0, 50.0)
SNOW_RATES = (0.5, 1.0, 2.0, 3.0)


@pytest.mark.parametrize("rate", RAIN_RATES)
def test_drop_counts_are_marshall_palmer_integrals(parameters, rate):
    rain = make_population(parameters.kinds["rain"].particles, rate)
    slope = 4.1 * rate**-0.21
    for low, high, density in zip(rain.edges_mm[:-1], rain.edges_mm[1:], rain.density, strict=True):
        assert density == pytest.approx(quad(lambda D: 8000 * np.exp(-slope * D), low, high)[0])


@pytest.mark.parametrize("rate", SNOW_RATES)
def test_flake_counts_are_sekhon_srivastava_integrals(parameters, rate):
    snow = make_population(parameters.kinds["snow"].particles, rate)
    expected = quad(
        lambda D: 2500 * rate**-0.94 * np.exp(-2.29 * rate**-0.45 * D), snow.edges_mm[0], snow.edges_mm[-1]
    )
    assert snow.density.sum() == pytest.approx(expected[0])


@pytest.mark.parametrize(("kind", "rates"), [("rain", RAIN_RATES), ("snow", SNOW_RATES)])
def test_mean_cross_sections_are_those_of_the_distribution(parameters, kind, rates):
    for rate in rates:
        found = make_population(parameters.kinds[kind].particles, rate)
        low, high = found.edges_mm[2:4]
        weight = quad(lambda D, slope: np.exp(-slope * D), low, high, args=(found.slope_mm,))[0]
        square = (
            quad(lambda D, slope: D * D * np.exp(-slope * D), low, high, args=(found.slope_mm,))[0] / weight
        )
        ratio = found.parameters.visible_diameter_ratio
        assert found.cross_section[2] == pytest.approx(np.pi / 4 * (1e-3 * ratio) ** 2 * square)


@pytest.mark.parametrize(("kind", "rates"), [("rain", RAIN_RATES), ("snow", SNOW_RATES)])
def test_the_water_that_falls_through_a_level_is_the_rate(parameters, kind, rates):
    """Flux of mass: both distributions were fitted to it, apart from the fall speed used here."""
    for rate in rates:
        found = make_population(parameters.kinds[kind].particles, rate)
        middle = (found.edges_mm[:-1] + found.edges_mm[1:]) / 2
        flux_mm_h = 3600 * 1e-6 * np.sum(found.density * found.speed * np.pi / 6 * middle**3)
        assert flux_mm_h == pytest.approx(rate, rel=0.3)


def test_fall_speeds_are_the_published_ones():
    # Gunn & Kinzer 1949, doi:10.1175/1520-0469(1949)006<0243:TTVOFF>2.0.CO;2, table 2: 1, 2, 3, 5 mm
    speeds = atlas_fall_speed(np.array([1.0, 2.0, 3.0, 5.0]), (9.65, 10.3, 0.6))
    assert speeds == pytest.approx([4.03, 6.49, 8.06, 9.09], abs=0.15)
    # Locatelli & Hobbs 1974, table 1: aggregates of unrimed dendrites
    assert power_fall_speed(np.array([4.0]), (0.8, 0.16)) == pytest.approx([1.0], abs=0.01)


def test_rain_extinction_is_that_of_lowtran(parameters):
    """0.365 R^0.63 km-1 (Shettle 1989)."""
    for rate in RAIN_RATES:
        assert 1e3 * make_population(parameters.kinds["rain"].particles, rate).extinction == pytest.approx(
            0.365 * rate**0.63, rel=0.02
        )


def test_snow_intensity_classes_have_their_visual_ranges(parameters):
    """Light: 1 km and more; moderate: from 0.5 km; heavy: less (US national weather service)."""
    ranges = [
        3.0 / make_population(parameters.kinds["snow"].particles, rate).extinction for rate in (0.3, 1.0, 3.5)
    ]
    assert ranges[0] > 900
    assert 500 < ranges[1] < 1000
    assert ranges[2] < 500


def test_extinction_and_every_rain_class_grow_with_the_rate(parameters):
    rates = np.geomspace(0.5, 80, 30)
    rain = [make_population(parameters.kinds["rain"].particles, rate) for rate in rates]
    assert np.all(np.diff([p.extinction for p in rain]) > 0)
    assert np.all(np.diff([p.density for p in rain], axis=0) > 0)
    snow = [make_population(parameters.kinds["snow"].particles, rate).extinction for rate in rates]
    assert np.all(np.diff(snow) > 0)


def test_what_is_drawn_is_a_part_of_the_whole_extinction(parameters):
    near = parameters.air.near
    distance = np.linspace(0, 20, 81)
    for found in (
        make_population(parameters.kinds["rain"].particles, 50.0),
        make_population(parameters.kinds["snow"].particles, 3.0),
    ):
        drawn = drawn_optical_depth(found, near, 800.0, distance)
        assert np.all(np.diff(drawn) >= 0)
        assert drawn[0] == 0
        assert drawn[-1] == drawn[distance > near.farthest_m][0]
        assert np.all(np.diff(drawn) <= np.diff(distance) * found.extinction)


def test_drawn_optical_depth_is_the_integral_of_the_faded_population(parameters):
    found, near, focal = make_population(parameters.kinds["snow"].particles, 2.0), parameters.air.near, 400.0
    reach = drawn_reach(found, near, focal)

    def density(distance: float) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.clip((reach - distance) / (near.fade_share * reach), 0, 1)
        share = np.where((reach > 0) & (distance >= near.nearest_m), share, 0)
        return float(np.sum(found.density * found.cross_section * share))

    steps = np.linspace(0, 6, 60001)
    expected = np.sum([density(d) for d in steps[:-1] + 5e-5]) * 1e-4
    assert drawn_optical_depth(found, near, focal, np.array([6.0])) == pytest.approx([expected], rel=1e-3)


def test_moments_of_the_distribution_are_closed_forms():
    expected = quad(lambda D: D**3.5 * 8000 * np.exp(-2.5 * D), 0, 40)[0]
    assert exponential_moment(8000, 2.5, 3.5) == pytest.approx(expected)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan")])
def test_a_rate_that_is_none_is_refused(parameters, rate):
    with pytest.raises(InputError, match="rate must be positive"):
        make_population(parameters.kinds["rain"].particles, rate)


def test_an_unknown_kind_lists_those_that_exist(parameters):
    with pytest.raises(InputError, match="rain, snow; it is 'hail'"):
        make_population(replace(parameters.kinds["rain"].particles, kind="hail"), 1.0)
