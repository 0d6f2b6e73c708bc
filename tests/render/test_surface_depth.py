"""Depth is that of the surface at the pixel, not the mean of the discs' centres, which comes out too near."""

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.camera import world_to_camera
from tasks.render.rasterise.blending import SURFACE_RATIO
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.scene.gaussians import Gaussians

WIDTH, HEIGHT, EYE = 96, 64, 1.4
K = np.array([[80.0, 0, 48], [0, 80.0, 32], [0, 0, 1]])
LOOKING_FORWARD = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, EYE], [0, 0, 0, 1]])


def make_discs(means: np.ndarray, radius: float, opacity: float) -> Gaussians:
    n = len(means)
    return Gaussians(
        means=means.astype(np.float32),
        quats_wxyz=np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        scales=np.tile(np.array([radius, radius, 0.005], np.float32), (n, 1)),
        opacities=np.full(n, opacity, np.float32),
        sh=np.zeros((n, 1, 3), np.float32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (n, 1)),
        class_id=np.full(n, SemanticClass.ROAD, np.uint8),
    )


def make_road(spacing: float, opacity: float = 0.95) -> Gaussians:
    x, y = np.meshgrid(np.arange(1, 30, spacing), np.arange(-8, 8, spacing), indexing="ij")
    return make_discs(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), 0.6 * spacing, opacity)


@pytest.mark.parametrize("opacity", [0.5, 0.95])
@pytest.mark.parametrize("spacing", [0.15, 0.3])
def test_overlapping_discs_of_one_plane_have_the_depth_of_the_plane(spacing, opacity):
    got = rasterise_view(
        prepare_gaussians(make_road(spacing, opacity)), world_to_camera(LOOKING_FORWARD), K, WIDTH, HEIGHT
    )
    rows = np.arange(40, HEIGHT)
    expected = EYE * 80 / (rows + 0.5 - 32)
    np.testing.assert_allclose(got.depth[rows, 48], expected, rtol=1e-4)


def test_a_pitched_camera_sees_the_same_plane():
    pose = LOOKING_FORWARD.copy()
    c, s = np.cos(0.06), np.sin(0.06)
    pose[:3, :3] = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ pose[:3, :3]
    view = world_to_camera(pose)
    got = rasterise_view(prepare_gaussians(make_road(0.2)), view, K, WIDTH, HEIGHT)
    u, v = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    up = (np.stack([(u - 48) / 80, (v - 32) / 80, np.ones_like(u)], axis=-1) @ view[:3, :3])[..., 2]
    seen = (got.alpha > 0.9) & (np.arange(HEIGHT)[:, None] > 40)
    np.testing.assert_allclose(got.depth[seen], (-EYE / up)[seen], rtol=1e-4)


def test_where_two_surfaces_mix_the_expected_depth_of_the_centres_stays():
    # a leaf nearly edge-on before a wall: its own plane would give depths from 0 to infinity
    cloud = make_discs(np.array([[4.0, 0, EYE + 0.02], [20.0, 0, EYE]]), 0.5, 0.6)
    got = rasterise_view(prepare_gaussians(cloud), world_to_camera(LOOKING_FORWARD), K, WIDTH, HEIGHT)
    assert np.nanmin(got.depth) >= 4 / SURFACE_RATIO
    assert np.nanmax(got.depth) <= 20 * SURFACE_RATIO
