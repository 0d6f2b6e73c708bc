"""Which Zarr metadata the frames of a dataset may have: what `flows.store.frames` writes, and nothing else.

Zarr makes whatever codec a ``zarr.json`` names, pickle among them, and takes any shape and any other array for granted.
A dataset may come from a stranger, so this is looked at before Zarr sees it.
"""

from collections.abc import Callable, Collection, Mapping
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.documents import parse_json
from catalogs.sentences import cap_problems, shorten_value
from flows.store.arrays import DIMENSION_SIZES, EVERY_ARRAY, PixelArray
from tasks.errors import InputError

METADATA = "zarr.json"
LARGEST_PICTURE = 2**31 - 17
"""Bytes of one picture of one array [B]: the largest buffer that Blosc compresses."""
LARGEST_CLIP = 2**37
"""Bytes of one array of one clip [B]: ninety seconds of 8K colour at 15 frames a second."""
_GROUP = {"zarr_format": 3, "node_type": "group"}
_CODECS = {
    "bytes": {"endian"},
    "blosc": {"typesize", "cname", "clevel", "shuffle", "blocksize"},
    "crc32c": set[str](),
}
"""Codecs inside a shard, and what may be set of each."""
_COMPRESSORS = {"zstd", "lz4hc"}
_INDEX_CODECS = ["bytes", "crc32c"]

ReadMetadata = Callable[[str], bytes | None]
"""Return the bytes of a file of the frames by its relative path; None where there is no file."""


def read_local_metadata(folder: Path) -> ReadMetadata:
    """`ReadMetadata` of a folder."""

    def read(name: str) -> bytes | None:
        path = folder / name
        return path.read_bytes() if path.is_file() else None

    return read


def check_frames(
    read: ReadMetadata, members: Collection[str], origin: object, clips: int, frames: int
) -> dict[str, tuple[int, ...]]:
    """Check the metadata of the group and of all its arrays; returns each array's shape.

    Parameters
    ----------
    read : gives the bytes of a ``zarr.json``
    members : names of what lies in the group, such as folders
    origin : what messages call the group
    clips, frames : of the dataset, and frames of each clip, as its manifest says [1]

    Raises
    ------
    InputError
        Listing what breaks a rule.
    """
    problems = _find_group_problems(read, members, origin)
    shapes = {}
    for name in sorted(members):
        if name not in EVERY_ARRAY:
            problems.append(f"{origin}/{shorten_value(name)}: no array that muSync writes; remove it")
            continue
        try:
            shapes[name] = check_array(read, name, origin)
        except InputError as error:
            problems += error.problems
            continue
        if shapes[name][:2] != (clips, frames):
            problems.append(
                f"{origin}/{name}: must have the manifest's {clips} clips of {frames} frames; its shape is"
                f" {shorten_value(list(shapes[name]))}"
            )
    if len({shape[2:4] for shape in shapes.values()}) > 1:
        problems.append(f"{origin}: all arrays must have pictures of one size; they have several")
    if problems:
        raise InputError(cap_problems(problems))
    return shapes


def check_array(read: ReadMetadata, name: str, origin: object) -> tuple[int, ...]:
    """Check the metadata of one array; returns its shape.

    Parameters
    ----------
    read : gives the bytes of a ``zarr.json``
    name : of the array: rgb, depth, class or a label
    origin : what messages call the group

    Raises
    ------
    InputError
        Listing what breaks a rule.
    """
    where = f"{origin}/{name}/{METADATA}"
    content = read(f"{name}/{METADATA}")
    if content is None:
        raise InputError(f"{where}: missing: musync lab repair makes it again")
    metadata = parse_json(content, where, "array's metadata")
    array = EVERY_ARRAY[name]
    if not isinstance(metadata, dict):
        raise InputError(f"{where}: must be a table of metadata; it is {shorten_value(metadata)}")
    shape: Any = metadata.get("shape")
    problems = _find_shape_problems(shape, array)
    if not problems:
        problems = _find_layout_problems(metadata, array, shape)
    if problems:
        raise InputError(cap_problems([f"{where}: {problem}" for problem in problems]))
    return tuple(shape)


def _find_group_problems(read: ReadMetadata, members: Collection[str], origin: object) -> list[str]:
    where, content = f"{origin}/{METADATA}", read(METADATA)
    if content is None:
        return [f"{where}: missing: musync lab repair makes it again"]
    try:
        metadata = parse_json(content, where, "group's metadata")
    except InputError as error:
        return list(error.problems)
    free = {"attributes", "consolidated_metadata"}
    if not isinstance(metadata, dict) or {k: v for k, v in metadata.items() if k not in free} != _GROUP:
        return [f"{where}: must be the metadata of a Zarr 3 group and hold nothing else"]
    # datasets of earlier versions have no copies; where there are some, other readers take them for the arrays' own
    if "consolidated_metadata" in metadata and not _are_copies(
        metadata["consolidated_metadata"], read, members
    ):
        return [
            f"{where}: its copies of the arrays' metadata must be equal to these and hold nothing else; they differ:"
            " musync lab repair makes it again"
        ]
    return []


def _are_copies(found: Any, read: ReadMetadata, members: Collection[str]) -> bool:
    """Whether the group holds what stands in the arrays' own files, and no other array."""
    known = EVERY_ARRAY
    match found:
        case {"kind": "inline", "must_understand": False, "metadata": dict(copies)} if len(found) == 3:
            names = copies.keys() | (known.keys() & set(members))
            return names <= known.keys() and all(
                name in copies and copies[name] == _parse_member(read, name) for name in names
            )
    return False


def _parse_member(read: ReadMetadata, name: str) -> Any:
    """Return the metadata of an array as JSON has them; NaN, which equals nothing, where there are none."""
    try:
        return parse_json(read(f"{name}/{METADATA}") or b"", name, "array's metadata")
    except InputError:
        return float("nan")


def _find_shape_problems(shape: Any, array: PixelArray) -> list[str]:
    sizes = [DIMENSION_SIZES[dimension] for dimension in array.dimensions]
    whole = isinstance(shape, list) and all(type(size) is int and 1 <= size < 2**31 for size in shape)
    if not whole or len(shape) != 4 + len(sizes) or shape[4:] != sizes:
        return [
            f"shape must be [clip, frame, y, x{''.join(f', {size}' for size in sizes)}]; it is {shorten_value(shape)}"
        ]
    picture = prod(shape[2:]) * np.dtype(array.dtype).itemsize
    if picture > LARGEST_PICTURE or shape[1] * picture > LARGEST_CLIP:
        return [
            f"a picture must have at most {LARGEST_PICTURE:,} bytes and a clip {LARGEST_CLIP:,};"
            f" the shape is {shorten_value(shape)}"
        ]
    return []


def _find_layout_problems(metadata: Mapping[str, Any], array: PixelArray, shape: list[int]) -> list[str]:
    tail = shape[2:]
    wanted: dict[str, Any] = {
        "shape": shape,
        "zarr_format": 3,
        "node_type": "array",
        "data_type": array.dtype,
        "fill_value": "NaN" if array.dtype == "float32" else 0,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [1, shape[1], *tail]}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "dimension_names": ["clip", "frame", "y", "x", *array.dimensions],
        "storage_transformers": [],
    }
    found = {"storage_transformers": [], **metadata}
    problems = [
        f"{key} must be {shorten_value(value)}; it is {shorten_value(found.get(key))}"
        for key, value in wanted.items()
        if found.get(key) != value
    ]
    problems += [
        f"{shorten_value(key)}: no key that muSync writes"
        for key in found.keys() - wanted.keys() - {"codecs", "attributes"}
    ]
    if not _is_shard(metadata.get("codecs"), [1, 1, *tail]):
        problems.append(
            "codecs must be those that muSync writes: a shard of one chunk a frame, each as bytes, blosc (zstd or"
            f" lz4hc), crc32c; they are {shorten_value(metadata.get('codecs'), most=120)}"
        )
    return problems


def _is_shard(codecs: Any, chunk: list[int]) -> bool:
    match codecs:
        case [
            {"name": "sharding_indexed", "configuration": {"codecs": inner, "index_codecs": index} as shard}
        ]:
            others = {key: value for key, value in shard.items() if key not in {"codecs", "index_codecs"}}
            return (
                others == {"chunk_shape": chunk, "index_location": "end"}
                and _are_codecs(inner, list(_CODECS))
                and _are_codecs(index, _INDEX_CODECS)
            )
    return False


def _are_codecs(codecs: Any, names: list[str]) -> bool:
    """Whether these codecs have these names in this order, and nothing is set but what their kind knows."""
    if not isinstance(codecs, list) or [isinstance(c, dict) and c.get("name") for c in codecs] != names:
        return False
    for codec in codecs:
        settings = codec.get("configuration", {})
        if not isinstance(settings, dict) or codec.keys() - {"name", "configuration"}:
            return False
        if settings.keys() - _CODECS[codec["name"]] or settings.get("cname", "zstd") not in _COMPRESSORS:
            return False
        if any(not isinstance(value, str | int) for value in settings.values()):
            return False
    return True
