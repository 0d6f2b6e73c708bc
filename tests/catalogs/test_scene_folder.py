"""Scene folders: every array under its hash, every fault named."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes import load_scene, write_scene
from catalogs.scenes.folder import read_scene, scene_hash
from tasks.errors import InputError
from tasks.scene.surroundings import with_surroundings
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


def test_surroundings_are_kept_where_a_cloud_has_them_and_are_part_of_its_hash(tmp_path):
    level = replace(SCENE, gaussians=with_surroundings(replace(SCENE.gaussians, antialiased=True)))
    for name, scene in (("plain", SCENE), ("level", level)):
        write_scene(scene, tmp_path / name, {})
    assert read_scene(tmp_path / "plain").gaussians.surroundings is None
    back = read_scene(tmp_path / "level").gaussians.surroundings
    np.testing.assert_array_equal(back, level.gaussians.surroundings)
    assert scene_hash(tmp_path / "plain") != scene_hash(tmp_path / "level")
