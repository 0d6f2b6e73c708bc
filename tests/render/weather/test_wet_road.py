"""Water on the road: optics against closed forms, and what grows with the film."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.composition import LUMINANCE
from tasks.render.weather.layer import recompose_layers
from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.sky import sky_light
from tasks.render.weather.wet import wet_road
from tasks.render.weather.wet.lobe import average_over_lobe
from tasks.render.weather.wet.puddles import compute_struck_slope, compute_wetness, water_surface
from tasks.render.weather.wet.reflection import mirrored_scene
from tasks.render.weather.wet.road_view import RoadView
from tasks.render.weather.wet.wet_road import (
    LightOnRoad,
    RoadFilm,
    fresnel_reflectance,
    wet_albedo_ratio,
    wet_layer,
)
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import ASPHALT, TEXTURE_MM, flat_gbuffer

FILMS = (0.0, 0.05, 0.189, 0.489, 0.839, 1.263, 4.0)
"""Film depths [mm]; the middle four are those of 2, 10, 25 and 50 mm/h."""
VIEW = shutter(width=160, height=108, focal=133.0)
CLOUDY = np.full((8, 16, 3), 0.9, np.float32)


def see_road(gbuffer, view=VIEW):
    """The pixels of class road as the road of one frame."""
    road = gbuffer.class_id == SemanticClass.ROAD
    return RoadView(
        road=road, mirrors=road, depth=gbuffer.depth, normal=gbuffer.normal,
        rays=pixel_rays(view), T_world_camera=view.T_world_camera, K=view.K,
    )  # fmt: skip


@pytest.fixture(scope="module")
def sky(parameters):
    return sky_light(np.full(3, ASPHALT / 0.1), 1.0, 0.002, 0.1, parameters.sky)


def wet(parameters, sky, film, wall_x=12.0, seed=1):
    picture, gbuffer = flat_gbuffer(VIEW, wall_x)
    on_road = RoadFilm(
        depth_mm=film, texture_depth_mm=TEXTURE_MM, parameters=parameters.kinds["rain"].film, seed=seed
    )
    light = LightOnRoad(environment=CLOUDY, sky=sky, extinction=0.0)
    return picture, gbuffer, wet_layer(picture, gbuffer, VIEW, pixel_rays(VIEW), on_road, light)


def test_water_reflects_two_percent_straight_down_and_all_at_grazing():
    assert fresnel_reflectance(1.0, 1.333) == pytest.approx((0.333 / 2.333) ** 2)
    assert fresnel_reflectance(0.0, 1.333) == pytest.approx(1.0)
    # Brewster's angle: only the perpendicular part is left, ((n^2 - 1) / (n^2 + 1))^2 / 2
    brewster = np.cos(np.arctan(1.333))
    assert fresnel_reflectance(brewster, 1.333) == pytest.approx(((1.333**2 - 1) / (1.333**2 + 1)) ** 2 / 2)
    assert np.all(np.diff(np.vectorize(fresnel_reflectance)(np.linspace(0, 1, 100), 1.333)) < 0)


def test_diffuse_reflectance_of_water_is_the_mean_over_the_hemisphere(parameters):
    cosine = (np.arange(20000) + 0.5) / 20000
    mean = np.mean(2 * cosine * np.vectorize(fresnel_reflectance)(cosine, 1.333))
    assert parameters.kinds["rain"].film.diffuse_reflectance == pytest.approx(mean, abs=0.001)


def test_wet_asphalt_keeps_half_its_albedo_and_white_paint_more():
    ratios = wet_albedo_ratio(np.array([0.05, 0.1, 0.3, 0.6]), 1.333, 0.066)
    assert ratios[1] == pytest.approx(0.52, abs=0.01)
    assert np.all(np.diff(ratios) > 0)
    assert np.all(ratios < 1)


def test_the_film_drowns_more_of_the_road_everywhere_as_it_rises(parameters):
    _, gbuffer = flat_gbuffer(VIEW)
    road = gbuffer.class_id == 1
    shares = [
        water_surface(see_road(gbuffer), film, TEXTURE_MM, parameters.kinds["rain"].film.water, 3).smooth
        for film in FILMS
    ]
    assert shares[0].max() == 0
    assert np.all(np.diff(shares, axis=0) >= 0)
    assert np.all(np.diff([share[road].mean() for share in shares]) > 0)
    matt, mirror = shares[2][road].mean(), shares[4][road].mean()  # at 2 and 25 mm/h
    assert matt < 0.25 and mirror > 0.75
    assert shares[-1][road].min() > 0.99
    assert all(share[~road].max() == 0 for share in shares)


def test_the_film_that_wets_wets_all_but_one_in_e(parameters):
    water = parameters.kinds["rain"].film.water
    assert compute_wetness(0.0, water) == 0
    assert compute_wetness(water.wetting_mm, water) == pytest.approx(1 - np.exp(-1))


def test_reflection_grows_and_the_road_darkens_with_the_film(parameters, sky):
    layers = [wet(parameters, sky, film)[2] for film in FILMS]
    road = flat_gbuffer(VIEW, 12.0)[1].class_id == 1
    assert np.all(np.diff([layer.add[road].mean() for layer in layers]) > 0)
    assert np.all(np.diff([layer.gain[road] for layer in layers], axis=0) <= 1e-6)


def test_a_dry_film_changes_nothing_and_a_thin_one_little(parameters, sky):
    picture, _, layer = wet(parameters, sky, 0.0)
    assert np.array_equal(recompose_layers(picture, [layer]), picture)
    _, _, thin = wet(parameters, sky, 0.001)
    assert np.abs(recompose_layers(picture, [thin]) - picture).max() < 0.02


def test_only_the_road_gets_wet(parameters, sky):
    picture, gbuffer, layer = wet(parameters, sky, 1.2)
    other = gbuffer.class_id != 1
    assert np.all(layer.gain[other] == 1)
    assert np.all(layer.add[other] == 0)
    assert np.abs(recompose_layers(picture, [layer])[~other] - picture[~other]).min() > 0


def test_earth_is_darkened_and_pavement_mirrors_as_the_road_does(parameters, sky):
    """By Lekner and Dorf at their own reflectance; walls, which face no rain, and cars stay as they are."""
    picture, gbuffer = flat_gbuffer(VIEW)
    film = RoadFilm(
        depth_mm=4.0, texture_depth_mm=TEXTURE_MM, parameters=parameters.kinds["rain"].film, seed=1
    )
    light = LightOnRoad(environment=CLOUDY, sky=sky, extinction=0.0)
    beside = (gbuffer.class_id == SemanticClass.ROAD) & (np.arange(160) > 100)
    inner = cv2.erode(beside.astype(np.uint8), np.ones((5, 5))) > 0
    paved = replace(gbuffer, class_id=np.where(beside, np.uint8(SemanticClass.SIDEWALK), gbuffer.class_id))
    road, pavement = (
        wet_layer(picture, one, VIEW, pixel_rays(VIEW), film, light) for one in (gbuffer, paved)
    )
    assert pavement.add[inner].min() > 0
    assert np.array_equal(pavement.add, road.add)
    for kind, soaks in (
        (SemanticClass.TERRAIN, True),
        (SemanticClass.VEHICLE, False),
    ):
        ground = replace(gbuffer, class_id=np.where(beside, np.uint8(kind), gbuffer.class_id))
        layer = wet_layer(picture, ground, VIEW, pixel_rays(VIEW), film, light)
        expected = wet_albedo_ratio(ASPHALT / (LUMINANCE @ sky.white), 1.333, 0.066) if soaks else 1.0
        assert layer.gain[inner] == pytest.approx(expected, rel=1e-3)
        assert np.all(layer.add[inner] == 0)
    standing = replace(ground, class_id=np.where(beside, np.uint8(SemanticClass.KERB), gbuffer.class_id))
    standing.normal[beside] = (1, 0, 0)
    upright = wet_layer(picture, standing, VIEW, pixel_rays(VIEW), film, light)
    assert np.all(upright.gain[inner] == 1)


@pytest.mark.parametrize(("low", "high", "solid"), [(0.35, 1.25, True), (1.2, 1.3, False)])
def test_no_mirrored_ray_passes_under_a_car_and_comes_out_above_it(low, high, solid):
    """Something dark hangs 8 m ahead between two heights: road behind it sees past a sign, not past a car."""
    picture, gbuffer = flat_gbuffer(VIEW)
    down = np.arange(108)[:, None] + 0.5 - 54.0
    hangs = (down > 133 * (1.4 - high) / 8) & (down < 133 * (1.4 - low) / 8) & (abs(np.arange(160) - 80) < 30)
    depth = np.where(hangs, np.float32(8), gbuffer.depth)
    seen = np.where(hangs[..., None], np.float32(0.02), picture)
    road = (gbuffer.class_id == SemanticClass.ROAD) & ~hangs
    view = replace(see_road(gbuffer), road=road, mirrors=road, depth=depth)
    mirrored = mirrored_scene(seen, view, CLOUDY, 0.0, np.ones(3))
    behind = road & (depth > 9) & (depth < 11) & (abs(np.arange(160) - 80) < 28)
    assert behind.sum() > 100
    if solid:
        assert mirrored[behind].max() < ASPHALT + 0.01
    else:
        assert mirrored[behind].mean() > 0.5


def test_the_mirror_takes_and_gives_no_more_than_all_light(parameters, sky):
    for film in FILMS:
        picture, _, layer = wet(parameters, sky, film)
        assert layer.gain.min() >= 0
        assert layer.gain.max() <= 1
        assert layer.add.max() <= max(picture.max(), 0.9) + 1e-5


def test_a_mirrored_stripe_lies_straight_below_its_stripe():
    picture, gbuffer = flat_gbuffer(VIEW, 12.0)
    mirrored = mirrored_scene(picture, see_road(gbuffer), CLOUDY, 0.0, np.ones(3))
    horizon, foot = 54, 54 + 133.0 * 1.4 / 12.0
    row = int(foot) + 6
    # a point of the wall and its image stand symmetric about the wall's foot, in height over the road
    source = round(2 * foot - row)
    assert source > horizon - 10
    assert mirrored[row, 10:-10] == pytest.approx(picture[source, 10:-10], abs=0.02)
    # below the image of the wall's top there is sky
    assert mirrored[-1, 80] == pytest.approx(np.full(3, 0.9), abs=1e-3)


def test_mirrored_pictures_have_mirrored_reflections():
    picture, gbuffer = flat_gbuffer(VIEW, 12.0)
    picture = picture * np.linspace(0.5, 1.5, 160, dtype=np.float32)[None, :, None]

    def reflect(picture, gbuffer):
        return mirrored_scene(picture, see_road(gbuffer), CLOUDY, 0.0, np.ones(3))

    flipped = replace(gbuffer, depth=gbuffer.depth[:, ::-1].copy(), class_id=gbuffer.class_id[:, ::-1].copy())
    straight = reflect(picture, gbuffer)
    turned = reflect(picture[:, ::-1].copy(), flipped)
    assert turned[:, ::-1] == pytest.approx(straight, abs=1e-4)


def test_puddles_stay_where_they_are_as_the_car_drives(parameters):
    """Two cameras a pixel's footprint apart see the same water at the same place in the world."""
    p = replace(parameters.kinds["rain"].film.water, ripple_slope=0.0)
    shares = []
    for x in (0.0, 1.0):
        view = shutter(width=160, height=108, focal=133.0, x=x)
        _, gbuffer = flat_gbuffer(view)
        surface = water_surface(see_road(gbuffer, view), 0.6, TEXTURE_MM, p, 8)
        column = 80
        place = x + gbuffer.depth[:, column] * pixel_rays(view)[:, column, 0]
        near = (gbuffer.class_id[:, column] == 1) & (place > 4.5) & (place < 7.0)
        shares.append(
            np.interp(np.linspace(4.8, 6.5, 20), place[near][::-1], surface.smooth[near, column][::-1])
        )
    assert shares[1] == pytest.approx(shares[0], abs=0.08)
    assert np.ptp(shares[0]) > 0.1


def test_a_pixel_that_leaves_its_own_mirrored_light_out_has_that_of_its_neighbours(
    parameters, sky, monkeypatch
):
    """As if every pixel had its own to half an 8-bit step."""
    view = shutter()
    picture, gbuffer = flat_gbuffer(view, 12.0)
    film = RoadFilm(
        depth_mm=1.2, texture_depth_mm=TEXTURE_MM, parameters=parameters.kinds["rain"].film, seed=1
    )
    light = LightOnRoad(environment=CLOUDY, sky=sky, extinction=0.0)
    arguments = (picture, gbuffer, view, pixel_rays(view), film, light)
    layer = wet_layer(*arguments)
    monkeypatch.setattr(wet_road, "LEAST_REACH", 1000)
    whole = wet_layer(*arguments)
    assert not np.array_equal(layer.add, whole.add)
    assert np.sqrt(((layer.add - whole.add) ** 2).mean()) < 0.5 / 255


def test_single_pixels_of_another_class_make_no_holes_in_the_wet_road_and_its_edge_is_soft(parameters, sky):
    """A kerb that shows through a gap between two discs of the road draws no black tooth."""
    picture, gbuffer = flat_gbuffer(VIEW)
    holes = np.zeros(gbuffer.class_id.shape, bool)
    holes[::5, ::7] = True
    torn = replace(gbuffer, class_id=np.where(holes, np.uint8(SemanticClass.KERB), gbuffer.class_id))
    film = RoadFilm(
        depth_mm=1.2, texture_depth_mm=TEXTURE_MM, parameters=parameters.kinds["rain"].film, seed=1
    )
    light = LightOnRoad(environment=CLOUDY, sky=sky, extinction=0.0)
    whole, other = (wet_layer(picture, one, VIEW, pixel_rays(VIEW), film, light) for one in (gbuffer, torn))
    inner = cv2.erode((gbuffer.class_id == SemanticClass.ROAD).astype(np.uint8), np.ones((9, 9))) > 0
    assert np.abs(other.add - whole.add)[inner].max() < 0.02


def test_a_hole_in_the_road_leaves_no_pixel_dark_but_its_own(parameters, sky):
    picture, gbuffer = flat_gbuffer(VIEW)
    row, column = (int(index.mean()) for index in np.nonzero(gbuffer.class_id == SemanticClass.ROAD))
    arrays = {name: getattr(gbuffer, name).copy() for name in ("depth", "alpha", "class_id")}
    arrays["depth"][row, column], arrays["alpha"][row, column], arrays["class_id"][row, column] = np.nan, 0, 0
    torn = replace(gbuffer, **arrays)
    film = RoadFilm(
        depth_mm=1.2, texture_depth_mm=TEXTURE_MM, parameters=parameters.kinds["rain"].film, seed=1
    )
    light = LightOnRoad(environment=CLOUDY, sky=sky, extinction=0.0)
    layer = wet_layer(picture, torn, VIEW, pixel_rays(VIEW), film, light)
    assert np.isfinite(layer.add).all() and np.isfinite(layer.gain).all()
    assert not layer.add[row, column].any() and layer.add[row, column + 2].all()


def test_drops_blur_what_a_film_mirrors_and_leave_its_share(parameters, sky):
    """Mirrored stripes lose contrast as the rate rises; the gain, which is the share's, stays."""
    view = shutter()
    picture, gbuffer = flat_gbuffer(view, 12.0)
    rows = np.arange(len(picture))[:, None, None]
    picture = np.where(rows > 160, picture, (rows // 8 % 2).astype(np.float32))
    light, layers = LightOnRoad(environment=CLOUDY, sky=sky, extinction=0.0), []
    for rate in (0.0, 10.0, 50.0):
        film = RoadFilm(
            depth_mm=4.0,
            texture_depth_mm=TEXTURE_MM,
            parameters=parameters.kinds["rain"].film,
            seed=1,
            rate_mm_h=rate,
        )
        layers.append(wet_layer(picture, gbuffer, view, pixel_rays(view), film, light))
    # where the part of the wall above the horizon is mirrored
    contrast = [np.abs(np.diff(layer.add[265:295, :, 0], axis=0)).mean() for layer in layers]
    assert contrast[0] > 1.5 * max(contrast[1:])
    assert all(np.array_equal(layer.gain, layers[0].gain) for layer in layers)


def test_a_struck_film_is_as_steep_as_its_own_ripples_and_the_drops_rings_together(parameters):
    water = parameters.kinds["rain"].film.water
    assert compute_struck_slope(0.0, water) == pytest.approx(water.ripple_slope)
    assert compute_struck_slope(50.0, water) == pytest.approx(
        np.hypot(water.ripple_slope, water.impact_slope * np.sqrt(50))
    )


def test_a_lobe_is_as_wide_across_as_it_is_steep_and_seen_flat(parameters):
    """One bright column, mirrored by a whole road: it spreads over the reach of its row, and no light is lost."""
    road = np.ones((4, 61), dtype=bool)
    light = np.zeros((4, 61, 3), np.float32)
    light[:, 30] = 1
    view = replace(see_road(flat_gbuffer(VIEW)[1]), road=road, mirrors=road)
    across = np.repeat(np.array([0, 1.5, 4, 9], np.float32)[:, None], 61, axis=1)
    out = average_over_lobe(light, view, 0, across)
    assert [(row > 0).sum() for row in out[..., 0]] == [1, 3, 9, 19]
    assert out.sum(axis=1) == pytest.approx(np.ones((4, 3)), rel=1e-5)


def test_refraction_in_the_deepest_film_stays_below_a_tenth_of_a_pixel():
    """Closed form, for the eye of the dashcam at 480x320: why the film is drawn without it."""
    film, eye, focal = 1.263e-3, 1.4, 400.0
    distance = np.linspace(1.4 * 400 / 160, 60, 500)
    steep = np.arctan(distance / eye)
    inside = np.arcsin(np.sin(steep) / 1.333)
    along = film * (np.tan(steep) - np.tan(inside))
    assert 0.05 < (along * focal * eye / distance**2).max() < 0.1
