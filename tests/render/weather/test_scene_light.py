"""Reading the clear light off the ground, and taking the sun out of it."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.render.weather.ground_grid import ground_grid, read_between, window_sums
from tasks.render.weather.scene_light import (
    append_gaussians,
    facade_light,
    ground_light,
    mean_colours,
    recolour_gaussians,
    without_sun,
)
from tasks.scene.spherical_harmonics import C0
from tests.render.weather.scenes import ASPHALT, road, surfels


@pytest.fixture
def half_shaded():
    """A road whose left third lies in a shadow of a quarter of the light."""
    street = road(length=12.0)
    shade = np.where(street.means[:, 1] > 1.4, 0.25, 1.0).astype(np.float32)
    colours = mean_colours(street) * shade[:, None]
    return replace(street, sh=((colours - 0.5) / C0)[:, None].astype(np.float32)), shade


def test_window_sums_count_the_points_of_nine_cells():
    rng = np.random.Generator(np.random.Philox(4))
    points = rng.uniform(-3, 5, (400, 2))
    grid = ground_grid(points, 0.7)
    sums = window_sums(grid, points, np.ones((400, 1)))[..., 0]
    cells = np.floor((points - grid.origin) / grid.cell_m)
    for i, j in ((3, 4), (7, 2), (10, 11)):
        assert sums[i, j] == pytest.approx(((np.abs(cells - (i, j))) <= 1).all(axis=1).sum())


def test_reading_between_cells_is_linear():
    grid = ground_grid(np.array([[0.0, 0.0], [4.0, 3.0]]), 0.5)
    i, j = np.meshgrid(np.arange(grid.shape[0]), np.arange(grid.shape[1]), indexing="ij")
    points = np.array([[0.3, 0.2], [2.71, 1.9], [3.9, 2.5]])
    place = (points - grid.origin) / grid.cell_m - 0.5
    assert read_between(grid, 2.0 * i - j, points) == pytest.approx(2 * place[:, 0] - place[:, 1])


def test_the_lit_road_is_read_although_a_third_is_shaded(half_shaded):
    street, _ = half_shaded
    light = ground_light(street, SemanticClass.ROAD)
    assert light.lit == pytest.approx(np.full(3, ASPHALT), rel=0.03)
    inside = read_between(light.grid, light.illumination, np.array([[6.0, 3.0], [6.0, -2.0]]))
    assert inside == pytest.approx([0.25, 1.0], rel=0.05)


def test_cloud_draws_light_and_shade_together(half_shaded):
    street, shade = half_shaded
    colours = mean_colours(without_sun(street, 0.3)).mean(axis=1)
    deep, lit = np.abs(street.means[:, 1] - 3) < 0.5, np.abs(street.means[:, 1] + 2) < 1
    assert shade[deep].max() == 0.25
    assert colours[deep].mean() / colours[lit].mean() == pytest.approx(0.25**0.3, rel=0.05)
    assert mean_colours(without_sun(street, 1.0)) == pytest.approx(mean_colours(street), abs=1e-6)


def test_cloud_lights_the_shaded_side_of_the_street_as_the_sunny_one(half_shaded):
    y, z = np.meshgrid(np.arange(0, 20, 0.2), np.arange(0, 6, 0.2))
    points = np.column_stack((y.ravel(), np.zeros(y.size), z.ravel()))
    sunny = surfels(points, (0, -1, 0), 0.1, 0.4, SemanticClass.BUILDING)
    shaded = surfels(points, (0, 1, 0), 0.1, 0.1, SemanticClass.BUILDING)
    roof = surfels(points, (0, 0, 1), 0.1, 0.2, SemanticClass.BUILDING)
    scene = append_gaussians(append_gaussians(sunny, shaded), roof)
    light = facade_light(scene)
    n = len(sunny)
    assert light[[0, n, 2 * n]] == pytest.approx([1.0, 0.25, 1.0])
    colours = mean_colours(without_sun(scene, 0.3)).mean(axis=1)
    assert colours[n] / colours[0] == pytest.approx(0.25**0.3, rel=1e-3)


def test_recolouring_scales_the_whole_colour_in_linear_light(half_shaded):
    street, _ = half_shaded
    for scene in (street, replace(street, display_encoded=True)):
        gain, add = np.full(len(scene), 0.4), np.full((len(scene), 3), 0.05)
        expected = 0.4 * mean_colours(scene) + 0.05
        assert mean_colours(recolour_gaussians(scene, gain, add)) == pytest.approx(expected, rel=1e-4)


def test_light_needs_ground_to_be_read_from(half_shaded):
    street, _ = half_shaded
    with pytest.raises(InputError, match="no Gaussian of the scene has class sidewalk"):
        ground_light(street, SemanticClass.SIDEWALK)
