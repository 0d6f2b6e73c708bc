"""Routes from camera poses and points, and the scenes imported along them."""

import json
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catalogs.scenes import load_scene
from catalogs.scenes.gaussian_files import write_gaussians
from catalogs.scenes.route_files import read_route
from flows.making.scenes import scene_import
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.transform import transform_gaussians
from tests.toy_street import toy_street

SCENE = toy_street()


def camera_poses() -> np.ndarray:
    """OpenCV camera poses 1.65 m above a road that leads along +z of a y-down world, as KITTI's."""
    poses = np.tile(np.eye(4), (20, 1, 1))
    poses[:, 2, 3] = np.arange(20) * 1.2
    return poses


def write_kitti(path):
    path.write_text("\n".join(" ".join(f"{v:.9e}" for v in pose[:3].ravel()) for pose in camera_poses()))


def write_tum(path):
    lines = [f"{i * 0.1:.2f} {p[0, 3]} {p[1, 3]} {p[2, 3]} 0 0 0 1" for i, p in enumerate(camera_poses())]
    path.write_text("# time x y z qx qy qz qw\n" + "\n".join(lines))


def write_nerfstudio(path):
    poses = camera_poses()
    poses[:, :3, :3] = poses[:, :3, :3] @ np.diag([1, -1, -1])
    frames = [{"file_path": f"{i:04d}.png", "transform_matrix": p.tolist()} for i, p in enumerate(poses)]
    path.write_text(json.dumps({"frames": frames[::-1]}))


@pytest.mark.parametrize(
    ("name", "write"), [("k.txt", write_kitti), ("t.txt", write_tum), ("transforms.json", write_nerfstudio)]
)
def test_camera_poses_become_rig_poses_on_the_road_with_z_up(tmp_path, name, write):
    write(tmp_path / name)
    route, T_world_source = read_route(tmp_path / name, 1.65)
    np.testing.assert_allclose(route.T_world_rig[0], np.eye(4), atol=1e-9)
    np.testing.assert_allclose(route.T_world_rig[-1, :3, 3], [19 * 1.2, 0, 0], atol=1e-6)
    # a point on the road straight below the first camera of the y-down source
    np.testing.assert_allclose(T_world_source @ [0, 1.65, 0, 1], [0, 0, 0, 1], atol=1e-9)


def test_a_csv_of_points_is_a_route_as_it_stands(tmp_path):
    (tmp_path / "r.csv").write_text("x,y,z\n" + "\n".join(f"{i},0,0" for i in range(10)))
    route, T_world_source = read_route(tmp_path / "r.csv", 1.5)
    assert route.length == 9
    np.testing.assert_array_equal(T_world_source, np.eye(4))


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("r.csv", "a,b\n1,2\n", "needs the columns x, y, z"),
        ("r.txt", "1 2 3\n", "12 .KITTI. or 8 .TUM."),
        ("r.txt", "1 2 3 4 5 6 7 x\n", "line 1 must hold 8 numbers"),
        ("r.txt", "0 0 0 0 0 0 0 0\n", "unit quaternion"),
        ("r.txt", "2 0 0 0 0 1 0 0 0 0 1 0\n", "right-handed rotation"),
        ("r.csv", "x,y,z,qw\n0,0,0,1\n", "all of qw, qx, qy, qz"),
        ("r.json", '{"frames": [{"file_path": "a"}]}', "transform_matrix"),
        (
            "r.json",
            '{"frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,0]]}]}',
            "the last row 0 0 0 1",
        ),
        ("r.csv", "t,x,y,z\n0,0,0,0\n1,0,0\n", "line 3 must hold 4 fields, 3 of them numbers"),
        ("r.csv", "x,x,y,z\n0,0,0,0\n", "each column once; x stand twice"),
        ("r.csv", "x,y,z\n0,0,0\n1e7,0,0\n", "at most 100000 m long"),
        ("r.csv", "x,y,z\n0,0,0\n1e300,0,0\n", "at most 1e.08 m; point 1 is 1e.300, 0, 0"),
        ("r.txt", "1e200 0 0 0 0 1 0 0 0 0 1 0\n", "right-handed rotation"),
    ],
)
def test_a_faulty_route_file_is_one_sentence(tmp_path, name, content, sentence):
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=sentence):
        read_route(tmp_path / name, 1.5)


def test_an_imported_scene_is_a_scene_folder(tmp_path):
    write_gaussians(SCENE.gaussians, tmp_path / "a.ply")
    write_kitti(tmp_path / "poses.txt")
    facts = scene_import(
        str(tmp_path / "a.ply"),
        str(tmp_path / "poses.txt"),
        str(tmp_path / "scene"),
        camera_height=1.65,
        sun_direction_deg=(120.0, 40.0),
    )
    scene = load_scene(str(tmp_path / "scene"))
    assert len(scene.gaussians) == facts["gaussians"] == len(SCENE.gaussians)
    assert scene.sun_direction_deg == (120.0, 40.0)
    assert scene.route.length == pytest.approx(facts["route_length_m"])
    assert set(np.unique(scene.gaussians.class_id)) <= {SemanticClass.ROAD, SemanticClass.OTHER}


def test_every_faulty_line_of_a_route_is_named(tmp_path):
    (tmp_path / "r.csv").write_text("x,y,z\n0,0,0\n1,0\n2,nan,0\n3,zero,0\n")
    with pytest.raises(InputError) as caught:
        read_route(tmp_path / "r.csv", 1.5)
    assert [problem.split("r.csv: ")[1][:6] for problem in caught.value.problems] == [
        "line 3",
        "line 4",
        "line 5",
    ]


def test_frames_are_ordered_by_the_number_in_their_names(tmp_path):
    frames = [
        {"file_path": f"images/{i}.png", "transform_matrix": np.diag([1, -1, -1, 1.0]).tolist()}
        for i in range(12)
    ]
    for i, frame in enumerate(frames):
        frame["transform_matrix"][2][3] = float(i)
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": frames[5:] + frames[:5]}))
    assert read_route(tmp_path / "transforms.json", 1.5)[0].length == pytest.approx(11.0)


def test_a_picture_s_number_may_have_any_digits(tmp_path):
    frames = [
        {"file_path": f"{'7' * 5_000}{i}.png", "transform_matrix": np.diag([1, -1, -1, 1.0]).tolist()}
        for i in range(3)
    ]
    for i, frame in enumerate(frames):
        frame["transform_matrix"][2][3] = float(i)
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": frames}))
    assert read_route(tmp_path / "transforms.json", 1.5)[0].length == pytest.approx(2.0)


@pytest.mark.parametrize("metres_per_unit", [0.0, -1.0, float("nan"), 1e-200, 1e200])
def test_a_unit_that_no_reconstruction_has_is_refused(tmp_path, metres_per_unit):
    write_kitti(tmp_path / "k.txt")
    with pytest.raises(InputError, match=r"metres_per_unit must be 1e-06 to 1e.06"):
        read_route(tmp_path / "k.txt", 1.5, metres_per_unit)


def test_a_csv_with_quaternions_gives_the_rig_s_attitude(tmp_path):
    turned = Rotation.from_euler("z", 0.3)
    w, x, y, z = turned.as_quat(scalar_first=True)
    rows = [f"{i},{i * np.cos(0.3)},{i * np.sin(0.3)},0,{w},{x},{y},{z}" for i in range(5)]
    (tmp_path / "r.csv").write_text("time,x,y,z,qw,qx,qy,qz\n" + "\n".join(rows))
    route, _ = read_route(tmp_path / "r.csv", 1.5)
    np.testing.assert_allclose(route.T_world_rig[2, :3, :3], turned.as_matrix(), atol=1e-12)


def test_a_unit_of_its_own_scales_route_and_cloud_alike(tmp_path):
    write_kitti(tmp_path / "k.txt")
    plain, _ = read_route(tmp_path / "k.txt", 1.65)
    route, T_world_source = read_route(tmp_path / "k.txt", 1.65, metres_per_unit=2.5)
    assert route.length == pytest.approx(2.5 * plain.length)
    cloud = transform_gaussians(SCENE.gaussians, T_world_source)
    np.testing.assert_allclose(cloud.scales, 2.5 * SCENE.gaussians.scales, rtol=1e-6)
    apart = np.linalg.norm(cloud.means[0] - cloud.means[9])
    assert apart == pytest.approx(
        2.5 * np.linalg.norm(SCENE.gaussians.means[0] - SCENE.gaussians.means[9]), rel=1e-5
    )
    # the first camera stays camera_height above the road, whatever the unit
    np.testing.assert_allclose((T_world_source @ [0, 0, 0, 1])[2], 1.65, atol=1e-9)


def curved_poses() -> np.ndarray:
    """OpenCV camera poses along a bend, in a frame of no account."""
    poses = camera_poses()
    poses[:, :3, :3] = Rotation.from_euler("y", np.linspace(0, 0.5, 20)[:, None]).as_matrix()
    poses[1:, :3, 3] = np.cumsum(1.2 * poses[:-1, :3, 2], axis=0)
    return poses


def format_rows(rows) -> str:
    return "\n".join(" ".join(f"{value:.9e}" for value in row) for row in rows)


def colmap_numbers(pose):
    """Quaternion, the scalar first, and place of the world in the camera, as COLMAP writes them."""
    view = np.linalg.inv(pose)
    return [*Rotation.from_matrix(view[:3, :3]).as_quat(scalar_first=True), *view[:3, 3]]


def write_other_set(path, poses, name) -> None:
    rows, order = poses.reshape(len(poses), 16), [*range(10, 20), *range(10)]
    match name:
        case "matrices.txt":
            path.write_text(format_rows(rows))
        case "kitti-360.txt":
            path.write_text(format_rows(np.column_stack([np.arange(20), rows])))
        case "indexed.txt":
            path.write_text(format_rows(np.column_stack([np.arange(20), rows[:, :12]])))
        case "images.txt":
            numbers = {i: " ".join(f"{value:.17g}" for value in colmap_numbers(poses[i])) for i in order}
            points = "10.5 20.25 -1 " * 4 + "30 40 7"
            lines = [f"{i + 1} {numbers[i]} 1 front {i}.png\n{points if i % 2 else ''}" for i in order]
            path.write_text("# Image list with two lines of data per image:\n" + "\n".join(lines) + "\n")
        case "images.bin":
            content = struct.pack("<Q", 20)
            for i in order:
                content += struct.pack("<I7dI", i + 1, *colmap_numbers(poses[i]), 1) + f"{i}.png\0".encode()
                content += struct.pack("<Q", i) + bytes(24 * i)
            path.write_bytes(content)


@pytest.mark.parametrize("name", ["matrices.txt", "kitti-360.txt", "indexed.txt", "images.txt", "images.bin"])
def test_poses_of_other_sets_are_those_of_kitti(tmp_path, name):
    poses = curved_poses()
    (tmp_path / "kitti.txt").write_text(format_rows(poses[:, :3].reshape(20, 12)))
    write_other_set(tmp_path / name, poses, name)
    (kitti, T_kitti), (other, T_other) = (
        read_route(tmp_path / file, 1.65, 2.0) for file in ("kitti.txt", name)
    )
    np.testing.assert_allclose(other.T_world_rig, kitti.T_world_rig, atol=1e-6)
    np.testing.assert_allclose(T_other, T_kitti, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("r.txt", "1 " * 18 + "\n", "the first has 18: leave out other columns"),
        ("r.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 3 1\n", "column by column: transpose it"),
        ("r.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2\n", "must end in the row 0 0 0 1"),
        ("images.txt", "1 1 0 0 0 0 0 x 1 a.png\n", "line 1 must hold"),
        ("images.bin", "\2" + "\0" * 7, "images.bin, whole"),
        ("r.json", '{"frames": [{"transform_matrix": [[1]]}], "applied_scale": -1}', "applied_scale"),
        (
            "r.csv",
            "x,y,z\n" + "\n".join(f"{i % 20},{i // 20},0" for i in range(40)),
            "lead ahead all the way",
        ),
        (
            "r.csv",
            "x,y,z,qw,qx,qy,qz\n" + "\n".join(f"{i},0,0,0,0,0,1" for i in range(20)),
            "look along the way",
        ),
    ],
)
def test_other_faults_of_poses_are_one_sentence_too(tmp_path, name, content, sentence):
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=sentence):
        read_route(tmp_path / name, 1.5)


def test_the_cameras_of_a_rig_in_one_file_are_told(tmp_path):
    front = camera_poses()
    front[:, :3, :3] = front[:, :3, :3] @ np.diag([1, -1, -1])
    rear = front @ np.diag([-1.0, 1, -1, 1])
    frames = [
        {"file_path": f"{name}/{i:04d}.png", "transform_matrix": pose.tolist()}
        for name, poses in (("front", front), ("rear", rear))
        for i, pose in enumerate(poses)
    ]
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": frames}))
    with pytest.raises(
        InputError, match=r"pose 20 lies 22\.8 m behind pose 19: keep the poses of one camera"
    ):
        read_route(tmp_path / "transforms.json", 1.5)


def test_a_stated_form_of_poses_is_taken(tmp_path):
    (tmp_path / "gl.txt").write_text(
        format_rows((curved_poses() @ np.diag([1.0, -1, -1, 1]))[:, :3].reshape(20, 12))
    )
    (tmp_path / "cv.txt").write_text(format_rows(curved_poses()[:, :3].reshape(20, 12)))
    with pytest.raises(InputError, match="give --poses opengl"):
        read_route(tmp_path / "gl.txt", 1.65)
    route, _ = read_route(tmp_path / "gl.txt", 1.65, poses="opengl")
    plain, _ = read_route(tmp_path / "cv.txt", 1.65)
    np.testing.assert_allclose(route.T_world_rig, plain.T_world_rig, atol=1e-6)
    with pytest.raises(InputError, match="poses must be one of opencv"):
        read_route(tmp_path / "gl.txt", 1.65, poses="blender")
    with pytest.raises(InputError, match="scalar-first is asked for"):
        read_route(tmp_path / "gl.txt", 1.65, poses="scalar-first")


def test_the_frame_that_nerfstudio_trains_in_leads_back_to_that_of_its_poses(tmp_path):
    """Forwards as nerfstudio goes: applied_transform, applied_scale, then its own turn, shift and scale."""
    write_nerfstudio(tmp_path / "transforms.json")
    content = json.loads((tmp_path / "transforms.json").read_text())
    applied = np.array([[1.0, 0, 0, 0.3], [0, 0, 1, -2], [0, -1, 0, 0.1]])
    content |= {"applied_transform": applied.tolist(), "applied_scale": 0.5}
    (tmp_path / "transforms.json").write_text(json.dumps(content))
    own = np.eye(4)
    own[:3, :3], own[:3, 3] = Rotation.from_euler("xyz", [0.3, -1, 2]).as_matrix(), (4, 5, -6)
    parser = {
        "transform": (own @ np.vstack([applied, [0, 0, 0, 1]]))[:3].tolist(),
        "scale": 0.08 * 0.5,
    }
    (tmp_path / "dataparser_transforms.json").write_text(json.dumps(parser))
    _, T_world_source = read_route(tmp_path / "transforms.json", 1.65)
    _, T_world_cloud = read_route(
        tmp_path / "transforms.json", 1.65, dataparser=tmp_path / "dataparser_transforms.json"
    )
    point = np.array([0.7, 1.1, 9.0, 1.0])
    trained = 0.08 * (own @ point)[:3]
    np.testing.assert_allclose(T_world_cloud @ [*trained, 1], T_world_source @ point, atol=1e-9)
