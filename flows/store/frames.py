"""Frames as Zarr v3 arrays [clip, frame, y, x(, channel)]: one chunk a frame, one shard a clip.

A shard has one writer. Zarr takes an absent shard for fill values, black pictures; here every clip has its shards, and
one that is absent is damage. Every chunk ends in a CRC-32C, because Blosc alone lets flipped bits through.

Frames are read and written without Zarr. For its tasks it takes half a millisecond a frame, as long as the
decompression of a picture of 480 x 320; and to write a clip's array it copies it as a whole. The form is that of this
module alone, which `flows.store.frame_metadata` makes sure of: bytes, Blosc and CRC-32C a chunk, the index of offsets
and lengths at the end (Zarr 3, codec ``sharding_indexed`` 1.0).
"""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any, Literal
from warnings import catch_warnings, simplefilter

import google_crc32c
import numpy as np
import zarr
from numcodecs import blosc
from zarr.abc.buffer import Buffer
from zarr.codecs import BloscCodec, Crc32cCodec
from zarr.errors import ZarrUserWarning
from zarr.storage import MemoryStore

from catalogs.sentences import shorten
from flows.store.arrays import DIMENSION_SIZES, EVERY_ARRAY, PixelArray, arrays_of
from flows.store.frame_metadata import METADATA, check_array, read_local_metadata
from flows.store.layout import write_atomically, write_pieces
from flows.store.telemetry import channel_labels
from manifests.canonical import sha256_of
from tasks.errors import InputError

COMPRESSIONS: Mapping[str, tuple[Literal["zstd", "lz4hc"], int]] = {"zstd": ("zstd", 1), "lz4": ("lz4hc", 5)}
"""Blosc's codec and level of each ``compression`` of a grid. A picture is compressed as one block with the bytes of a
number apart: colour, depth and class of 480 x 320 take 353 kB at 2.3 CPU-ms with zstd, and 367 kB at 12.8 with lz4,
which gives colour back in a third of the time. In Blosc's own blocks zstd takes 360 kB, and longer both ways."""
LARGEST_BLOCK = 2**24
"""Bytes of a block: Blosc keeps room for three [B]."""
_CHECKSUM, _HEADER = 4, 16
_NO_CHUNK = np.uint64(2**64 - 1)
"""Offset of a chunk that holds nothing but the fill value."""
# the processes that read in parallel are the caller's, as a loader's workers: each is one thread
blosc.use_threads = False


def create_arrays(
    path: Path,
    shape: tuple[int, int, int, int],
    labels: bool,
    attributes: Mapping[str, Any],
    compression: Literal["zstd", "lz4"] = "zstd",
    objects: bool = False,
) -> None:
    """Create the group and its arrays, once, before any clip is written.

    Parameters
    ----------
    path : of the group
    shape, labels, attributes, compression, objects : as of `encode_arrays`
    """
    for name, content in encode_arrays(shape, labels, attributes, compression, objects).items():
        write_atomically(path / name, content)


def encode_arrays(
    shape: tuple[int, int, int, int],
    labels: bool,
    attributes: Mapping[str, Any],
    compression: Literal["zstd", "lz4"] = "zstd",
    objects: bool = False,
) -> dict[str, bytes]:
    """Return the files of the group and its arrays while these are empty: their metadata, by path in the group.

    Parameters
    ----------
    shape : clips, frames, height and width of pictures [1, 1, px, px]
    labels : whether the arrays of labels are wanted too
    attributes : of the group
    compression : of `COMPRESSIONS`
    objects : whether the array of road users is wanted too
    """
    clips, frames, *size = shape
    codec, level = COMPRESSIONS[compression]
    metadata: dict[str, Buffer] = {}
    group = zarr.create_group(MemoryStore(metadata), attributes=dict(attributes))
    for name, array in arrays_of(labels, objects).items():
        dtype = array.dtype
        tail = (*size, *(DIMENSION_SIZES[dimension] for dimension in array.dimensions))
        group.create_array(
            name,
            shape=(clips, frames, *tail),
            chunks=(1, 1, *tail),
            shards=(1, frames, *tail),
            dtype=dtype,
            fill_value=_choose_fill_value(dtype),
            compressors=[
                BloscCodec(
                    cname=codec,
                    clevel=level,
                    shuffle="shuffle",
                    typesize=np.dtype(dtype).itemsize,
                    blocksize=min(prod(tail) * np.dtype(dtype).itemsize, LARGEST_BLOCK),
                ),
                Crc32cCodec(),
            ],
            dimension_names=("clip", "frame", "y", "x", *array.dimensions),
            attributes=_describe_array(array),
        )
    with catch_warnings():
        # Zarr 3 has no words for copied metadata yet: who does not know them reads each array's own file
        simplefilter("ignore", ZarrUserWarning)
        zarr.consolidate_metadata(group.store)
    return {name: content.to_bytes() for name, content in metadata.items()}


def write_clip(path: Path, index: int, buffers: Mapping[str, np.ndarray]) -> None:
    """Write one clip's whole shard of every array; ``buffers`` maps array name to [frame, y, x(, channel)].

    A picture is compressed when it is written, and a shard is whole and on the disk before the clip's receipt is.
    Pictures of fill values are not stored, unless a shard would have no other.

    Raises
    ------
    InputError
        If the metadata are not those that muSync writes, or an array has another shape or type.
    """
    for name, values in buffers.items():
        shape, dtype = check_array(read_local_metadata(path), name, path), EVERY_ARRAY[name].dtype
        if values.shape != shape[1:] or values.dtype != dtype:
            raise InputError(
                f"{path}/{name}: a clip must be {dtype} {shape[1:]}; it is {values.dtype} {values.shape}"
            )
        write_pieces(_locate_shard(path, name, shape, index), _encode_shard(path / name, values))


def _encode_shard(array: Path, pictures: np.ndarray) -> Iterator[bytes]:
    """Yield each stored picture's chunk and, last, their index, as Zarr's ``sharding_indexed`` has them."""
    (sharding,) = json.loads((array / METADATA).read_bytes())["codecs"]
    codec = sharding["configuration"]["codecs"][1]["configuration"]
    settings = codec["cname"].encode(), codec["clevel"], blosc.SHUFFLE, codec["blocksize"], codec["typesize"]
    is_blank = np.isnan if pictures.dtype.kind == "f" else np.logical_not
    stored = [not is_blank(picture).all() for picture in pictures]
    index, offset = np.full((len(pictures), 2), _NO_CHUNK, "<u8"), 0
    for k, picture in enumerate(pictures):
        if stored[k] or not any(stored):
            chunk = _add_checksum(blosc.compress(np.ascontiguousarray(picture), *settings))
            index[k] = offset, len(chunk)
            offset += len(chunk)
            yield chunk
    yield _add_checksum(index.tobytes())


def _add_checksum(body: bytes) -> bytes:
    return body + google_crc32c.value(body).to_bytes(_CHECKSUM, "little")


def _locate_shard(path: Path, name: str, shape: tuple[int, ...], index: int) -> Path:
    return path / name / "c" / "/".join(str(number) for number in (index, *(0 for _ in shape[1:])))


def read_clip(path: Path, index: int, name: str, frames: Sequence[int] | None = None) -> np.ndarray:
    """One clip's frames of one array, decoded and checksum-verified.

    Parameters
    ----------
    path : of the group
    index : of the clip
    name : of the array
    frames : that are read, in their order; None reads all

    Raises
    ------
    InputError
        If the metadata are not those that muSync writes, there is no such clip or frame, or its pictures are damaged.
    """
    shape = check_array(read_local_metadata(path), name, path)
    if not 0 <= index < shape[0]:
        raise InputError(f"{path}/{name}: has {shape[0]} clips; there is no clip {index}")
    try:
        if frames is None:
            return read_frames(path, name, shape, index, slice(0, shape[1]))
        return np.concatenate([read_frames(path, name, shape, index, slice(f, f + 1)) for f in frames])
    except (ValueError, RuntimeError, OSError) as error:
        raise InputError(
            f"{path}/{name}: clip {index} must be readable; {shorten(error)}: musync lab repair makes it again"
        ) from None


def read_frames(path: Path, name: str, shape: tuple[int, ...], index: int, span: slice) -> np.ndarray:
    """Frames in a row of one clip of one array, decoded and checksum-verified.

    Parameters
    ----------
    path : of the group
    name : of the array
    shape : of the array, of `flows.store.frame_metadata.check_array`
    index : of the clip
    span : first frame, and the one behind the last

    Raises
    ------
    ValueError, RuntimeError, OSError
        If there are no such frames, or the clip's shard cannot be read or is damaged.
    """
    if not (0 <= index < shape[0] and 0 <= span.start <= span.stop <= shape[1]):
        raise ValueError(f"there are {shape[0]} clips of {shape[1]} frames; asked for clip {index}, {span}")
    array = EVERY_ARRAY[name]
    pictures = np.empty((span.stop - span.start, *shape[2:]), array.dtype)
    shard = _locate_shard(path, name, shape, index)
    read_chunks(shard, shape[1], span.start, pictures, _choose_fill_value(array.dtype))
    return pictures


def _choose_fill_value(dtype: str) -> float:
    return float("nan") if dtype == "float32" else 0


def buffer_hash(buffer: np.ndarray) -> str:
    """SHA-256 of the decoded pixels with their shape and type."""
    values = np.ascontiguousarray(buffer)
    return sha256_of([f"{values.dtype.str} {values.shape}\n".encode(), values.data.cast("B")])


def _describe_array(array: PixelArray) -> dict[str, Any]:
    """The words that a telemetry column of the same kind carries, and CF's attributes of codes."""
    labels: dict[str, Any] = {"long_name": array.channel.description, **channel_labels(array.channel)}
    if array.flags:
        labels |= {"flag_values": list(range(len(array.flags))), "flag_meanings": " ".join(array.flags)}
    if array.channel.name == "marks":
        from tasks.render.labels import MARK_BITS

        labels |= {"flag_masks": list(MARK_BITS.values()), "flag_meanings": " ".join(MARK_BITS)}
    return labels


def read_chunks(path: Path, chunks: int, first: int, pictures: np.ndarray, fill_value: float) -> None:
    """Fill ``pictures`` with the chunks of a shard from ``first`` on, each held against its checksum.

    Parameters
    ----------
    path : of the shard
    chunks : in the shard [1]
    first : number of the first chunk [1]
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
        ranges = _read_index(shard, chunks)[first : first + len(pictures)]
        for picture, (offset, length) in zip(pictures, ranges, strict=True):
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
    sizes = [int.from_bytes(body[start : start + 4], "little") for start in (4, 12)]
    if len(body) < _HEADER or sizes != [picture.nbytes, len(body)]:
        raise ValueError(
            f"a chunk of {len(body)} bytes must hold a picture of {picture.nbytes}; its header says {sizes}"
        )
    blosc.decompress(body, picture)
