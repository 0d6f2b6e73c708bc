"""Light put on a street that knows its own: sun, kinds of sky, shadows of the discs themselves."""

from dataclasses import fields, replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.conventions import SemanticClass
from tasks.render.composition import LUMINANCE
from tasks.render.weather.clouds import draw_closed_sky, draw_sunny_sky
from tasks.render.weather.daylight import relight_street
from tasks.render.weather.layers import ClearScene, ClipConditions, choose_light
from tasks.render.weather.named_sky import ANY_SKY, SKY_NAMES, NamedSky
from tasks.render.weather.scene_light import append_gaussians, mean_colours
from tasks.render.weather.skies import (
    Skies,
    air_mass,
    draw_sky_kind,
    draw_sun,
    light_of_sky,
    point_to_sun,
)
from tasks.render.weather.sky import expose_light, row_elevations
from tasks.render.weather.sun_shadow import cast_sun
from tasks.surface.weather import Weather, surface_state
from tests.render.weather.scenes import road, surfels

OWN = np.array(((1.9, 1.8, 1.6), (0.4, 0.5, 0.6), (0.2, 0.2, 0.2)))
SUN = point_to_sun(150.0, 46.0)
ABOVE = row_elevations(64)[:32]


def light_from(parameters, name, to_sun=SUN, transmittance=0.25):
    kind = getattr(parameters.sky.skies, name)
    return light_of_sky(name, kind, to_sun, OWN, SUN, parameters.sky.sun, transmittance)


@pytest.fixture
def half_shaded():
    """A road of one albedo whose left half the own sun does not reach."""
    ground = road()
    light = np.zeros((len(ground), 4), np.float32)
    light[:, 0] = np.where(ground.means[:, 1] > 0, 0, SUN[2])
    light[:, 1:3] = 0.7, 0.3
    colour = 0.1 * (light[:, :3] @ OWN)
    return replace(ground, light=light, sh=((colour - 0.5) / 0.28209479)[:, None].astype(np.float32))


def test_under_cloud_no_shadow_of_the_sun_is_left_and_colours_are_those_of_the_surface(
    half_shaded, parameters
):
    relit, incident, _ = relight_street(
        half_shaded, half_shaded.light, OWN, SUN, light_from(parameters, "overcast")
    )
    colours = mean_colours(relit)
    assert np.ptp(colours, axis=0) / colours.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.06)
    assert colours[0] == pytest.approx(np.full(3, colours[0].mean()), rel=0.03)
    assert colours == pytest.approx(0.1 * incident, rel=0.06)


def test_a_street_in_another_light_is_as_bright_on_its_road_and_tells_how_much_it_lost(
    half_shaded, parameters
):
    relit, _, strength = relight_street(
        half_shaded, half_shaded.light, OWN, SUN, light_from(parameters, "overcast")
    )
    bright = [float((mean_colours(one) @ LUMINANCE).mean()) for one in (half_shaded, relit)]
    assert bright[1] == pytest.approx(bright[0], rel=0.03)
    assert 0.25 < strength < 0.5


def test_a_street_in_its_own_light_keeps_its_colours(half_shaded, parameters):
    relit, _, strength = relight_street(
        half_shaded, half_shaded.light, OWN, SUN, light_from(parameters, "clear")
    )
    assert strength == pytest.approx(1)
    np.testing.assert_allclose(mean_colours(relit), mean_colours(half_shaded), rtol=1e-6)


@pytest.mark.parametrize("height", [20.0, 60.0])
def test_the_shadow_of_a_board_lies_where_its_rays_end(height):
    x, y = np.meshgrid(np.arange(-0.5, 0.5, 0.05), np.arange(-0.5, 0.5, 0.05))
    board = surfels(
        np.column_stack((x.ravel() + 8, y.ravel(), np.full(x.size, 1.0))),
        (0, 0, 1),
        0.04,
        0.2,
        SemanticClass.OTHER,
    )
    ground = road()
    sun = point_to_sun(180.0, height)
    lit = cast_sun(append_gaussians(ground, board), sun)[: len(ground)]
    ahead = 8 + 1 / np.tan(np.radians(height))
    off = np.abs(ground.means[:, :2] - (ahead, 0)).max(axis=1)
    assert lit[off < 0.3] == pytest.approx(0, abs=1e-9)
    assert lit[off > 1.2] == pytest.approx(sun[2])


def test_the_ways_of_the_sun_through_the_air_are_published_ones():
    assert air_mass(point_to_sun(0, 90)) == pytest.approx(0.9997, abs=1e-4)
    assert air_mass(point_to_sun(0, 10)) == pytest.approx(5.586, abs=1e-3)


def test_a_lower_sun_is_weaker_and_redder(parameters):
    high, low = (light_from(parameters, "low_sun", point_to_sun(0, h)).colours[0] for h in (46.0, 5.0))
    assert np.all(low < high)
    assert low[0] / low[2] > 2 * high[0] / high[2]


def test_a_seed_draws_one_sky_and_seeds_draw_all_by_their_shares(parameters):
    skies = parameters.sky.skies
    names = [draw_sky_kind(skies, seed) for seed in range(400)]
    assert names[:20] == [draw_sky_kind(skies, seed) for seed in range(20)]
    shares = np.array([getattr(skies, name).share for name in SKY_NAMES])
    found = np.array([names.count(name) for name in SKY_NAMES]) / 400
    assert found == pytest.approx(shares / shares.sum(), abs=0.08)
    heights = [np.degrees(np.arcsin(draw_sun(skies.low_sun, seed, ANY_SKY)[2])) for seed in range(50)]
    assert skies.low_sun.lowest_sun_deg <= min(heights) < max(heights) <= skies.low_sun.highest_sun_deg


@pytest.mark.parametrize(
    "weather",
    [
        Weather(kind="dry"),
        Weather(kind="rain", precipitation_mm_h=8.0),
        Weather(kind="snow", precipitation_mm_h=2.0, snow_accumulation_h=1.0),
        Weather(kind="ice"),
    ],
    ids=lambda weather: weather.kind,
)
def test_cloud_closes_over_what_falls_and_opens_when_it_has_ended(weather, half_shaded, parameters):
    asphalt = load("surface", "dense-asphalt")
    scene = ClearScene(
        gaussians=half_shaded, environment=np.zeros((2, 4, 3), np.float32), to_sun=SUN, daylight=OWN
    )

    def skies(falling, named=ANY_SKY):
        state = surface_state(replace(weather, falling=falling), asphalt)
        return [
            choose_light(
                scene,
                ClipConditions(state=state, pavement=asphalt, parameters=parameters, seed=seed, sky=named),
            )
            for seed in range(12)
        ]

    closed = {"rain": {True}, "snow": {True}, "dry": set(), "ice": {True, False}}[weather.kind]
    for falling in (True, False):
        assert ({light.name for light in skies(falling)} == {"overcast"}) == (falling in closed)
    named = skies(False, NamedSky(kind="low_sun", sun_azimuth_deg=30.0, sun_elevation_deg=8.0))
    assert {light.name for light in named} == {"low_sun"}
    for light in named:
        np.testing.assert_allclose(light.to_sun, point_to_sun(30.0, 8.0))


def test_the_names_of_skies_are_those_of_the_catalogue():
    assert tuple(field.name for field in fields(Skies)) == SKY_NAMES


def test_a_camera_that_sees_snow_in_the_sun_opens_no_further_than_shows_its_relief(parameters):
    p = parameters.sky
    for seed in range(20):
        assert expose_light(1.0, 1.4, p, seed) * 1.4 <= p.brightest_ground * (1 + 1e-12)
        assert expose_light(0.25, 0.04, p, seed) == expose_light(0.25, 0.02, p, seed)


def test_closed_cloud_has_structure_and_keeps_the_mean_that_lights_the_street(parameters):
    """The street's light is that of the smooth sky; its clouds only move it about."""
    p, airlight = parameters.sky.clouds, np.array((0.5, 0.52, 0.55))
    rows = draw_closed_sky(airlight, 1.5, 0.0, p, 3, ABOVE, 128)
    smooth = np.outer(1 + 1.5 * np.sin(ABOVE), airlight)[:, None]
    relative = (rows / smooth)[..., 1]
    assert relative.mean() == pytest.approx(1, abs=0.08)
    assert relative[:24].std() > 0.5 * 0.5 * p.contrast
    assert draw_closed_sky(airlight, 1.5, 50.0, p, 3, ABOVE, 128).std(axis=1).max() < 1e-3


def test_the_sun_stands_where_it_shines_from_and_haze_blurs_it(parameters):
    sun = point_to_sun(40.0, 30.0)
    elevation, azimuth = row_elevations(720)[:360], np.pi - (np.arange(1440) + 0.5) / 720 * np.pi
    clear, haze = (
        draw_sunny_sky(light_from(parameters, name, sun), parameters.sky.clouds, 1, elevation, 1440)
        for name in ("clear", "haze")
    )
    row, column = np.unravel_index(clear[..., 1].argmax(), clear.shape[:2])
    assert np.degrees((elevation[row], azimuth[column])) == pytest.approx((30, 40), abs=0.7)
    assert clear.max() > 5 * haze.max()
    # blue overhead, pale below, and haze without colour
    assert clear[0, 0, 2] > 2 * clear[0, 0, 0]
    assert haze[200, 0, 2] < 1.3 * haze[200, 0, 0]
