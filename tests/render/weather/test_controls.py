"""The paper's appearance controls: what each follows from, that it acts, and what it is at the paper's rates."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.render.weather.controls import air_controls, road_controls
from tasks.surface.anchors import adjacent_anchors
from tasks.surface.weather import Weather, surface_state
from tests.render.weather.scenes import clear_sky, road, weather_over

RATES = {"rain": (2, 10, 25, 50), "snow": (0.5, 1, 2, 3)}
PRINTED = {
    "rain": ([0.91, 1.0, 1.0, 1.0], [0.81, 1.80, 3.02, 4.54], [0.239, 0.206, 0.177, 0.163]),
    "snow": ([0.25, 0.5, 1.0, 1.0], [4.13, 5.40, 7.10, 8.34], [0.247, 0.244, 0.239, 0.234]),
}
"""Of docs/explanation/weather.md: wet or covered share [1], extinction [km-1], light under the cloud [1]."""
ANCHORS = (2.0, 10.0, 25.0, 50.0)


@pytest.fixture(scope="module")
def surface():
    return load("surface", "dense-asphalt")


def states(kind, surface):
    return [
        surface_state(Weather(kind=kind, precipitation_mm_h=rate, snow_accumulation_h=1.0), surface)
        for rate in RATES[kind]
    ]


@pytest.mark.parametrize("kind", RATES)
def test_the_controls_are_what_the_documentation_prints(kind, parameters, surface):
    shown, veil, light = PRINTED[kind]
    roads = [road_controls(state, parameters.kinds[kind]) for state in states(kind, surface)]
    airs = [air_controls(kind, rate, parameters) for rate in RATES[kind]]
    share = [one.wet_share if kind == "rain" else one.snow_coverage for one in roads]
    assert share == pytest.approx(shown, abs=0.006)
    assert [1e3 * air.extinction for air in airs] == pytest.approx(veil, rel=0.02)
    assert [air.transmittance for air in airs] == pytest.approx(light, abs=6e-4)
    assert np.all(np.diff([air.visual_range_m for air in airs]) < 0)


def test_what_falls_is_counted_and_rain_grows_denser(parameters):
    assert np.all(np.diff([air_controls("rain", r, parameters).particles_m3 for r in RATES["rain"]]) > 0)
    assert air_controls("ice", 0.0, parameters).particles_m3 == 0


@pytest.mark.parametrize("kind", RATES)
def test_the_road_follows_from_its_state_alone_and_both_act_in_the_renderer(kind, parameters, surface):
    state, look = states(kind, surface)[1], parameters.kinds[kind]
    harder = replace(state, precipitation_mm_h=2 * state.precipitation_mm_h)
    assert road_controls(harder, look) == road_controls(state, look)
    for one in (state, harder):
        outside = weather_over(road(), clear_sky(), one, parameters)[1].outside
        assert outside.road == road_controls(one, look)
        assert outside.air.extinction == outside.atmosphere.extinction
        assert outside.population is outside.atmosphere.population
        assert (
            outside.atmosphere.extinction == air_controls(kind, one.precipitation_mm_h, parameters).extinction
        )


def test_dry_air_holds_haze_alone(parameters):
    air = air_controls("dry", 0.0, parameters, visual_range_m=3000.0)
    assert air.population is None
    assert air.visual_range_m == pytest.approx(3000.0)


def test_fog_veils_by_koschmieders_extinction_and_hides_sky_and_horizon_alike(parameters, surface):
    """ln(1 / 0.05), the contrast threshold of WMO-No. 8, over the meteorological optical range."""
    fog = surface_state(Weather(kind="fog", visual_range_m=80.0), surface)
    outside = weather_over(road(), clear_sky(), fog, parameters)[1].outside
    assert outside.air.extinction == outside.atmosphere.extinction == pytest.approx(2.99573 / 80.0, rel=1e-5)
    above = outside.environment[: len(outside.environment) // 2 - 1]
    assert np.ptp(above[..., 1]) < 0.02 * above[..., 1].mean()


def test_a_rate_between_two_anchors_has_these_two(surface):
    rain = Weather(kind="rain", precipitation_mm_h=15)
    low, high = adjacent_anchors(rain, ANCHORS, surface)
    assert (low.precipitation_mm_h, high.precipitation_mm_h) == (10, 25)
    assert low == surface_state(replace(rain, precipitation_mm_h=10.0), surface)
    for rate in (1, 2, 10, 50, 60):
        assert adjacent_anchors(replace(rain, precipitation_mm_h=rate), ANCHORS, surface) == ()
