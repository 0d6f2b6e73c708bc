import json
import shutil
from dataclasses import replace

import gaussforge
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catalogs.cameras import load_camera
from catalogs.scenes import load_scene, write_scene
from catalogs.scenes.folder import read_scene, scene_hash
from catalogs.scenes.gaussian_files import read_gaussians, write_gaussians
from catalogs.scenes.route_files import read_route
from flows.making.scenes import scene_import
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.transform import moved
from tests.toy_street import toy_street

SCENE = toy_street()
SH_0 = 0.28209479177387814


def ply(path, count=50, nan_at=None, column="x"):
    """An INRIA .ply written by hand: the layout is the reference, not a library."""
    draw = np.random.default_rng(3)
    names = ["x", "y", "z", "nx", "ny", "nz", *(f"f_dc_{i}" for i in range(3)), *(f"f_rest_{i}" for i in range(45)),
             "opacity", *(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]  # fmt: skip
    rows = draw.normal(size=(count, len(names))).astype("<f4")
    rows[:, names.index("scale_0") : names.index("scale_2") + 1] -= 3
    if nan_at is not None:
        rows[nan_at, names.index(column)] = np.nan
    header = "ply\nformat binary_little_endian 1.0\n" + f"element vertex {count}\n"
    header += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    path.write_bytes(header.encode() + rows.tobytes())
    return {name: rows[:, i] for i, name in enumerate(names)}


def test_a_scene_reads_back_bit_for_bit(tmp_path):
    write_scene(SCENE, tmp_path / "s", {"held_out_psnr_db": 21.5})
    back = read_scene(tmp_path / "s")
    for name in ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id"):
        np.testing.assert_array_equal(getattr(back.gaussians, name), getattr(SCENE.gaussians, name))
    np.testing.assert_array_equal(back.route.T_world_rig, SCENE.route.T_world_rig)
    facts = json.loads((tmp_path / "s" / "scene.json").read_text())
    assert {"gaussians", "route_length_m", "road_share", "held_out_psnr_db"} <= facts.keys()
    assert facts["held_out_psnr_db"] == 21.5


def test_a_damaged_array_and_a_missing_one_are_both_named(tmp_path):
    write_scene(SCENE, tmp_path / "s", {})
    content = bytearray((tmp_path / "s" / "sh.npy").read_bytes())
    content[-1] ^= 1
    (tmp_path / "s" / "sh.npy").write_bytes(content)
    (tmp_path / "s" / "means.npy").unlink()
    with pytest.raises(InputError) as caught:
        read_scene(tmp_path / "s")
    assert len(caught.value.problems) == 2
    assert "means.npy" in str(caught.value) and "sh.npy" in str(caught.value)


def test_a_scene_is_not_written_over_other_files(tmp_path):
    (tmp_path / "keep.txt").touch()
    with pytest.raises(InputError, match="must be a new or empty folder"):
        write_scene(SCENE, tmp_path, {})


def test_the_hash_follows_the_content_and_not_the_place(tmp_path):
    write_scene(SCENE, tmp_path / "a", {})
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    write_scene(toy_street(seed=2), tmp_path / "c", {})
    assert scene_hash(tmp_path / "a") == scene_hash(tmp_path / "b") != scene_hash(tmp_path / "c")


def test_a_sun_reads_back_turns_from_plus_x_to_plus_y_and_is_part_of_the_hash(tmp_path):
    sunny = replace(SCENE, sun_direction_deg=(90.0, 30.0))
    write_scene(SCENE, tmp_path / "a", {})
    write_scene(sunny, tmp_path / "b", {})
    assert read_scene(tmp_path / "a").to_sun is None
    to_sun = read_scene(tmp_path / "b").to_sun
    np.testing.assert_allclose(to_sun, (0, np.sqrt(3) / 2, 0.5), atol=1e-12)
    assert scene_hash(tmp_path / "a") != scene_hash(tmp_path / "b")


def test_a_nan_in_a_gaussian_is_refused_with_its_number(tmp_path):
    broken = toy_street()
    broken.gaussians.means[41, 2] = np.nan
    write_scene(broken, tmp_path / "s", {})
    with pytest.raises(InputError, match=r"means must be finite; 1 of .* number 41"):
        read_scene(tmp_path / "s")


def test_an_unknown_scene_lists_the_built_in_one():
    with pytest.raises(InputError, match="street"):
        load_scene("nowhere")


def test_an_inria_ply_is_decoded_as_its_layout_says(tmp_path):
    raw = ply(tmp_path / "a.ply")
    cloud = read_gaussians(tmp_path / "a.ply")
    np.testing.assert_array_equal(cloud.means, np.stack([raw["x"], raw["y"], raw["z"]], axis=1))
    np.testing.assert_allclose(cloud.scales[:, 1], np.exp(raw["scale_1"]), rtol=1e-6)
    np.testing.assert_allclose(cloud.opacities, 1 / (1 + np.exp(-raw["opacity"])), rtol=1e-5)
    np.testing.assert_array_equal(cloud.sh[:, 0, 2], raw["f_dc_2"])
    # f_rest is channel-major: coefficient k of channel c stands at 15 c + k
    np.testing.assert_array_equal(cloud.sh[:, 1 + 4, 2], raw["f_rest_34"])
    q = np.stack([raw[f"rot_{i}"] for i in range(4)], axis=1)
    np.testing.assert_allclose(cloud.quats_wxyz, q / np.linalg.norm(q, axis=1, keepdims=True), atol=1e-6)
    assert cloud.display_encoded


def test_the_normal_is_the_shortest_axis(tmp_path):
    ply(tmp_path / "a.ply")
    cloud = read_gaussians(tmp_path / "a.ply")
    axes = Rotation.from_quat(cloud.quats_wxyz, scalar_first=True).as_matrix()
    shortest = axes[np.arange(50), :, cloud.scales.argmin(axis=1)]
    np.testing.assert_allclose(cloud.normals, shortest, atol=1e-5)


@pytest.mark.parametrize(("ending", "tolerance"), [("compressed.ply", 5e-3), ("splat", 1e-6), ("spz", 5e-4)])
def test_packed_formats_hold_the_same_cloud(tmp_path, ending, tolerance):
    ply(tmp_path / "a.ply")
    forge = gaussforge.GaussForge()
    packed = forge.convert((tmp_path / "a.ply").read_bytes(), "ply", ending)["data"]
    (tmp_path / f"b.{ending}").write_bytes(packed)
    plain, back = read_gaussians(tmp_path / "a.ply"), read_gaussians(tmp_path / f"b.{ending}")
    distance = np.linalg.norm(back.means[:, None] - plain.means[None], axis=2)
    nearest = distance.argmin(axis=1)
    assert sorted(nearest) == list(range(50)), "each Gaussian is there once"
    assert distance.min(axis=1).max() < tolerance
    np.testing.assert_allclose(back.opacities, plain.opacities[nearest], atol=0.01)
    # .splat keeps colours in [0, 1] only
    expected = np.clip(plain.sh[nearest, 0], -0.5 / SH_0, 0.5 / SH_0)
    np.testing.assert_allclose(np.clip(back.sh[:, 0], -0.5 / SH_0, 0.5 / SH_0), expected, atol=0.15)


@pytest.mark.parametrize("ending", ["ply", "splat", "spz"])
def test_a_truncated_file_is_refused_with_its_name(tmp_path, ending):
    ply(tmp_path / "a.ply")
    whole = (tmp_path / "a.ply").read_bytes()
    if ending != "ply":
        whole = gaussforge.GaussForge().convert(whole, "ply", ending)["data"]
    (tmp_path / f"cut.{ending}").write_bytes(whole[: len(whole) - 37])
    with pytest.raises(InputError, match=f"cut.{ending}"):
        read_gaussians(tmp_path / f"cut.{ending}")


def test_a_ply_with_nan_is_refused_with_the_gaussian(tmp_path):
    ply(tmp_path / "a.ply", nan_at=17)
    with pytest.raises(InputError, match=r"means must be finite; 1 of 50 .* number 17"):
        read_gaussians(tmp_path / "a.ply")


def test_an_unknown_ending_lists_the_known_ones(tmp_path):
    with pytest.raises(InputError, match=r"\.spz"):
        read_gaussians(tmp_path / "a.obj")


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
    ],
)
def test_a_faulty_route_file_is_one_sentence(tmp_path, name, content, sentence):
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=sentence):
        read_route(tmp_path / name, 1.5)


def test_an_imported_scene_is_a_scene_folder(tmp_path):
    ply(tmp_path / "a.ply")
    write_kitti(tmp_path / "poses.txt")
    facts = scene_import(
        str(tmp_path / "a.ply"),
        str(tmp_path / "poses.txt"),
        str(tmp_path / "scene"),
        camera_height=1.65,
        sun_direction_deg=(120.0, 40.0),
    )
    scene = load_scene(str(tmp_path / "scene"))
    assert len(scene.gaussians) == facts["gaussians"] == 50
    assert scene.sun_direction_deg == (120.0, 40.0)
    assert scene.route.length == pytest.approx(facts["route_length_m"])
    assert set(np.unique(scene.gaussians.class_id)) <= {SemanticClass.ROAD, SemanticClass.OTHER}


@pytest.mark.parametrize("name", ["dashcam-480x320", "dashcam-1280x720"])
def test_cameras_look_forward_from_above_the_road(name):
    camera = load_camera(name)
    np.testing.assert_allclose(camera.T_rig_camera[:3, :3] @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    assert camera.T_rig_camera[2, 3] > 1
    assert (camera.K[0, 2], camera.K[1, 2]) == (camera.width / 2, camera.height / 2)


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
    cloud = moved(SCENE.gaussians, T_world_source)
    np.testing.assert_allclose(cloud.scales, 2.5 * SCENE.gaussians.scales, rtol=1e-6)
    apart = np.linalg.norm(cloud.means[0] - cloud.means[9])
    assert apart == pytest.approx(
        2.5 * np.linalg.norm(SCENE.gaussians.means[0] - SCENE.gaussians.means[9]), rel=1e-5
    )
    # the first camera stays camera_height above the road, whatever the unit
    np.testing.assert_allclose((T_world_source @ [0, 0, 0, 1])[2], 1.65, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda b: b[:150], "end_header"),
        (lambda b: b[:-37], "50 Gaussians in 13927 bytes; the file holds 13890"),
        (lambda b: b"solid" + b, "must begin with the word ply"),
        (
            lambda b: b.replace(b"binary_little_endian", b"ascii"),
            "binary_little_endian 1.0; it is 'ascii 1.0'",
        ),
        (lambda b: b.replace(b" opacity", b" opaque"), "must have opacity"),
        (lambda b: b.replace(b"f_rest_44", b"g_rest_44"), "there are 44"),
        (lambda b: b.replace(b"float rot_3", b"uchar rot_3"), "uchar rot_3"),
        (lambda b: b.replace(b"vertex", b"face"), "must have vertex elements"),
    ],
)
def test_a_ply_with_a_wrong_header_or_missing_bytes_says_what_is_wrong(tmp_path, change, sentence):
    ply(tmp_path / "a.ply")
    (tmp_path / "a.ply").write_bytes(change((tmp_path / "a.ply").read_bytes()))
    with pytest.raises(InputError, match=sentence):
        read_gaussians(tmp_path / "a.ply")


def test_a_quaternion_that_is_no_number_is_refused(tmp_path):
    ply(tmp_path / "a.ply", nan_at=17, column="rot_2")
    with pytest.raises(InputError, match=r"quats_wxyz must be finite; 1 of 50 .* number 17"):
        read_gaussians(tmp_path / "a.ply")


@pytest.mark.parametrize("coefficients", [1, 4, 9, 16])
def test_a_written_ply_reads_back(tmp_path, coefficients):
    draw = np.random.default_rng(2)
    count = len(SCENE.gaussians)
    cloud = replace(
        SCENE.gaussians,
        sh=draw.normal(size=(count, coefficients, 3)).astype(np.float32),
        display_encoded=True,
    )
    write_gaussians(cloud, tmp_path / "out.ply")
    back = read_gaussians(tmp_path / "out.ply")
    for name in ("means", "quats_wxyz", "sh"):
        np.testing.assert_array_equal(getattr(back, name), getattr(cloud, name))
    np.testing.assert_allclose(back.scales, cloud.scales, rtol=1e-5)
    np.testing.assert_allclose(back.opacities, cloud.opacities, rtol=1e-5)


def test_reading_prints_nothing_where_json_is_printed(tmp_path, capfd):
    ply(tmp_path / "a.ply")
    forge = gaussforge.GaussForge()
    for ending in ("spz", "splat"):
        (tmp_path / f"b.{ending}").write_bytes(
            forge.convert((tmp_path / "a.ply").read_bytes(), "ply", ending)["data"]
        )
    capfd.readouterr()
    for name in ("a.ply", "b.spz", "b.splat"):
        read_gaussians(tmp_path / name)
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("name", None, "name must be"),
        ("display_encoded", "yes", "display_encoded"),
        ("antialiased", None, "antialiased"),
        ("carriageway_left", -3, "carriageway_left"),
        ("carriageway_right", None, "carriageway_right"),
        ("sha256", {}, "sha256 must name means.npy"),
        ("sun_direction_deg", [120.0], "sun_direction_deg, where given"),
        ("sun_direction_deg", [120.0, 0.2], "sun_direction_deg, where given"),
    ],
)
def test_a_scene_json_with_a_wrong_entry_is_refused_with_its_key(tmp_path, key, value, sentence):
    write_scene(SCENE, tmp_path / "s", {})
    facts = json.loads((tmp_path / "s" / "scene.json").read_text())
    (tmp_path / "s" / "scene.json").write_text(json.dumps(facts | {key: value}))
    with pytest.raises(InputError, match=sentence):
        read_scene(tmp_path / "s")
