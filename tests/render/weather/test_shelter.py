"""Cover above keeps snow off: by Beer's law, and no surface shelters itself."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.weather.scene_light import append_gaussians
from tasks.render.weather.snow.shelter import open_share
from tests.render.weather.scenes import surfels

SPACING, SIZE = 0.05, 0.012


def plate(height: float, normal=(0, 0, 1), half: float = 1.0):
    """Small surfels strewn evenly at one height."""
    x, y = np.meshgrid(np.arange(-half, half, SPACING), np.arange(-half, half, SPACING))
    points = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, height)))
    return surfels(points, normal, SIZE, 0.2, SemanticClass.OTHER)


def inner(cloud) -> np.ndarray:
    return (np.abs(cloud.means[:, :2]) < 0.7).all(axis=1)


@pytest.mark.parametrize("layers", [1, 2, 3])
def test_what_reaches_the_lowest_layer_falls_by_its_area_with_every_layer_above(layers):
    cloud = plate(0.0)
    for k in range(layers):
        cloud = append_gaussians(cloud, plate(1.0 + k))
    share = open_share(cloud)
    low, top = inner(cloud) & (cloud.means[:, 2] == 0), inner(cloud) & (cloud.means[:, 2] == layers)
    density = 2 * np.pi * SIZE**2 * 0.95 / SPACING**2
    assert share[low].mean() == pytest.approx(np.exp(-layers * density), rel=0.05)
    assert np.all(share[top] == 1)


def test_a_wall_above_shades_nothing_and_a_thin_leaf_less_than_a_solid_one():
    low = plate(0.0)
    wall = append_gaussians(low, plate(1.0, (0, 1, 0)))
    solid, thin = append_gaussians(low, plate(1.0)), append_gaussians(low, plate(1.0))
    thin = replace(thin, opacities=np.where(thin.means[:, 2] == 1, np.float32(0.1), thin.opacities))
    under = [
        open_share(cloud)[inner(cloud) & (cloud.means[:, 2] == 0)].mean() for cloud in (wall, thin, solid)
    ]
    assert under[0] == 1
    assert 1 > under[1] > under[2]


@pytest.mark.parametrize("slope", [0.0, 0.5, 0.9])
def test_no_surface_shelters_itself(slope):
    cloud = plate(0.0)
    means = cloud.means.copy()
    means[:, 2] = slope * means[:, 0] + 1e-3 * np.random.default_rng(1).standard_normal(len(cloud))
    assert open_share(replace(cloud, means=means)).min() > 1 - 1e-9
