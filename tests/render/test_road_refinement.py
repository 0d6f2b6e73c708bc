"""Pieces of road Gaussians: short enough, in the same places, and as opaque and as bright as the whole."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.road_refinement import LENGTH_BY_FEATURE, refine_road
from tasks.scene.surroundings import add_surroundings
from tasks.surface.road_profile import RoadHazard
from tests.render.test_road_edit import relief_of
from tests.toy_street import toy_street

SCENE = toy_street()
HAZARD = RoadHazard(center_m=10.1, length_m=0.6, height_m=0.1)


@pytest.mark.parametrize("length", [0.6, 1.5])
def test_nothing_about_the_feature_is_longer_than_its_share_of_it(length):
    fine = refine_road(SCENE.gaussians, relief_of(replace(HAZARD, length_m=length)))
    road = fine.class_id == SemanticClass.ROAD
    on = road & (np.abs(fine.means[:, 0] - 10.1) < length / 2)
    assert fine.scales[on, 0].max() == pytest.approx(LENGTH_BY_FEATURE * length, rel=1e-6)
    assert on.sum() > 300


def test_what_the_feature_does_not_touch_is_bitwise_unchanged_and_in_order():
    fine = refine_road(SCENE.gaussians, relief_of(HAZARD))
    away = np.abs(SCENE.gaussians.means[:, 0] - 10.1) >= 0.3 + 3 * 0.15
    away |= SCENE.gaussians.class_id != SemanticClass.ROAD
    kept = slice(0, away.sum())
    for name in ("means", "scales", "quats_wxyz", "opacities", "sh", "normals", "class_id"):
        np.testing.assert_array_equal(getattr(fine, name)[kept], getattr(SCENE.gaussians, name)[away])


def test_a_long_feature_needs_no_pieces():
    wide = RoadHazard(center_m=10.0, length_m=5.0, height_m=0.1)
    assert refine_road(SCENE.gaussians, relief_of(wide)) is SCENE.gaussians


def test_pieces_hide_what_lies_behind_as_the_whole_did():
    """Opacity of all pieces, seen from above, against that of the one Gaussian they were cut from."""
    one = type(SCENE.gaussians)(
        **{name: value[4:5] if np.ndim(value) else value for name, value in vars(SCENE.gaussians).items()}
    )
    one.means[:] = (10.0, 0.0, 0.0)
    for opacity, tolerance in ((0.3, 0.01), (0.95, 0.05)):
        one.opacities[:] = opacity
        fine = refine_road(one, relief_of(HAZARD))
        x = np.linspace(9.7, 10.3, 61)

        def hidden(cloud, x=x):
            u = (x[:, None] - cloud.means[:, 0]) / cloud.scales[:, 0]
            return 1 - (1 - cloud.opacities * np.exp(-u * u / 2)).prod(axis=1)

        assert len(fine) > 5
        np.testing.assert_allclose(hidden(fine), hidden(one), atol=tolerance)


def test_a_flat_road_of_pieces_is_as_bright_as_before():
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    pose[:3, 3] = (6.0, 0.0, 1.3)
    K = np.array([[120.0, 0, 80], [0, 120, 50], [0, 0, 1]])
    clouds = SCENE.gaussians, refine_road(SCENE.gaussians, relief_of(HAZARD))
    whole, cut = (rasterise_view(prepare_gaussians(c), np.linalg.inv(pose), K, 160, 100) for c in clouds)
    changed = np.abs(whole.rgb - cut.rgb).max(axis=-1) > 1e-6
    assert changed.sum() > 300
    assert np.abs(whole.alpha - cut.alpha).max() < 0.04
    assert cut.rgb[changed].mean() == pytest.approx(whole.rgb[changed].mean(), rel=0.02)


def test_pieces_know_how_densely_they_cover():
    """As a count of the cut road says, in the middle of a feature long enough to be all pieces there."""
    ground = add_surroundings(replace(SCENE.gaussians, antialiased=True))
    fine = refine_road(ground, relief_of(replace(HAZARD, length_m=1.5)))
    on = np.flatnonzero((fine.class_id == SemanticClass.ROAD) & (np.abs(fine.means[:, 0] - 10.1) < 0.3))
    counted = add_surroundings(fine).surroundings
    assert len(fine.surroundings) == len(fine)
    assert np.median(fine.surroundings[on, 0] / counted[on, 0]) == pytest.approx(1, abs=0.15)
