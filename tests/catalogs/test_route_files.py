"""Routes from camera poses and points, and the scenes imported along them."""

import json

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
        ("r.txt", "", "the first has 0"),
        ("r.txt", "0 0 0 0 0 0 0 0\n", "unit quaternion"),
        ("r.txt", "2 0 0 0 0 1 0 0 0 0 1 0\n", "right-handed rotation"),
        ("r.csv", "x,y,z\n", "two points"),
        ("r.csv", "x,y,z,qw\n0,0,0,1\n", "all of qw, qx, qy, qz"),
        ("r.json", "[1]", "list of frames"),
        ("r.json", '{"frames": [7]}', "frame 0"),
        ("r.json", '{"frames": [{"file_path": "a"}]}', "transform_matrix"),
        ("r.json", "{", "must be"),
        ("r.json", '{"frames": [], "frames": []}', "distinct keys"),
        ("r.json", "[" * 100_000, "inside each other"),
        (
            "r.json",
            '{"frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,0]]}]}',
            "the last row 0 0 0 1",
        ),
        ("r.csv", "t,x,y,z\n0,0,0,0\n1,0,0\n", "line 3 must hold 4 fields, 3 of them numbers"),
        ("r.csv", "x,x,y,z\n0,0,0,0\n", "each column once; x stand twice"),
        ("r.csv", "x,y,z\n0,0,0\n1e7,0,0\n", "at most 100000 m long"),
        ("r.csv", "x,y,z\n0,0,0\n1e300,0,0\n", "at most 1e.08 m; point 1 is 1e.300, 0, 0"),
        ("r.csv", "x,y,z\n" + "1" * 200_000 + ",0,0\n", "field limit"),
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
