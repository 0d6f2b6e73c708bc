"""Packed Gaussians: compressed .ply, .splat and .spz hold the cloud that they were made from, and unpack to no more."""

import gzip
import struct
import tracemalloc

import gaussforge
import gsply
import numpy as np
import pytest
from scipy.special import expit

from catalogs.scenes.gaussian_files import read_gaussians
from catalogs.scenes.spz_header import check_spz
from tasks.errors import InputError
from tests.catalogs.cloud_files import SH_0, write_inria


@pytest.fixture(autouse=True)
def uncompiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """gsply's kernels run as the Python that they are: to compile them for 50 Gaussians takes ten seconds."""
    for module, kernel in (
        (gsply.spz, "_decode_spz_kernel"),
        (gsply.reader, "_unpack_all_jit"),
        (gsply.reader, "_unpack_sh_jit"),
    ):
        monkeypatch.setattr(module, kernel, getattr(module, kernel).py_func)


def compressed(path):
    """A compressed .ply of 50 Gaussians; its bytes."""
    write_inria(path / "plain.ply")
    packed = gaussforge.GaussForge().convert((path / "plain.ply").read_bytes(), "ply", "compressed.ply")
    return bytes(packed["data"])


def spz(count, payload, version=2):
    return gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", version, count, 0, 12, 0, 0) + payload, mtime=0)


@pytest.mark.parametrize(
    ("ending", "tolerance"),
    [("compressed.ply", 5e-3), ("splat", 1e-6), ("spz", 5e-4)],
)
def test_packed_formats_hold_the_same_cloud(tmp_path, ending, tolerance):
    write_inria(tmp_path / "a.ply")
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


def test_reading_prints_nothing_where_json_is_printed(tmp_path, capfd):
    write_inria(tmp_path / "a.ply")
    forge = gaussforge.GaussForge()
    for ending in ("spz", "splat"):
        (tmp_path / f"b.{ending}").write_bytes(
            forge.convert((tmp_path / "a.ply").read_bytes(), "ply", ending)["data"]
        )
    capfd.readouterr()
    for name in ("a.ply", "b.spz", "b.splat"):
        read_gaussians(tmp_path / name)
    assert capfd.readouterr().out == ""
