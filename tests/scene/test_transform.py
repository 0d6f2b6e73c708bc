import numpy as np
from scipy.spatial.transform import Rotation

from tasks.conventions import SemanticClass
from tasks.scene.classify import classify_road
from tasks.scene.spherical_harmonics import sh_basis
from tasks.scene.transform import rotate_sh, transform_gaussians
from tests.toy_street import toy_street


def draw_directions(count: int) -> np.ndarray:
    d = np.random.default_rng(4).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def test_turned_colour_is_the_colour_seen_from_the_turned_back_direction():
    turn = Rotation.from_rotvec([0.7, -1.9, 0.4]).as_matrix()
    sh = np.random.default_rng(5).normal(size=(3, 16, 3)).astype(np.float32)
    d = draw_directions(200)
    expected = np.einsum("dk,nkc->ndc", sh_basis(d @ turn, 16), sh)
    found = np.einsum("dk,nkc->ndc", sh_basis(d, 16), rotate_sh(sh, turn))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_each_band_keeps_its_energy():
    turn = Rotation.from_rotvec([0.2, 0.3, -2.0]).as_matrix()
    sh = np.random.default_rng(6).normal(size=(5, 16, 3)).astype(np.float32)
    turned = rotate_sh(sh, turn)
    for band in (slice(0, 1), slice(1, 4), slice(4, 9), slice(9, 16)):
        np.testing.assert_allclose((turned[:, band] ** 2).sum(1), (sh[:, band] ** 2).sum(1), rtol=1e-4)


def test_moving_there_and_back_changes_nothing():
    cloud = toy_street().gaussians
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [90, 10, -30], degrees=True).as_matrix()
    pose[:3, 3] = [3, -2, 1]
    back = transform_gaussians(transform_gaussians(cloud, pose), np.linalg.inv(pose))
    np.testing.assert_allclose(back.means, cloud.means, atol=1e-5)
    np.testing.assert_allclose(np.abs((back.quats_wxyz * cloud.quats_wxyz).sum(1)), 1, atol=1e-6)


def test_road_is_found_on_the_carriageway_and_only_there():
    scene = toy_street()
    unlabelled = type(scene.gaussians)(
        **{**vars(scene.gaussians), "class_id": np.full(len(scene.gaussians), SemanticClass.OTHER, np.uint8)}
    )
    found = classify_road(unlabelled, scene.route, 3.0, -3.0).class_id == SemanticClass.ROAD
    true = (scene.gaussians.class_id == SemanticClass.ROAD) & (np.abs(scene.gaussians.means[:, 1]) <= 3.0)
    np.testing.assert_array_equal(found, true)


def test_a_road_normal_that_points_down_is_turned_up():
    scene = toy_street()
    upside_down = type(scene.gaussians)(**{**vars(scene.gaussians), "normals": -scene.gaussians.normals})
    cloud = classify_road(upside_down, scene.route, 3.0, -3.0)
    carriageway = (scene.gaussians.class_id == SemanticClass.ROAD) & (np.abs(cloud.means[:, 1]) <= 3.0)
    assert (cloud.normals[carriageway, 2] == 1).all()
