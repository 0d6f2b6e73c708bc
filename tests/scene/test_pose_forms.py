"""A way against its cameras' headings: the form of poses that fits is named, several cameras and drives are told."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tasks.conventions import ANY_HEADING, POSE_FORMS
from tasks.scene.pose_forms import LOOKING_FORWARD, find_turns_back, find_way_problems, read_cameras

COUNT = 40
FLU_OF_FRD = np.diag([1.0, -1.0, -1.0])


def drive(step: float = 1.0) -> np.ndarray:
    """Cameras of OpenCV's axes along a bend in a world whose y points down, [M, 4, 4]."""
    heading = np.linspace(0, 0.6, COUNT)
    poses = np.tile(np.eye(4), (COUNT, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("y", heading[:, None]).as_matrix()
    poses[1:, :3, 3] = step * np.cumsum(poses[:-1, :3, 2], axis=0)
    return poses


def turned(poses: np.ndarray, axes: np.ndarray) -> np.ndarray:
    out = poses.copy()
    out[:, :3, :3] = out[:, :3, :3] @ axes
    return out


def written(poses: np.ndarray, form: str) -> np.ndarray:
    """The poses as a file of this form would hold them, by the form's own definition."""
    match form:
        case "opengl":
            return turned(poses, np.diag([1.0, -1.0, -1.0]))
        case "world-to-camera":
            return np.linalg.inv(poses)
        case "flu":
            return turned(poses, LOOKING_FORWARD.T)
        case "frd":
            return turned(poses, LOOKING_FORWARD.T @ FLU_OF_FRD)
        case "scalar-first":
            out = poses.copy()
            quats = Rotation.from_matrix(poses[:, :3, :3]).as_quat(scalar_first=True)
            out[:, :3, :3] = Rotation.from_quat(quats).as_matrix()
            return out
    return poses


@pytest.mark.parametrize("form", [form for form in POSE_FORMS if form != ANY_HEADING])
def test_every_form_is_read_as_it_is_defined(form):
    np.testing.assert_allclose(read_cameras(written(drive(), form), form, "opencv"), drive(), atol=1e-12)


@pytest.mark.parametrize("form", ["opengl", "world-to-camera", "flu", "scalar-first"])
@pytest.mark.parametrize("step", [1.0, 0.02], ids=["metres", "a unit of its own"])
def test_the_form_that_fits_is_named_first(form, step):
    (problem,) = find_way_problems(
        written(drive(step), form), "opencv", "opencv", tuple(POSE_FORMS), "--poses"
    )
    assert problem.split("steps: ")[1].startswith(POSE_FORMS[form])
    assert f"give --poses {form}" in problem


@pytest.mark.parametrize(
    ("yaw", "side"), [(180, "back"), (-90, "to the left of the way"), (90, "to the right of the way")]
)
def test_a_camera_that_looks_elsewhere_is_told_and_can_be_turned_into_the_way(yaw, side):
    poses = turned(drive(), Rotation.from_euler("y", yaw, degrees=True).as_matrix())
    (problem,) = find_way_problems(poses, "opencv", "opencv", ("opengl", "world-to-camera", ANY_HEADING))
    assert problem.split("steps: ")[1].startswith(f"the camera may look {side}")
    assert not find_way_problems(poses, ANY_HEADING, "opencv", tuple(POSE_FORMS))
    cameras = read_cameras(poses, ANY_HEADING, "opencv")
    np.testing.assert_allclose(cameras[:, :3, :3], drive()[:, :3, :3], atol=0.02)


def test_a_camera_that_is_mounted_a_little_aside_looks_ahead():
    poses = turned(drive(), Rotation.from_euler("yx", [15, -10], degrees=True).as_matrix())
    assert not find_way_problems(poses, "opencv", "opencv", tuple(POSE_FORMS))


def interleave(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.stack([first, second], axis=1).reshape(-1, 4, 4)


REAR = turned(drive(), np.diag([-1.0, 1.0, -1.0]))
BESIDE = drive() @ np.array([[1.0, 0, 0, 0.6], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
FAR = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 300], [0, 0, 0, 1]]) @ drive()


@pytest.mark.parametrize(
    ("poses", "words"),
    [
        (np.concatenate([drive(), REAR]), "m behind pose 39.*one camera"),
        (np.concatenate([drive(), drive()[::-1]]), "lead ahead all the way"),
        (interleave(drive(), REAR), "look 180 deg apart"),
        (interleave(drive(), BESIDE), "times as long as"),
        (np.concatenate([drive(), FAR]), "no gaps; poses 39 and 40"),
    ],
    ids=[
        "one after the other",
        "there and back",
        "front and rear in turn",
        "left and right in turn",
        "two drives",
    ],
)
def test_several_cameras_or_drives_are_told(poses, words):
    assert re.search(words, "; ".join(find_way_problems(poses, "opencv", "opencv", tuple(POSE_FORMS))))


def test_points_that_turn_back_are_told_and_a_bend_is_none():
    positions = drive()[:, :3, 3]
    assert not find_turns_back(positions)
    assert "lead ahead" in find_turns_back(np.concatenate([positions, positions[:20]]))[0]
