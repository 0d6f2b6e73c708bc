import numpy as np
import pytest

from catalogs.entries import load
from tasks.render.camera import body_poses, world_to_camera
from tasks.scene.route import route_from_positions

ROUTE = route_from_positions(np.stack([np.arange(100.0), np.zeros(100), np.zeros(100)], axis=1))
CAMERA = load("camera", "dashcam-480x320")
CG = {"cg_behind_front_axle": 1.2, "cg_height": 0.55}


def project_pixel(
    point: list[float], station: float = 10.0, heave: float = 0.0, pitch: float = 0.0
) -> np.ndarray:
    pose = body_poses(ROUTE, np.array([station]), np.array([heave]), np.array([pitch]), **CG)[0]
    camera = world_to_camera(pose @ CAMERA.T_rig_camera) @ [*point, 1.0]
    return (CAMERA.K @ camera[:3])[:2] / camera[2]


def test_a_level_camera_has_the_horizon_at_its_principal_row():
    assert project_pixel([1e7, 0, 1.4])[1] == pytest.approx(160, abs=1e-3)


def test_left_of_the_route_is_left_in_the_picture():
    assert project_pixel([30, 2, 0])[0] < 240 < project_pixel([30, -2, 0])[0]


@pytest.mark.parametrize("pitch_deg", [-3.0, 1.0, 4.0])
def test_nose_down_moves_the_horizon_up_by_f_tan_pitch(pitch_deg):
    pitch = np.radians(pitch_deg)
    row = project_pixel([1e8, 0, 1.4], pitch=pitch)[1]
    assert row - 160 == pytest.approx(-400 * np.tan(pitch), abs=1e-3)


def test_heave_lifts_the_camera_so_the_road_sinks_in_the_picture():
    assert project_pixel([30, 0, 0], heave=0.1)[1] > project_pixel([30, 0, 0])[1]


def test_the_centre_of_gravity_does_not_move_when_the_body_pitches():
    flat, dived = body_poses(ROUTE, np.array([20.0, 20.0]), np.zeros(2), np.array([0.0, 0.05]), **CG)
    centre = np.array([-1.2, 0, 0.55, 1])
    np.testing.assert_allclose(flat @ centre, dived @ centre, atol=1e-12)
    assert (dived @ [0, 0, 0, 1])[2] < (flat @ [0, 0, 0, 1])[2], "the front axle goes down"


def test_heave_and_pitch_are_taken_in_the_rig_frame_of_a_climbing_road():
    climbing = route_from_positions(np.stack([np.arange(50.0), np.zeros(50), 0.1 * np.arange(50.0)], axis=1))
    at = climbing.pose(20.0)
    lifted = body_poses(climbing, np.array([20.0]), np.array([0.2]), np.array([0.0]), **CG)[0]
    np.testing.assert_allclose(lifted[:3, 3] - at[:3, 3], 0.2 * at[:3, 2], atol=1e-12)


def test_viewmat_is_the_inverse_pose():
    pose = (
        body_poses(ROUTE, np.array([7.0]), np.array([0.1]), np.array([0.03]), **CG)[0] @ CAMERA.T_rig_camera
    )
    np.testing.assert_allclose(world_to_camera(pose) @ pose, np.eye(4), atol=1e-12)
