import json

import cv2
import numpy as np
import pytest

from catalogs.entries import load
from catalogs.scenes import write_scene
from flows.making.scenes import render_pose, scene_import
from tasks.errors import InputError
from tasks.render.camera import world_to_camera
from tests.toy_street import toy_street


@pytest.fixture
def pose(tmp_path):
    write_scene(toy_street(), tmp_path / "scene", {})
    view = world_to_camera(load("camera", "dashcam-480x320").T_rig_camera)
    content = {
        "viewmat": view.tolist(),
        "K": [[80, 0, 48], [0, 80, 32], [0, 0, 1]],
        "width": 96,
        "height": 64,
    }
    (tmp_path / "pose.json").write_text(json.dumps(content))
    return tmp_path


def test_one_frame_is_written_with_all_its_buffers(pose):
    render_pose(str(pose / "scene"), str(pose / "pose.json"), str(pose / "out"))
    picture = cv2.imread(str(pose / "out" / "rgb.png"))
    assert picture.shape == (64, 96, 3)
    shapes = {
        name: np.load(pose / "out" / f"{name}.npy").shape for name in ("depth", "alpha", "normal", "class")
    }
    assert shapes == {"depth": (64, 96), "alpha": (64, 96), "normal": (64, 96, 3), "class": (64, 96)}


def test_depth_of_the_road_is_that_of_the_plane_below_the_camera(pose):
    render_pose(str(pose / "scene"), str(pose / "pose.json"), str(pose / "out"))
    depth, label = np.load(pose / "out" / "depth.npy"), np.load(pose / "out" / "class.npy")
    row = 55
    expected = 1.4 * 80 / (row + 0.5 - 32)
    assert label[row, 48] == 1
    # discs 0.15 m wide seen at a grazing angle: the nearer half of each blends in
    assert depth[row, 48] == pytest.approx(expected, rel=0.05)


def test_a_sun_below_the_horizon_is_refused_before_the_files_are_read(tmp_path):
    with pytest.raises(InputError, match="sun"):
        scene_import(
            str(tmp_path / "no.ply"),
            str(tmp_path / "no.csv"),
            str(tmp_path / "out"),
            sun_direction_deg=(0, -5),
        )
    assert not (tmp_path / "out").exists()


def test_every_fault_of_a_pose_file_is_listed(pose):
    (pose / "pose.json").write_text('{"viewmat": [[1, 0], [0, 1]], "K": "wide", "width": -3}')
    with pytest.raises(InputError) as caught:
        render_pose(str(pose / "scene"), str(pose / "pose.json"), str(pose / "out"))
    assert len(caught.value.problems) == 4
    for key in ("viewmat", "K", "width", "height"):
        assert key in str(caught.value)
    assert not (pose / "out").exists()


def test_a_pose_file_is_bounded_before_it_is_read(pose):
    (pose / "pose.json").write_text(" " * 2**20 + "{}")
    with pytest.raises(InputError, match="a pose must have at most 1048576 bytes"):
        render_pose(str(pose / "scene"), str(pose / "pose.json"), str(pose / "out"))
