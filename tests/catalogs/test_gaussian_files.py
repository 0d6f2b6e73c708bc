"""Gaussians trained elsewhere: .ply by its layout, packed forms by the .ply that they were made from."""

import gzip
import struct
import tracemalloc
from dataclasses import replace

import gaussforge
import gsply
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import expit

from catalogs.scenes.gaussian_files import read_gaussians, write_gaussians
from catalogs.scenes.spz_header import check_spz
from tasks.errors import InputError
from tasks.scene.transform import transform_gaussians
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


@pytest.mark.parametrize(
    ("ending", "tolerance"),
    [("compressed.ply", 5e-3), ("splat", 1e-6), pytest.param("spz", 5e-4, marks=pytest.mark.minutes)],
)
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


def compressed(path):
    """A compressed .ply of 50 Gaussians; its bytes."""
    ply(path / "plain.ply")
    packed = gaussforge.GaussForge().convert((path / "plain.ply").read_bytes(), "ply", "compressed.ply")
    return bytes(packed["data"])


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        # 10,000 Gaussians in one chunk: the decoder would read bounds from beyond it
        (lambda b: b.replace(b"vertex 50", b"vertex 300") + bytes(10_000), "must have 2 chunks"),
        (lambda b: b.replace(b"element chunk 1", b"element chunk 0"), "must have 1 chunks"),
        (lambda b: b.replace(b"min_x", b"mon_x"), "each chunk of a compressed .ply must have"),
        (lambda b: b.replace(b"packed_scale", b"packed_scald"), "each vertex of a compressed .ply must have"),
        (lambda b: b.replace(b"element vertex", b"element vertices"), "must have vertex elements"),
        (lambda b: b.replace(b"element chunk 1", b"element chunk 1\nelement chunk 1"), "element chunk 1"),
        (lambda b: b.replace(b"element chunk", b"comment end_header\nelement chunk"), "up to end_header"),
        (lambda b: b[:-1], "truncated"),
    ],
)
def test_a_compressed_ply_is_decoded_only_where_its_layout_is_the_decoder_s(tmp_path, change, sentence):
    (tmp_path / "b.ply").write_bytes(change(compressed(tmp_path)))
    with pytest.raises(InputError, match=sentence):
        read_gaussians(tmp_path / "b.ply")


def test_a_plain_ply_has_no_other_elements_and_no_property_twice(tmp_path):
    ply(tmp_path / "a.ply")
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
    ply(tmp_path / "a.ply")
    rows = bytearray((tmp_path / "a.ply").read_bytes())
    rows[-16:] = np.full(4, value, "<f4").tobytes()
    (tmp_path / "a.ply").write_bytes(rows)
    cloud = transform_gaussians(read_gaussians(tmp_path / "a.ply"), np.eye(4))
    np.testing.assert_allclose(np.linalg.norm(cloud.quats_wxyz, axis=1), 1, atol=1e-6)


def spz(count, payload, version=2):
    return gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", version, count, 0, 12, 0, 0) + payload, mtime=0)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (spz(10**9, b""), "1000000000 Gaussians in 19000000000 bytes"),
        (spz(1, bytes(19 + 2**20)) + b"more", "more than extensions take"),
        (spz(1, bytes(2**21)), "more than extensions take"),
        (spz(2, bytes(19)), "38 bytes of Gaussians; 19 are there"),
        (spz(1, bytes(19), version=9), "version 1 to 4"),
        (b"NGSP\x04\x00\x00\x00" + b"\xff" * 24, "version 1 to 4 and degree 0 to 3"),
        (b"NGSP", "cannot be unpacked"),
        (b"\x1f\x8bxx", "cannot be unpacked"),
    ],
)
def test_a_spz_unpacks_to_what_it_announces(tmp_path, content, sentence):
    (tmp_path / "b.spz").write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        read_gaussians(tmp_path / "b.spz")


def test_a_spz_that_holds_more_than_it_announces_is_not_unpacked_whole(tmp_path):
    (tmp_path / "b.spz").write_bytes(spz(1, bytes(2**26)))
    tracemalloc.start()
    with pytest.raises(InputError, match="more than extensions take"):
        read_gaussians(tmp_path / "b.spz")
    assert tracemalloc.get_traced_memory()[1] < 2**24
    tracemalloc.stop()


def columns_ply(path, columns, kinds=None, comments=()):
    """A .ply of columns by name, written by hand: float, or of the type that ``kinds`` names."""
    kinds = dict.fromkeys(columns, "float") | (kinds or {})
    forms = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}
    rows = np.zeros(len(next(iter(columns.values()))), [(name, forms[kinds[name]]) for name in columns])
    for name, values in columns.items():
        rows[name] = values
    lines = [*(f"comment {words}" for words in comments), f"element vertex {len(rows)}"]
    lines += [f"property {kinds[name]} {name}" for name in columns]
    header = "\n".join(["ply", "format binary_little_endian 1.0", *lines, "end_header", ""])
    path.write_bytes(header.encode() + rows.tobytes())
    return path


def cloud_columns(count=400):
    draw = np.random.default_rng(5)
    names = [*"xyz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1",
             "rot_2", "rot_3"]  # fmt: skip
    columns = {name: draw.normal(size=count).astype(np.float32) for name in names}
    return columns | {f"scale_{i}": columns[f"scale_{i}"] - 2 for i in range(3)}


def test_the_smoothing_filter_of_a_cloud_is_applied(tmp_path):
    columns = cloud_columns()
    width = np.full(400, 0.3)
    plain = read_gaussians(columns_ply(tmp_path / "a.ply", columns))
    smooth = read_gaussians(columns_ply(tmp_path / "b.ply", columns | {"filter_3D": width}))
    variance = plain.scales.astype(float) ** 2
    np.testing.assert_allclose(smooth.scales, np.sqrt(variance + 0.09), rtol=1e-6)
    faded = np.sqrt(variance.prod(axis=1) / (variance + 0.09).prod(axis=1))
    np.testing.assert_allclose(smooth.opacities, np.maximum(plain.opacities * faded, 1e-6), rtol=1e-5)


def test_a_gaussian_of_two_dimensions_is_flat_along_its_third_axis(tmp_path):
    columns = cloud_columns()
    del columns["scale_2"]
    cloud = read_gaussians(columns_ply(tmp_path / "a.ply", columns, comments=["SplatRenderMode: 2dgs"]))
    np.testing.assert_array_equal(cloud.scales[:, 2], np.float32(1e-6))
    axes = Rotation.from_quat(cloud.quats_wxyz, scalar_first=True).as_matrix()
    np.testing.assert_allclose(cloud.normals, axes[:, :, 2], atol=1e-5)


@pytest.mark.parametrize(
    "name",
    ["semantic", "velocity_x", "trbf_center", "motion_0", "t", "f_rest_x", "scale_3", "rot_4", "x" * 3000],
)
def test_what_a_gaussian_states_and_nobody_knows_is_refused(tmp_path, name):
    columns_ply(tmp_path / "a.ply", cloud_columns(50) | {name: np.zeros(50)})
    with pytest.raises(InputError, match=r"must be known|counted from 0"):
        read_gaussians(tmp_path / "a.ply")


def test_normals_and_a_colour_beside_the_harmonics_say_nothing_further(tmp_path):
    columns = cloud_columns()
    more = dict.fromkeys(("nx", "ny", "nz", "red", "green", "blue"), np.ones(400))
    plain = read_gaussians(columns_ply(tmp_path / "a.ply", columns))
    cloud = read_gaussians(columns_ply(tmp_path / "b.ply", columns | more, dict.fromkeys(("red",), "uchar")))
    np.testing.assert_array_equal(cloud.sh, plain.sh)


def test_columns_of_any_type_are_numbers(tmp_path):
    columns = cloud_columns()
    columns |= {"x": np.arange(400.0), "rot_0": np.ones(400), "rot_3": np.zeros(400)}
    kinds = {"x": "double", "opacity": "double", "rot_0": "int", "rot_3": "uchar"}
    cloud = read_gaussians(columns_ply(tmp_path / "a.ply", columns, kinds))
    plain = read_gaussians(columns_ply(tmp_path / "b.ply", columns))
    np.testing.assert_array_equal(cloud.means, plain.means)
    np.testing.assert_array_equal(cloud.quats_wxyz, plain.quats_wxyz)
    np.testing.assert_array_equal(cloud.opacities, plain.opacities)


def test_a_colour_of_8_bits_stands_for_the_harmonics(tmp_path):
    columns = {name: values for name, values in cloud_columns().items() if not name.startswith("f_dc")}
    columns |= {"red": np.full(400, 255), "green": np.full(400, 51), "blue": np.zeros(400)}
    cloud = read_gaussians(
        columns_ply(tmp_path / "a.ply", columns, dict.fromkeys(("red", "green", "blue"), "uchar"))
    )
    np.testing.assert_allclose(cloud.sh[:, 0] * SH_0 + 0.5, np.tile([1, 0.2, 0], (400, 1)), atol=1e-6)


def test_positions_that_single_precision_would_move_are_refused(tmp_path):
    columns = cloud_columns(50) | {"y": 5.4e6 + np.arange(50.0) / 7}
    with pytest.raises(InputError, match=r"near enough to the origin .* subtract one offset"):
        read_gaussians(columns_ply(tmp_path / "a.ply", columns, {"y": "double"}))


@pytest.mark.parametrize(
    ("activated", "sentence"),
    [
        ({"opacity": np.linspace(0.02, 1, 50)}, "opacity must be a logit"),
        ({"opacity": np.linspace(3, 255, 50)}, "opacity must be a logit"),
        ({f"scale_{i}": np.geomspace(0.01, 3, 50) for i in range(3)}, "must be logarithms"),
        ({f"f_dc_{i}": np.linspace(0, 255, 50) for i in range(3)}, "colours of 8 bits"),
    ],
)
def test_values_that_were_activated_already_are_refused(tmp_path, activated, sentence):
    with pytest.raises(InputError, match=f"{sentence}.*as its trainer stores it"):
        read_gaussians(columns_ply(tmp_path / "a.ply", cloud_columns(50) | activated))


@pytest.mark.parametrize(
    ("comment", "antialiased"),
    [("SplatRenderMode: mip", True), ("SplatRenderMode: default", False), ("antialiased 1", True),
     ("antialiased 0", False), ("Generated by a trainer: antialiased or not", False)],
)  # fmt: skip
def test_a_cloud_is_drawn_as_its_comment_says(tmp_path, comment, antialiased):
    cloud = read_gaussians(columns_ply(tmp_path / "a.ply", cloud_columns(50), comments=[comment]))
    assert cloud.antialiased == antialiased
    write_gaussians(cloud, tmp_path / "b.ply")
    assert read_gaussians(tmp_path / "b.ply").antialiased == antialiased


@pytest.mark.parametrize("comments", [["SplatRenderMode: banana"], ["SplatRenderMode: mip", "antialiased 0"]])
def test_a_comment_on_drawing_that_nobody_knows_is_refused(tmp_path, comments):
    with pytest.raises(InputError, match="how the cloud is drawn"):
        read_gaussians(columns_ply(tmp_path / "a.ply", cloud_columns(50), comments=comments))


def test_the_flags_of_a_spz_are_read(tmp_path):
    packed = bytearray(spz(1, bytes(19)))
    for flags, antialiased in ((0, False), (1, True)):
        content = bytearray(gzip.decompress(packed))
        content[14] = flags
        (tmp_path / "b.spz").write_bytes(gzip.compress(bytes(content), mtime=0))
        assert check_spz(tmp_path / "b.spz") == antialiased
    content[14] = 0x40
    (tmp_path / "b.spz").write_bytes(gzip.compress(bytes(content), mtime=0))
    with pytest.raises(InputError, match="0x40"):
        read_gaussians(tmp_path / "b.spz")


def test_a_few_gaussians_that_are_no_numbers_are_left_out_and_counted(tmp_path):
    columns = cloud_columns()
    columns["rot_2"][17] = np.nan
    notes: list[str] = []
    cloud = read_gaussians(columns_ply(tmp_path / "a.ply", columns), notes)
    assert len(cloud) == 399
    assert notes == [
        "1 of 400 Gaussians were left out: they hold what is no finite number, the first is number 17"
    ]


def test_chunks_without_bounds_of_colours_hold_them_from_0_to_1(tmp_path):
    whole = compressed(tmp_path)
    start = whole.index(b"end_header\n") + 11
    header = whole[:start]
    for end in ("min", "max"):
        for channel in "rgb":
            header = header.replace(f"property float {end}_{channel}\n".encode(), b"")
    old = header + whole[start : start + 48] + whole[start + 72 :]
    (tmp_path / "old.compressed.ply").write_bytes(old)
    (tmp_path / "new.compressed.ply").write_bytes(whole)
    before, after = (read_gaussians(tmp_path / f"{name}.compressed.ply") for name in ("old", "new"))
    np.testing.assert_array_equal(before.means, after.means)
    bounds = np.frombuffer(whole[start + 48 : start + 72], "<f4").reshape(2, 3)
    shares = before.sh[:, 0] * SH_0 + 0.5
    assert shares.min() >= -1e-6
    assert shares.max() <= 1 + 1e-6
    np.testing.assert_allclose(
        after.sh[:, 0] * SH_0 + 0.5, bounds[0] + shares * (bounds[1] - bounds[0]), atol=1e-5
    )


def test_the_decoder_of_compressed_files_agrees_with_gsply(tmp_path):
    (tmp_path / "b.ply").write_bytes(compressed(tmp_path))
    ours, theirs = read_gaussians(tmp_path / "b.ply"), gsply.plyread(tmp_path / "b.ply")
    np.testing.assert_allclose(ours.means, theirs.means, atol=1e-6)
    np.testing.assert_allclose(ours.scales, np.exp(theirs.scales), rtol=1e-5)
    np.testing.assert_allclose(ours.sh[:, 0], theirs.sh0, atol=1e-5)
    np.testing.assert_allclose(ours.sh[:, 1:], theirs.shN, atol=1e-6)
    np.testing.assert_allclose(ours.opacities, expit(theirs.opacities), atol=1e-4)
    turned = np.abs((ours.quats_wxyz * theirs.quats).sum(axis=1))
    np.testing.assert_allclose(turned, 1, atol=1e-6)
