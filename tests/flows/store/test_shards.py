"""Frames read from a shard by the program's own few lines are those that Zarr reads, and damage is told."""

import google_crc32c
import numpy as np
import pytest
import zarr

from flows.store.frame_metadata import check_array, read_local_metadata
from flows.store.frames import COMPRESSIONS, create_arrays, read_chunks, read_clip, read_frames, write_clip
from flows.store.layout import Layout
from tasks.errors import InputError

SHAPE = (5, 16, 24)


def make_buffers() -> dict[str, np.ndarray]:
    draw = np.random.default_rng(1)
    buffers = {
        "rgb": draw.integers(0, 256, (*SHAPE, 3), np.uint8),
        "depth": draw.random(SHAPE).astype(np.float32),
        "class": draw.integers(0, 11, SHAPE, np.uint8),
    }
    for name, nothing in {"rgb": 0, "depth": np.nan, "class": 0}.items():
        buffers[name][2] = nothing  # a picture of fill values is not stored at all
    return buffers


@pytest.fixture(params=COMPRESSIONS)
def layout(request, tmp_path) -> Layout:
    layout = Layout(tmp_path / "dataset")
    create_arrays(layout.frames, (2, *SHAPE), False, {}, request.param)
    write_clip(layout.frames, 1, make_buffers())
    return layout


@pytest.mark.parametrize("name", ["rgb", "depth", "class"])
def test_frames_are_those_that_zarr_reads(layout, name):
    zarrs = zarr.open_array(layout.frames / name, mode="r")
    shape = check_array(read_local_metadata(layout.frames), name, layout.frames)
    for index, span in ((1, slice(0, 5)), (1, slice(1, 4)), (1, slice(4, 5))):
        mine = read_frames(layout.frames, name, shape, index, span)
        np.testing.assert_array_equal(mine, zarrs[index, span])
        assert mine.dtype == zarrs.dtype
    np.testing.assert_array_equal(read_clip(layout.frames, 1, name), make_buffers()[name])
    for index, span in ((2, slice(0, 1)), (1, slice(4, 6)), (1, slice(-1, 2))):
        with pytest.raises(ValueError, match="there are 2 clips of 5 frames"):
            read_frames(layout.frames, name, shape, index, span)
    with pytest.raises(ValueError, match="the shard is missing"):
        read_frames(layout.frames, name, shape, 0, slice(0, 2))


def test_chosen_frames_of_a_clip_are_read_in_their_order(layout):
    np.testing.assert_array_equal(read_clip(layout.frames, 1, "rgb", [4, 0]), make_buffers()["rgb"][[4, 0]])
    with pytest.raises(InputError, match="there are 2 clips of 5 frames"):
        read_clip(layout.frames, 1, "rgb", [0, 5])


def test_a_clip_of_fill_values_alone_has_its_shards_too(layout):
    """Zarr writes none where there is nothing else, and a shard that is missing is damage."""
    blank = {
        "rgb": np.zeros((*SHAPE, 3), np.uint8),
        "depth": np.full(SHAPE, np.nan, np.float32),
        "class": np.zeros(SHAPE, np.uint8),
    }
    write_clip(layout.frames, 0, blank)
    for name, values in blank.items():
        np.testing.assert_array_equal(read_clip(layout.frames, 0, name), values)


def test_a_picture_is_one_block(layout):
    """So Zstandard sees a whole picture: fewer bytes in less time than in blocks of Blosc's own choice."""
    metadata = zarr.open_array(layout.frames / "depth", mode="r").metadata
    (shard,) = metadata.codecs
    assert shard.codecs[1].blocksize == 16 * 24 * 4


DAMAGED = {
    "cut short": (lambda content: content[: len(content) // 2], "checksum|does not lie"),
    "no room for an index": (lambda content: content[:20], "the index of 5 frames alone has 84"),
    "empty": (lambda content: b"", "0 bytes"),
    "a bit of the index": (
        lambda content: content[:-10] + bytes([content[-10] ^ 1]) + content[-9:],
        "checksum",
    ),
    "a bit of a picture": (
        lambda content: content[:40] + bytes([content[40] ^ 1]) + content[41:],
        "checksum",
    ),
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_damage_is_an_error_and_not_a_picture(layout, damage):
    change, told = DAMAGED[damage]
    path = layout.frame_shard("rgb", 1)
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(ValueError, match=told):
        read_chunks(path, 5, 0, np.empty((5, 16, 24, 3), np.uint8), 0)


def test_a_chunk_with_right_checksums_that_holds_another_picture_is_refused(layout):
    path = layout.frame_shard("rgb", 1)
    for wrong in ((5, 16, 24, 1), (5, 16, 25, 3)):
        with pytest.raises(ValueError, match="must hold a picture"):
            read_chunks(path, 5, 0, np.empty(wrong, np.uint8), 0)


def test_an_index_that_points_out_of_the_shard_is_refused(tmp_path):
    for offset, length in ((0, 10**6), (2**63, 2**63), (10, 2)):
        index = np.array([[offset, length]], "<u8").tobytes()
        (tmp_path / "shard").write_bytes(index + google_crc32c.value(index).to_bytes(4, "little"))
        with pytest.raises(ValueError, match="does not lie in the shard"):
            read_chunks(tmp_path / "shard", 1, 0, np.empty((1, 4), np.uint8), 0)
