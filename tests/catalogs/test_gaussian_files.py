"""Gaussians trained elsewhere: an INRIA .ply is decoded by its layout, and refused where that does not hold."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catalogs.scenes.gaussian_files import read_gaussians, write_gaussians
from tasks.errors import InputError
from tasks.scene.transform import transform_gaussians
from tests.catalogs.cloud_files import write_inria
from tests.toy_street import toy_street

SCENE = toy_street()


def test_an_inria_ply_is_decoded_as_its_layout_says(tmp_path):
    raw = write_inria(tmp_path / "a.ply")
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
    write_inria(tmp_path / "a.ply")
    cloud = read_gaussians(tmp_path / "a.ply")
    axes = Rotation.from_quat(cloud.quats_wxyz, scalar_first=True).as_matrix()
    shortest = axes[np.arange(50), :, cloud.scales.argmin(axis=1)]
    np.testing.assert_allclose(cloud.normals, shortest, atol=1e-5)


def test_a_ply_with_nan_is_refused_with_the_gaussian(tmp_path):
    write_inria(tmp_path / "a.ply", nan_at=17)
    with pytest.raises(InputError, match=r"means must be finite; 1 of 50 .* number 17"):
        read_gaussians(tmp_path / "a.ply")


def test_an_unknown_ending_lists_the_known_ones(tmp_path):
    with pytest.raises(InputError, match=r"\.spz"):
        read_gaussians(tmp_path / "a.obj")


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
        (lambda b: b.replace(b"float rot_3", b"uchar rot_3"), "its header leaves something out"),
        (lambda b: b.replace(b"float rot_3", b"list uchar int rot_3"), "list uchar int rot_3"),
        (lambda b: b.replace(b"vertex", b"face"), "must have vertex elements"),
    ],
)
def test_a_ply_with_a_wrong_header_or_missing_bytes_says_what_is_wrong(tmp_path, change, sentence):
    write_inria(tmp_path / "a.ply")
    (tmp_path / "a.ply").write_bytes(change((tmp_path / "a.ply").read_bytes()))
    with pytest.raises(InputError, match=sentence):
        read_gaussians(tmp_path / "a.ply")


def test_a_quaternion_that_is_no_number_is_refused(tmp_path):
    write_inria(tmp_path / "a.ply", nan_at=17, column="rot_2")
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


def test_a_plain_ply_has_no_other_elements_and_no_property_twice(tmp_path):
    write_inria(tmp_path / "a.ply")
    whole = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "a.ply").write_bytes(
        whole.replace(b"element vertex", b"element face 0\nproperty float a\nelement vertex")
    )
    with pytest.raises(InputError, match="the vertices must be the only element"):
        read_gaussians(tmp_path / "a.ply")
    (tmp_path / "a.ply").write_bytes(whole.replace(b"property float ny", b"property float nx"))
    with pytest.raises(InputError, match="each property must stand once"):
        read_gaussians(tmp_path / "a.ply")


@pytest.mark.parametrize("value", [3e38, 1e-30])
def test_quaternions_of_any_length_become_unit_ones(tmp_path, value):
    write_inria(tmp_path / "a.ply")
    rows = bytearray((tmp_path / "a.ply").read_bytes())
    rows[-16:] = np.full(4, value, "<f4").tobytes()
    (tmp_path / "a.ply").write_bytes(rows)
    cloud = transform_gaussians(read_gaussians(tmp_path / "a.ply"), np.eye(4))
    np.testing.assert_allclose(np.linalg.norm(cloud.quats_wxyz, axis=1), 1, atol=1e-6)
