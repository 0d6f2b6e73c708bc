"""From stereo pictures to a street, end to end: on a rendered set everywhere, on a real one where it lies."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catalogs.scenes.stereo_folder import read_stereo_folder
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.reconstruction.reconstruct import Reconstruction, reconstruct_street
from tasks.reconstruction.sequence import StereoSequence, StereoSettings
from tasks.render.camera import world_to_camera
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.scene.gaussians import check_gaussians
from tests.reconstruction.stereo_set import (
    CAMERA_HEIGHT,
    GAINS,
    HEIGHT,
    KERB_LEFT,
    KERB_RIGHT,
    WIDTH,
    StereoSet,
    stereo_set,
)

SETTINGS = StereoSettings(
    disparities=32,
    held_out_every=4,
    held_out_first=3,
    camera_ahead_of_front_axle=-0.5,
    first_station=1.0,
    extension=3.0,
    environment_rows=128,
)
HELD_OUT = 3


@pytest.fixture(scope="module")
def truth() -> StereoSet:
    return stereo_set()


@pytest.fixture(scope="module")
def built(truth: StereoSet) -> Reconstruction:
    return reconstruct_street(truth.sequence, SETTINGS)


def test_a_picture_never_seen_is_shown_within_30_db(built: Reconstruction) -> None:
    (figure,) = built.held_out
    assert figure.frame == HELD_OUT
    assert figure.psnr_db > 30
    assert figure.road_psnr_db > 30
    assert figure.ssim > 0.88


def test_depth_of_a_picture_never_seen_is_right_to_two_percent(
    built: Reconstruction, truth: StereoSet
) -> None:
    shown = rasterise_view(
        prepare_gaussians(built.scene.gaussians),
        world_to_camera(built.T_world_camera[HELD_OUT]),
        truth.K,
        WIDTH,
        HEIGHT,
    )
    true = rasterise_view(
        truth.street, world_to_camera(truth.T_street_camera[HELD_OUT]), truth.K, WIDTH, HEIGHT
    )
    both = (shown.alpha > 0.5) & (true.alpha > 0.5)
    error = np.abs(shown.depth[both] / true.depth[both] - 1)
    assert both.sum() > 0.97 * (true.alpha > 0.5).sum()
    assert np.median(error) < 0.02
    assert ((shown.class_id == SemanticClass.ROAD) == (true.class_id == SemanticClass.ROAD)).mean() > 0.96


def test_world_has_z_up_and_its_origin_on_the_road_at_the_start(built: Reconstruction) -> None:
    camera = built.T_world_camera[0]
    assert camera[2, 3] == pytest.approx(CAMERA_HEIGHT, abs=0.03)
    np.testing.assert_allclose(camera[:3, :3], [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=np.radians(0.7))
    np.testing.assert_allclose(built.scene.route.T_world_rig[0], np.eye(4), atol=1e-9)
    # the camera stands half a metre behind the front axle, the route starts a metre after the first pose
    assert camera[0, 3] == pytest.approx(-1.5, abs=0.03)


def test_route_follows_the_cameras_and_runs_on_beyond_them(built: Reconstruction, truth: StereoSet) -> None:
    driven = 0.7 * 6
    assert built.scene.route.length == pytest.approx(driven - 1.0 + SETTINGS.extension, abs=0.1)
    assert np.abs(built.scene.route.T_world_rig[:, 1, 3]).max() < 0.03


def test_kerbs_end_the_carriageway(built: Reconstruction) -> None:
    assert built.scene.carriageway_left == pytest.approx(KERB_LEFT, abs=0.2)
    assert built.scene.carriageway_right == pytest.approx(KERB_RIGHT, abs=0.2)


def test_exposure_of_every_picture_is_found(built: Reconstruction) -> None:
    # the held-out picture's is interpolated between its neighbours, here 1.1 and 0.8
    expected = np.array(GAINS)
    expected[HELD_OUT] = np.sqrt(GAINS[HELD_OUT - 1] * GAINS[HELD_OUT + 1])
    ratio = built.exposure.gains / expected
    np.testing.assert_allclose(ratio / np.median(ratio), 1, atol=0.02)


def test_sky_is_a_layer_of_its_own(built: Reconstruction, truth: StereoSet) -> None:
    rows, columns = built.scene.environment.shape[:2]
    ahead = built.scene.environment[int(rows * 0.45), columns // 2] * built.exposure.gains[0]
    true = truth.environment[int(64 * 0.45), 64]
    np.testing.assert_allclose(ahead, true, rtol=0.03)
    high = built.scene.gaussians.means[:, 2] > 4.0
    assert high.mean() < 0.001


def test_the_cloud_is_sound_and_holds_road(built: Reconstruction) -> None:
    gaussians = built.scene.gaussians
    check_gaussians(gaussians)
    road = gaussians.class_id == SemanticClass.ROAD
    assert road.mean() > 0.1
    assert gaussians.normals[road, 2].min() > 0.99


def test_held_out_pictures_leave_no_trace_in_the_scene(built: Reconstruction, truth: StereoSet) -> None:
    blind = {}
    for side in ("left", "right"):
        pictures = getattr(truth.sequence, side).copy()
        pictures[HELD_OUT] = 0
        blind[side] = pictures
    again = reconstruct_street(replace(truth.sequence, **blind), SETTINGS)
    for name in ("means", "opacities", "sh", "scales"):
        np.testing.assert_array_equal(
            getattr(again.scene.gaussians, name), getattr(built.scene.gaussians, name), err_msg=name
        )
    np.testing.assert_array_equal(again.scene.environment, built.scene.environment)
    np.testing.assert_array_equal(again.T_world_camera, built.T_world_camera)
    np.testing.assert_array_equal(again.exposure.gains, built.exposure.gains)


def test_poses_that_jitter_are_put_right_by_the_pictures(built: Reconstruction, truth: StereoSet) -> None:
    draw = np.random.Generator(np.random.Philox(5))
    jitter = np.tile(np.eye(4), (7, 1, 1))
    for i in (1, 2, 4, 5):
        jitter[i, :3, :3] = Rotation.from_rotvec(np.radians(draw.uniform(-0.3, 0.3, 3))).as_matrix()
        jitter[i, :3, 3] = draw.uniform(-0.02, 0.02, 3)
    shaken = replace(truth.sequence, T_origin_camera=truth.sequence.T_origin_camera @ jitter)
    found = reconstruct_street(shaken, replace(SETTINGS, refinement_passes=0)).T_world_camera
    for i, j in ((0, 1), (1, 2), (2, 4), (4, 5)):
        given, steady, mended = (
            np.linalg.inv(T[i]) @ T[j] for T in (shaken.T_origin_camera, built.T_world_camera, found)
        )
        before, after = (np.abs(T[:3, :3] - steady[:3, :3]).max() for T in (given, mended))
        assert after < 0.4 * before


def test_too_few_pictures_and_too_short_a_drive_are_refused(truth: StereoSet) -> None:
    first = {name: getattr(truth.sequence, name)[:3] for name in ("left", "right", "T_origin_camera")}
    with pytest.raises(InputError, match="at least 3 pictures must remain"):
        reconstruct_street(replace(truth.sequence, **first), replace(SETTINGS, held_out_first=0))
    with pytest.raises(InputError, match="the drive must be longer than"):
        reconstruct_street(truth.sequence, replace(SETTINGS, first_station=5.0))


def test_left_and_right_exchanged_are_refused(truth: StereoSet) -> None:
    sequence = replace(truth.sequence, left=truth.sequence.right, right=truth.sequence.left)
    with pytest.raises(InputError, match="with left and right exchanged: exchange them"):
        reconstruct_street(sequence)


def test_poses_that_map_the_wrong_way_are_refused(truth: StereoSet) -> None:
    """They made a scene without a road, whose figures were NaN."""
    wrong = replace(truth.sequence, T_origin_camera=np.linalg.inv(truth.sequence.T_origin_camera))
    with pytest.raises(InputError, match="a row of poses must map the left camera's axes"):
        reconstruct_street(wrong)


def test_a_real_street_is_shown_within_20_db_and_its_road_within_22(outside_data: Path) -> None:
    folder = outside_data / "measured" / "kitti_street"
    if not folder.is_dir():
        pytest.skip(f"no stereo sequence at {folder}")
    short = _halve_sequence(read_stereo_folder(folder), slice(12, 21))
    settings = StereoSettings(disparities=64, refinement_passes=2, extension=5.0, environment_rows=256)
    (figure,) = reconstruct_street(short, settings).held_out
    assert figure.frame == 4
    assert figure.psnr_db > 20
    assert figure.road_psnr_db > 22


def _halve_sequence(sequence: StereoSequence, frames: slice) -> StereoSequence:
    """Some of the pictures at half the width and height."""
    intrinsics = sequence.intrinsics.copy()
    intrinsics[:2, 2] += 0.5
    intrinsics[:2] /= 2
    intrinsics[:2, 2] -= 0.5

    def small(pictures: np.ndarray) -> np.ndarray:
        count, rows, columns = len(pictures), pictures.shape[1] // 2, pictures.shape[2] // 2
        cut = pictures[:, : 2 * rows, : 2 * columns].reshape(count, rows, 2, columns, 2, 3)
        return np.rint(cut.mean(axis=(2, 4))).astype(np.uint8)

    return replace(
        sequence,
        left=small(sequence.left[frames]),
        right=small(sequence.right[frames]),
        T_origin_camera=sequence.T_origin_camera[frames],
        intrinsics=intrinsics,
    )
