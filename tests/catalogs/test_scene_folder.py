"""Scene folders: every array under its hash, every fault named."""

import hashlib
import json
import shutil
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes import write_scene
from catalogs.scenes.folder import read_scene, scene_hash
from tasks.errors import InputError
from tasks.scene.surroundings import add_surroundings
from tests.toy_street import toy_street

SCENE = toy_street()


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


def test_a_scene_is_not_written_through_a_link(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "s").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="it is a link"):
        write_scene(SCENE, tmp_path / "s", {})
    assert list((tmp_path / "elsewhere").iterdir()) == []


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


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("name", None, "name must be"),
        ("display_encoded", "yes", "display_encoded"),
        ("carriageway_left", -3, "carriageway_left"),
        ("sha256", {"../means.npy": "0" * 64}, "sha256 must name means.npy"),
        ("name", "\x1b[31m", "name must be printable"),
        ("carriageway_left", float("inf"), "finite"),
        ("sun_direction_deg", [120.0, 0.2], "sun_direction_deg, where given"),
    ],
)
def test_a_scene_json_with_a_wrong_entry_is_refused_with_its_key(tmp_path, key, value, sentence):
    write_scene(SCENE, tmp_path / "s", {})
    facts = json.loads((tmp_path / "s" / "scene.json").read_text())
    (tmp_path / "s" / "scene.json").write_text(json.dumps(facts | {key: value}))
    with pytest.raises(InputError, match=sentence):
        read_scene(tmp_path / "s")


def test_surroundings_are_kept_where_a_cloud_has_them_and_are_part_of_its_hash(tmp_path):
    level = replace(SCENE, gaussians=add_surroundings(replace(SCENE.gaussians, antialiased=True)))
    for name, scene in (("plain", SCENE), ("level", level)):
        write_scene(scene, tmp_path / name, {})
    assert read_scene(tmp_path / "plain").gaussians.surroundings is None
    back = read_scene(tmp_path / "level").gaussians.surroundings
    np.testing.assert_array_equal(back, level.gaussians.surroundings)
    assert scene_hash(tmp_path / "plain") != scene_hash(tmp_path / "level")


@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        (
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000, 3), }",
            "the 12000000000000 bytes",
        ),
        ("{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 3), }", "bytes that its header announces"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (2, 3), }", "must hold float32"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }", "must hold float32"),
        ("{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }", r"shape \[N, 3\]"),
        ("(" * 600, "must be a .npy file"),
        ("{'descr': '<f4'", "must be a .npy file"),
    ],
)
def test_an_array_that_announces_what_it_does_not_hold_is_refused_before_memory_is_taken(
    tmp_path, header, sentence
):
    write_scene(SCENE, tmp_path / "s", {})
    text = header.encode().ljust(118 if len(header) < 118 else 630) + b"\n"
    content = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(24)
    (tmp_path / "s" / "means.npy").write_bytes(content)
    reseal(tmp_path / "s")
    tracemalloc.start()
    with pytest.raises(InputError, match=sentence):
        read_scene(tmp_path / "s")
    assert tracemalloc.get_traced_memory()[1] < 2**25
    tracemalloc.stop()


def reseal(folder):
    """Write the hashes of the arrays as they are: anybody can."""
    facts = json.loads((folder / "scene.json").read_text())
    facts["sha256"] = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.glob("*.npy")
    }
    (folder / "scene.json").write_text(json.dumps(facts))


@pytest.mark.parametrize("name", ["scene.json", "means.npy"])
def test_a_link_in_a_scene_folder_is_not_followed(tmp_path, name):
    write_scene(SCENE, tmp_path / "s", {})
    (tmp_path / "s" / name).rename(tmp_path / name)
    (tmp_path / "s" / name).symlink_to(tmp_path / name)
    with pytest.raises(InputError, match=name):
        read_scene(tmp_path / "s")


@pytest.mark.parametrize(
    ("name", "change", "rule"),
    [
        ("quats_wxyz", lambda a: 0 * a, "quats_wxyz must be unit quaternions"),
        ("normals", lambda a: 3 * a, "normals must be unit vectors"),
        ("means", lambda a: a + np.float32(3e38), "means must be within 1e.18 m"),
        ("scales", lambda a: a + np.float32(3e38), "scales must be positive, and at most"),
        ("means", lambda a: a[:0], "at least one Gaussian"),
    ],
)
def test_a_value_that_no_street_has_is_refused_by_rule(tmp_path, name, change, rule):
    write_scene(SCENE, tmp_path / "s", {})
    path = tmp_path / "s" / f"{name}.npy"
    np.save(path, change(np.load(path)))
    reseal(tmp_path / "s")
    with pytest.raises(InputError, match=rule):
        read_scene(tmp_path / "s")


def test_a_folder_that_only_looks_like_a_half_written_scene_stays(tmp_path):
    mine = tmp_path / "s.partial" / "thesis.txt"
    mine.parent.mkdir()
    mine.touch()
    write_scene(SCENE, tmp_path / "s", {})
    assert mine.is_file() and sorted(path.name for path in tmp_path.iterdir()) == ["s", "s.partial"]
