"""Black ice to look at: clear air, and a mirror that is softer and shallower than that of a wet road."""

import numpy as np
import pytest

from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.sky import sky_light
from tasks.render.weather.wet.puddles import water_surface
from tasks.render.weather.wet.wet_road import LightOnRoad, RoadFilm, fresnel_reflectance, wet_layer
from tests.render.weather.scenes import ASPHALT, TEXTURE_MM, flat_gbuffer
from tests.render.weather.test_wet_road import CLOUDY, VIEW, see_road

GLAZE_MM, FILM_MM = 0.4, 0.489
"""Depths of the glaze, and of the water film of 10 mm/h."""


def film_on_road(parameters, kind, depth_mm):
    """The road's pixels, the share of each under a smooth film, and the layer of that film."""
    film = parameters.kinds[kind].film
    picture, gbuffer = flat_gbuffer(VIEW, 12.0)
    road = gbuffer.class_id == 1
    rows = np.arange(len(road))[:, None, None]
    picture = np.where(road[..., None], picture, (rows // 4 % 2).astype(np.float32))
    smooth = water_surface(see_road(gbuffer), depth_mm, TEXTURE_MM, film.water, 3).smooth
    sky = sky_light(np.full(3, ASPHALT / 0.1), 1.0, 0.0002, 0.1, parameters.sky)
    on_road = RoadFilm(depth_mm=depth_mm, texture_depth_mm=TEXTURE_MM, parameters=film, seed=3)
    light = LightOnRoad(environment=CLOUDY, sky=sky, extinction=0.0)
    return road, smooth, wet_layer(picture, gbuffer, VIEW, pixel_rays(VIEW), on_road, light)


def test_nothing_falls_on_ice_and_the_air_is_clear(parameters):
    look = parameters.find_look("ice")
    assert look.particles is None and look.snow_cover is None


def test_diffuse_reflectance_of_ice_is_the_mean_over_the_hemisphere(parameters):
    film, cosine = parameters.kinds["ice"].film, (np.arange(20000) + 0.5) / 20000
    mean = np.mean(2 * cosine * np.vectorize(fresnel_reflectance)(cosine, film.refractive_index))
    assert film.diffuse_reflectance == pytest.approx(mean, abs=0.001)


def test_a_glaze_mirrors_less_of_the_road_than_a_wet_film_and_softer(parameters):
    road, glazed, ice = film_on_road(parameters, "ice", GLAZE_MM)
    _, flooded, rain = film_on_road(parameters, "rain", FILM_MM)
    assert 0.3 < glazed[road].mean() < flooded[road].mean()
    # stripes of the wall, mirrored: neighbouring rows differ less in the ice
    contrast = []
    for layer in (ice, rain):
        change = np.abs(np.diff(layer.add[..., 0], axis=0))[road[1:] & road[:-1]]
        contrast.append(change.mean() / layer.add[road].mean())
    assert contrast[0] < 0.8 * contrast[1]


def test_a_glazed_road_is_darker_than_the_dry_one_by_its_own_light(parameters):
    road, _, ice = film_on_road(parameters, "ice", GLAZE_MM)
    assert ice.gain[road].max() < 0.75
