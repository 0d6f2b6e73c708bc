"""Refraction in the film on a road: Snell's law by vectors, and what a picture of known gradients becomes."""

from dataclasses import replace

import numpy as np

from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.wet.refraction import compute_film_shift, see_through_film
from tasks.render.weather.wet.wet_road import LightOnRoad, RoadFilm, wet_layer
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import TEXTURE_MM, flat_gbuffer
from tests.render.weather.test_wet_road import CLOUDY, VIEW, see_road, sky  # noqa: F401

WATER, DEEP = 1.333, 0.005


def trace_film(view, depth_m: float) -> np.ndarray:
    """Where each road pixel's ray ends up under the film, projected without it, less the pixel: by Snell's vectors."""
    up = np.array([0.0, 0.0, 1.0])
    eye, rotation = view.T_world_camera[:3, 3], view.T_world_camera[:3, :3]
    found = np.zeros((*view.road.shape, 2))
    for row, column in np.argwhere(view.road):
        ray = view.rays[row, column].astype(float)
        end = eye + view.depth[row, column] * ray
        sight = ray / np.linalg.norm(ray)
        enters = end - sight * depth_m / -sight[2]
        cosine = -sight @ up
        inside = sight / WATER + (cosine / WATER - np.sqrt(1 - (1 - cosine**2) / WATER**2)) * up
        hit = (enters + inside * depth_m / -inside[2] - eye) @ rotation
        found[row, column] = [
            view.K[k, k] * hit[k] / hit[2] + view.K[k, 2] - 0.5 - (column, row)[k] for k in (0, 1)
        ]
    return found


def test_the_shift_is_that_of_rays_traced_through_the_film():
    _, gbuffer = flat_gbuffer(VIEW)
    view = see_road(gbuffer)
    shift, traced = compute_film_shift(view, DEEP, WATER), trace_film(view, DEEP)
    assert np.abs(shift - traced).max() < 1e-3 * np.abs(traced).max()
    assert shift[view.road][:, 1].min() > 0, "the texture comes nearer, so a pixel shows what lies below it"
    assert not shift[~view.road].any()


def test_the_film_of_fifty_millimetres_an_hour_moves_the_road_by_less_than_a_tenth_of_a_pixel():
    large = shutter(width=480, height=320, focal=400.0)
    _, gbuffer = flat_gbuffer(large)
    shift = compute_film_shift(see_road(gbuffer, large), 1.263e-3, WATER)
    assert 0.05 < np.abs(shift).max() < 0.1


def test_without_a_film_or_in_one_that_is_air_nothing_moves():
    _, gbuffer = flat_gbuffer(VIEW)
    view = see_road(gbuffer)
    assert not compute_film_shift(view, 0.0, WATER).any()
    assert np.abs(compute_film_shift(view, DEEP, 1.0)).max() < 1e-9


def test_a_picture_of_even_slope_moves_by_its_slope_and_the_edge_of_the_road_is_left():
    _, gbuffer = flat_gbuffer(VIEW)
    view = see_road(gbuffer)
    column, row = np.meshgrid(np.arange(160), np.arange(108))
    picture = np.repeat((0.002 * column + 0.003 * row)[..., None], 3, axis=-1).astype(np.float32)
    shift = compute_film_shift(view, DEEP, WATER)
    change = see_through_film(picture, view, shift) - picture
    inner = view.road.copy()
    for axis in (0, 1):
        inner &= np.roll(view.road, 1, axis) & np.roll(view.road, -1, axis)
    expected = (0.002 * shift[..., 0] + 0.003 * shift[..., 1])[inner]
    np.testing.assert_allclose(change[inner][:, 0], expected, atol=1e-6)
    assert not change[~view.road].any()


def test_only_a_film_that_refracts_moves_the_texture_and_by_its_smooth_share(parameters, sky):  # noqa: F811
    picture, gbuffer = flat_gbuffer(VIEW)
    rng = np.random.default_rng(1)
    picture *= rng.uniform(0.5, 1.5, picture.shape[:2])[..., None].astype(np.float32)
    film = RoadFilm(
        depth_mm=1.263, texture_depth_mm=TEXTURE_MM, parameters=parameters.kinds["rain"].film, seed=1
    )
    light = LightOnRoad(environment=CLOUDY, sky=sky, extinction=0.0)
    plain, refracted = (
        wet_layer(picture, gbuffer, VIEW, pixel_rays(VIEW), one, light)
        for one in (film, replace(film, refracts=True))
    )
    np.testing.assert_array_equal(plain.gain, refracted.gain)
    moved = np.abs(refracted.add - plain.add).max(axis=-1)
    road = see_road(gbuffer).road
    assert moved[road].max() > 1e-4 and not moved[~road].any()
    thin = replace(film, depth_mm=0.05, refracts=True)
    bare = wet_layer(picture, gbuffer, VIEW, pixel_rays(VIEW), thin, light).add
    plain_bare = wet_layer(picture, gbuffer, VIEW, pixel_rays(VIEW), replace(thin, refracts=False), light).add
    assert np.abs(bare - plain_bare).max() < 0.05 * moved.max()
