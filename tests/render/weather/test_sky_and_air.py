"""The light under cloud and the veil of the air."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.render.composition import LUMINANCE
from tasks.render.weather.atmosphere import (
    air_layer,
    extinction_of_visual_range,
    light_layer,
    optical_depth,
    precipitating_air,
)
from tasks.render.weather.clouds import draw_closed_sky
from tasks.render.weather.falling.precipitation import make_population
from tasks.render.weather.layer import recompose_layers
from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.sky import (
    cloud_transmittance,
    light_from,
    replace_sky,
    row_elevations,
    sky_light,
)
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import clear_sky, flat_gbuffer, see_sky

WHITE = np.array((1.8, 1.7, 1.5))


@pytest.fixture
def air(parameters):
    return precipitating_air(
        make_population(parameters.kinds["rain"].particles, 25.0), parameters.air.near, 400.0, 12000.0
    )


@pytest.fixture
def sky(parameters, air):
    return sky_light(WHITE, 0.6, air.extinction, 0.1, parameters.sky)


def cloud_over(environment, sky, air, parameters, snow=0.0):
    """The environment under closed cloud of seed 1."""
    p, elevation = parameters.sky, row_elevations(len(environment))
    fade = air.extinction * p.cloud_base_m
    above = elevation[elevation > 0]
    rows = draw_closed_sky(sky.airlight, sky.gradient, fade, p.clouds, 1, above, environment.shape[1])
    return replace_sky(environment, rows, sky, air.extinction, p, snow)


def test_visual_range_is_where_contrast_falls_to_its_threshold():
    assert np.exp(-extinction_of_visual_range(1000.0) * 1000.0) == pytest.approx(0.05)


def test_the_overcast_sky_gives_the_light_that_the_white_surface_shows(parameters, sky):
    elevation = (np.arange(20000) + 0.5) / 20000 * np.pi / 2
    radiance = np.outer(1 + sky.gradient * np.sin(elevation), sky.airlight)
    weight = 2 * np.sin(elevation) * np.cos(elevation) * np.pi / 2 / 20000
    assert radiance.T @ weight == pytest.approx(sky.white, rel=1e-6)


def test_a_thin_rain_leaves_the_gradient_of_moon_and_spencer(parameters):
    clear = sky_light(WHITE, 0.25, 0.0, 0.1, parameters.sky)
    assert clear.zenith / clear.airlight == pytest.approx(np.full(3, 3.0))
    thick = sky_light(WHITE, 0.25, 0.04, 0.1, parameters.sky)
    assert thick.zenith / thick.airlight == pytest.approx(np.ones(3), abs=1e-3)


def test_cloud_takes_three_quarters_of_the_light_and_more_when_it_rains_hard(parameters):
    thin, thick = (cloud_transmittance(rate, parameters.sky) for rate in (0.0, 200.0))
    assert (thin, thick) == pytest.approx((0.25, 0.16), abs=1e-6)
    sky = sky_light(WHITE, thin, 0.001, 0.1, parameters.sky)
    assert LUMINANCE @ sky.white == pytest.approx(
        0.25 * LUMINANCE @ WHITE * (LUMINANCE @ parameters.sky.tint)
    )
    assert sky.white[2] > sky.white[0]
    opened = sky_light(WHITE, 2 * thin, 0.001, 0.1, parameters.sky)
    assert opened.white == pytest.approx(2 * sky.white)


def test_the_sun_is_gone_from_the_overcast_environment(parameters, sky, air):
    cloudy = cloud_over(clear_sky(), sky, air, parameters)
    up = cloudy[:16]
    assert up.max() < 1.5 * sky.zenith.max()
    assert up.std(axis=(0, 1)).max() < 0.2
    assert cloudy.tobytes() == cloud_over(clear_sky(), sky, air, parameters).tobytes()


def test_what_stands_dark_against_the_clear_sky_stays_and_fades(parameters, sky, air):
    environment = clear_sky(64)
    environment[28:32, 20:24] = 0.01
    cloudy = cloud_over(environment, sky, air, parameters)
    hill, beside = cloudy[30, 22], cloudy[30, 40]
    assert np.all(hill < beside)
    through = np.exp(-air.extinction * parameters.sky.far_field_m)
    assert hill == pytest.approx((1 - through) * sky.airlight, rel=0.1)


def test_ground_below_the_horizon_is_as_near_as_the_eye_is_high_and_white_under_snow(parameters, sky, air):
    """Straight down it lies at 1.4 m, through air that takes under half a percent; far fog is no ground."""
    dark = np.where(np.arange(64)[:, None, None] < 32, clear_sky(64), np.float32(0))
    bare = cloud_over(dark, sky, air, parameters)
    assert bare[-1].max() < 0.01 * sky.airlight.max()
    down = np.sin((np.arange(33, 64) + 0.5 - 32) / 64 * np.pi)
    through = np.exp(-air.extinction * 1.4 / down)
    np.testing.assert_allclose(bare[33:, 0], np.outer(1 - through, sky.airlight), rtol=1e-3)
    white = cloud_over(dark, sky, air, parameters, snow=1.0)
    np.testing.assert_allclose(white[-1, 0], sky.ground, rtol=0.05)
    np.testing.assert_array_equal(white[:32], bare[:32])


def test_light_from_above_is_sky_and_from_below_is_ground(parameters, sky):
    p = replace(parameters.sky, sky_view=1.0)
    assert light_from(sky, np.array(1.0), p) == pytest.approx(sky.white)
    assert light_from(sky, np.array(-1.0), p) == pytest.approx(sky.ground)


def test_the_sky_is_replaced_and_the_street_relit(parameters, sky, air):
    view = shutter(width=96, height=64, focal=80.0)
    picture, gbuffer = flat_gbuffer(view)
    clear = clear_sky()
    cloudy = cloud_over(clear, sky, air, parameters)
    lit = recompose_layers(
        picture, [light_layer(picture, gbuffer, see_sky(clear, view), see_sky(cloudy, view), sky)]
    )
    ground = gbuffer.alpha == 1
    assert lit[ground] == pytest.approx(picture[ground] @ sky.relight.T, rel=1e-5)
    assert np.all(lit[~ground] <= cloudy.max(axis=(0, 1)) + 1e-6)
    assert np.all(lit[~ground] >= 0.5 * sky.airlight)


def test_half_covered_pixels_change_their_own_share_only(parameters, sky, air):
    view = shutter(width=96, height=64, focal=80.0)
    _, gbuffer = flat_gbuffer(view)
    clear = np.full((8, 16, 3), 0.6, np.float32)
    cloudy = np.full((8, 16, 3), 0.9, np.float32)
    half = replace(gbuffer, alpha=np.full_like(gbuffer.alpha, 0.5))
    picture = np.full((64, 96, 3), 0.5 * 0.2 + 0.5 * 0.6, np.float32)
    lit = recompose_layers(
        picture, [light_layer(picture, half, see_sky(clear, view), see_sky(cloudy, view), sky)]
    )
    assert lit == pytest.approx(np.broadcast_to(0.1 * sky.relight.sum(axis=1) + 0.45, lit.shape), rel=1e-5)


def test_contrast_falls_with_distance_as_koschmieder_says(parameters, sky, air):
    view = shutter(width=96, height=64, focal=80.0)
    picture, gbuffer = flat_gbuffer(view)
    cloudy = np.tile(sky.airlight.astype(np.float32), (8, 16, 1))
    air = replace(air, extinction=0.05, drawn=np.linspace(0, 0.3, len(air.drawn)))
    layer = air_layer(gbuffer, see_sky(cloudy, view), air, sky, pixel_rays(view))
    veiled = recompose_layers(picture, [layer])
    distance = gbuffer.depth * np.linalg.norm(pixel_rays(view), axis=-1)
    seen = gbuffer.alpha == 1
    contrast = (veiled[seen] - sky.airlight) / (picture[seen] - sky.airlight)
    expected = np.exp(-optical_depth(air, distance[seen]))
    assert contrast == pytest.approx(np.repeat(expected[:, None], 3, axis=1), rel=2e-3)
    assert np.all(layer.gain[~seen] == 1)
    assert np.all(layer.add[~seen] == 0)


def test_veil_and_drawn_particles_together_take_the_light_once(parameters, air):
    falling = make_population(parameters.kinds["rain"].particles, 25.0)
    whole = (falling.extinction + extinction_of_visual_range(12000.0)) * 30.0
    assert optical_depth(air, np.array(30.0)) + air.drawn[-1] == pytest.approx(whole)
    distance = np.linspace(0, 30, 200)
    assert np.all(np.diff(optical_depth(air, distance)) > 0)


def test_heavier_weather_veils_more(parameters):
    for kind, rates in (("rain", (2, 10, 25, 50)), ("snow", (0.5, 1, 2, 3))):
        depths = [
            optical_depth(
                precipitating_air(
                    make_population(parameters.kinds[kind].particles, rate),
                    parameters.air.near,
                    400.0,
                    12000.0,
                ),
                np.array(60.0),
            )
            for rate in rates
        ]
        assert np.all(np.diff(depths) > 0)
