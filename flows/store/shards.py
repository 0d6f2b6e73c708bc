"""Frames out of a clip's shard, without Zarr: one read and one decompression a frame, straight into the given array.

Zarr itself takes half a millisecond a frame for its tasks and copies, as long as the decompression of a picture of
480 x 320. The form is that of `flows.store.frames` alone, which `flows.store.frame_metadata` makes sure of: bytes,
Blosc and CRC-32C a chunk, the index of offsets and lengths at the end (Zarr 3, codec ``sharding_indexed`` 1.0).
"""

import os
from pathlib import Path

import google_crc32c
import numpy as np
from numcodecs import blosc

_CHECKSUM, _HEADER = 4, 16
_NO_CHUNK = np.uint64(2**64 - 1)
"""Offset of a chunk that holds nothing but the fill value."""

# the processes that read in parallel are the caller's, as a loader's workers: each is one thread
blosc.use_threads = False


def read_chunks(path: Path, chunks: int, first: int, pictures: np.ndarray, fill_value: float) -> None:
    """Fill ``pictures`` with the chunks of a shard from ``first`` on, each held against its checksum.

    Parameters
    ----------
    path : of the shard
    chunks : in the shard [1]
    first : place of the first chunk [1]
    pictures : contiguous [frame, y, x(, channel)]
    fill_value : of pixels that are not stored

    Raises
    ------
    ValueError
        If the shard is missing or damaged.
    """
    try:
        shard = os.open(path, os.O_RDONLY)
    except FileNotFoundError:
        raise ValueError("the shard is missing") from None
    try:
        places = _read_index(shard, chunks)[first : first + len(pictures)]
        for picture, (offset, length) in zip(pictures, places, strict=True):
            if offset == _NO_CHUNK:
                picture[...] = fill_value
            else:
                _decode(_take(shard, int(offset), int(length)), picture)
    finally:
        os.close(shard)


def _read_index(shard: int, chunks: int) -> np.ndarray:
    """Offset and length of each chunk, uint64 [chunks, 2]."""
    length = 16 * chunks + _CHECKSUM
    size = os.fstat(shard).st_size
    if size < length:
        raise ValueError(f"the shard has {size} bytes; the index of {chunks} frames alone has {length}")
    content = _take(shard, size - length, length)
    return np.frombuffer(_strip_checksum(content), "<u8").reshape(chunks, 2)


def _take(shard: int, offset: int, length: int) -> bytes:
    size = os.fstat(shard).st_size
    if length < _CHECKSUM or offset + length > size:
        raise ValueError(f"a chunk of {length} bytes at {offset} does not lie in the shard of {size} bytes")
    content = os.pread(shard, length, offset)
    if len(content) != length:
        raise ValueError(f"the shard ended within the chunk of {length} bytes at {offset}")
    return content


def _strip_checksum(content: bytes) -> bytes:
    body, stored = content[:-_CHECKSUM], int.from_bytes(content[-_CHECKSUM:], "little")
    if google_crc32c.value(body) != stored:
        raise ValueError(f"the checksum is {google_crc32c.value(body):08x}; {stored:08x} is stored")
    return body


def _decode(content: bytes, picture: np.ndarray) -> None:
    """Decompress a chunk; its header must have the sizes that are there, because Blosc trusts it."""
    body = _strip_checksum(content)
    sizes = [int.from_bytes(body[place : place + 4], "little") for place in (4, 12)]
    if len(body) < _HEADER or sizes != [picture.nbytes, len(body)]:
        raise ValueError(
            f"a chunk of {len(body)} bytes must hold a picture of {picture.nbytes}; its header says {sizes}"
        )
    blosc.decompress(body, picture)
