"""The light on a road feature: against closed forms, bounds and symmetry."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.render.road_edit import RoadRelief, apply_road_profile, measure_road_lift
from tasks.render.weather.relief import ReliefLight, clear_light, relief_ratios, relight_gaussians, sun_in
from tasks.render.weather.snow.road_anchors import road_anchors
from tasks.surface.road_profile import RoadHazard, road_elevation, road_slope
from tasks.surface.state import SurfaceState
from tests.render.weather.scenes import clear_sky, road, weather_over
from tests.toy_street import toy_street

SCENE = toy_street()
ROWS = 48


def relief_of(height: float, length: float = 2.0, center: float = 10.0) -> RoadRelief:
    hazard = RoadHazard(center_m=center, length_m=length, height_m=height)
    return RoadRelief(
        route=SCENE.route,
        elevation=lambda s: road_elevation(s, hazard),
        slope=lambda s: road_slope(s, hazard),
        near=center - length / 2,
        far=center + length / 2,
    )


def elevations() -> np.ndarray:
    return (np.pi / 2 - (np.arange(ROWS) + 0.5) / ROWS * np.pi)[:, None] * np.ones(2 * ROWS)


def light(gradient: float = 0.0, ground: float = 0.0, sun=(0.0, 0.0, 1.0), share: float = 0.0) -> ReliefLight:
    sky = 1 + gradient * np.sin(np.maximum(elevations(), 0))
    return ReliefLight(sky=sky, ground=ground, to_sun=np.array(sun), sun_share=share, shade=None)


def sun_at(elevation_deg: float, azimuth_deg: float) -> tuple[float, float, float]:
    e, a = np.radians((elevation_deg, azimuth_deg))
    return np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)


def closed_form(slope, ahead, behind, gradient, ground):
    """Irradiance on a facet of a ridge without end, sky L (1 + b sin(elevation)), by hand in two angles.

    A direction is its angle in the plane along the road and one off that plane; over the latter cos^2 adds up
    to pi / 2 and cos^3, which the gradient brings, to 4 / 3.
    """
    n = np.pi / 2 + np.arctan(slope)
    low, high = np.maximum(ahead, n - np.pi / 2), np.minimum(np.pi - behind, n + np.pi / 2)
    even = np.sin(high - n) - np.sin(low - n)
    steep = (high - low) * np.sin(n) / 2 - (np.cos(2 * high - n) - np.cos(2 * low - n)) / 4
    return np.pi / 2 * (even + ground * (2 - even)) + 4 / 3 * gradient * steep


@pytest.mark.parametrize("height", [0.1, -0.08])
@pytest.mark.parametrize(("gradient", "ground"), [(0.0, 0.0), (2.0, 0.0), (2.0, 0.5)])
def test_under_cloud_the_change_follows_the_overcast_sky_in_closed_form(height, gradient, ground):
    """Moon and Spencer's sky, zenith three times the horizon, b = 2; pi (1 + 2 b / 3) on the flat."""
    relief = relief_of(height)
    station, _, sky = relief_ratios(relief, light(gradient, ground))
    grid = np.linspace(relief.near, relief.far, 4001)
    rise = road_elevation(grid, HAZARDS[height])
    here = road_elevation(station, HAZARDS[height])
    angle = np.arctan2(rise[None] - here[:, None], np.abs(grid[None] - station[:, None]) + 1e-9)
    ahead = np.where(grid[None] > station[:, None] + 1e-3, angle, 0).max(axis=1)
    behind = np.where(grid[None] < station[:, None] - 1e-3, angle, 0).max(axis=1)
    expected = closed_form(road_slope(station, HAZARDS[height]), ahead, behind, gradient, ground)
    flat = np.pi * (1 + 2 * gradient / 3)
    np.testing.assert_allclose(sky, expected / flat, atol=3e-3)


HAZARDS = {h: RoadHazard(center_m=10.0, length_m=2.0, height_m=h) for h in (0.1, -0.08)}


def test_the_steepest_flank_of_a_hump_under_the_cie_overcast_sky_is_pinned():
    """Slope pi .1 / .6, 27.6 deg, over dark ground: (1 + cos) / 2 = .943 of the flat under an even sky."""
    for gradient, pinned in ((0.0, 0.943), (2.0, 0.916)):
        station, _, sky = relief_ratios(relief_of(0.1, 0.6), light(gradient))
        assert np.interp(9.85, station, sky) == pytest.approx(pinned, abs=4e-3)


def test_a_slope_towards_the_sun_is_brighter_and_one_away_from_it_darker():
    station, sun, _ = relief_ratios(relief_of(0.1), light(sun=sun_at(46, 180), share=0.8))
    near, far = np.interp([9.5, 10.5], station, sun)
    slope = np.pi * 0.1 / 2
    for value, side in ((near, 1), (far, -1)):
        by_hand = (np.sin(np.radians(46)) + side * slope * np.cos(np.radians(46))) / np.sqrt(1 + slope**2)
        assert value == pytest.approx(by_hand / np.sin(np.radians(46)), abs=1e-3)
    assert near > 1 > far


def test_a_low_sun_throws_the_hump_s_shadow_as_far_as_its_height_says():
    """Sun 5 deg high and straight behind: the crest's shadow ends .1 / tan(5 deg) = 1.14 m behind the crest."""
    station, sun, _ = relief_ratios(relief_of(0.1, 0.6), light(sun=sun_at(5, 180), share=0.8))
    assert np.interp(10.15, station, sun) == 0
    dark = station[(sun < 0.5) & (station > 10.2)]
    # the ray that grazes the crest's shoulder, not its very top, reaches furthest
    assert 1.1 < dark.max() - 10.0 < 1.25
    assert sun[-1] == pytest.approx(1, abs=1e-2)


def test_no_facet_gets_more_than_the_full_sun_or_the_full_sky():
    for height in (0.1, -0.08):
        _, sun, sky = relief_ratios(relief_of(height), light(0.0, 1.0, sun_at(30, 160), 0.8))
        assert sun.min() >= 0 and sun.max() <= 1 / np.sin(np.radians(30)) + 1e-9
        # ground as bright as an even sky: whichever way it turns, a facet gets the same
        np.testing.assert_allclose(sky, 1, atol=1e-3)


def test_a_hump_and_the_sun_mirrored_along_the_road_give_the_mirrored_light():
    _, sun, sky = relief_ratios(relief_of(0.1), light(1.0, 0.2, sun_at(20, 150), 0.7))
    _, mirrored_sun, mirrored_sky = relief_ratios(relief_of(0.1), light(1.0, 0.2, sun_at(20, 30), 0.7))
    np.testing.assert_allclose(sun, mirrored_sun[::-1], atol=1e-9)
    np.testing.assert_allclose(sky, mirrored_sky[::-1], atol=1e-9)


def test_the_light_joins_the_flat_road_without_a_jump():
    for height in (0.1, -0.08):
        _, sun, sky = relief_ratios(relief_of(height), light(2.0, 0.2, sun_at(46, 150), 0.8))
        assert np.abs(np.diff(sun)).max() < 0.01 and np.abs(np.diff(sky)).max() < 0.01
        assert abs(sun[[0, -1]] - 1).max() < 1e-3 and abs(sky[[0, -1]] - 1).max() < 2e-3


def test_the_sun_is_found_in_a_panorama_that_has_one():
    sky = clear_sky()
    row, column = 32 // 4 + 0.5, 32 // 2 + 0.5
    elevation, azimuth = np.pi / 2 - row / 32 * np.pi, np.pi - column / 64 * 2 * np.pi
    expected = sun_at(np.degrees(elevation), np.degrees(azimuth))
    np.testing.assert_allclose(sun_in(sky), expected, atol=1e-6)
    assert sun_in(np.minimum(sky, 0.9)) is None


def test_a_sun_told_lights_as_the_same_sun_shown(parameters):
    """The panorama less its sun's brightness, and the direction beside it: a stereo street has no more."""
    shown = clear_light(SCENE.gaussians, clear_sky(), parameters.sky)
    hidden = np.minimum(clear_sky(), 0.9)
    told = clear_light(SCENE.gaussians, hidden, parameters.sky, shown.to_sun)
    assert told.sun_share == pytest.approx(shown.sun_share, abs=0.02)
    assert clear_light(SCENE.gaussians, hidden, parameters.sky).sun_share == 0
    relief = relief_of(0.1)
    for a, b in zip(relief_ratios(relief, shown), relief_ratios(relief, told), strict=True):
        np.testing.assert_allclose(a, b, atol=0.02)


def test_only_the_road_on_the_feature_and_in_its_shadow_changes_colour(parameters):
    relief = relief_of(0.1)
    shaped, _ = apply_road_profile(SCENE.gaussians, relief, 4.0, -4.0)
    lit = relight_gaussians(shaped, relief, clear_light(SCENE.gaussians, clear_sky(), parameters.sky))
    changed = (lit.sh != shaped.sh).any(axis=(1, 2))
    along = np.abs(SCENE.gaussians.means[:, 0] - 10)
    assert changed.sum() > 100
    assert along[changed].max() < 1.0 + 20 * 0.1 + 1e-6
    for name in ("means", "quats_wxyz", "normals", "class_id"):
        np.testing.assert_array_equal(getattr(lit, name), getattr(shaped, name))


def test_a_flat_road_keeps_every_byte(parameters):
    dry = SurfaceState(kind="dry")
    scene, _ = weather_over(SCENE.gaussians, clear_sky(), dry, parameters, route=SCENE.route)
    assert scene is SCENE.gaussians


@pytest.mark.parametrize("kind", ["rain", "snow"])
def test_under_cloud_a_feature_has_no_sunny_side(parameters, kind):
    """The overcast sky is the same all around, so both flanks of a hump get the same light."""
    state = SurfaceState(
        kind=kind, precipitation_mm_h=1, film_depth_mm=0.1, snow_coverage=1.0, snow_depth_mm=9
    )
    if kind == "rain":
        state = replace(state, snow_coverage=0.0, snow_depth_mm=0.0)
    relief = relief_of(0.1, 2.0)
    shaped, _ = apply_road_profile(SCENE.gaussians, relief, 4.0, -4.0)
    arguments = (shaped, clear_sky(), state, parameters)
    flat, _ = weather_over(*arguments, route=SCENE.route)
    lit, _ = weather_over(*arguments, route=SCENE.route, relief=relief)
    assert len(lit) == len(flat)
    colour = [0.28209479 * g.sh[:, 0].mean(axis=1) + 0.5 for g in (flat, lit)]
    gain = colour[1] / np.maximum(colour[0], 1e-6)
    x = lit.means[:, 0]
    changed = colour[1] != colour[0]
    near, far = (gain[changed & (np.abs(x - place) < 0.2)].mean() for place in (9.5, 10.5))
    assert near == pytest.approx(far, abs=4e-3)
    assert near < 0.999


def test_the_crest_of_a_short_hump_carries_snow_like_the_road_about_it(parameters):
    """A hump of 0.6 m rises further above its neighbours' plane than an outlier may; it is road all the same."""
    relief = relief_of(0.1, 0.6, 8.0)
    shaped, _ = apply_road_profile(road(), relief, 4.0, -4.0)
    limits = parameters.kinds["snow"].snow_cover.anchors
    crest = np.flatnonzero(np.abs(shaped.means[:, 0] - 8.0) < 0.1)
    assert not np.isin(crest, road_anchors(shaped, limits).index).any()
    assert np.isin(crest, road_anchors(shaped, limits, measure_road_lift(shaped, relief)).index).all()
