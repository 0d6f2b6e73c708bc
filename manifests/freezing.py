"""The frozen manifest of a dataset, piece by piece: the bytes of `manifests.manifest.freeze_manifest`, which its test
compares, while one clip's record is held at a time."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from typing import Any

from manifests.canonical import canonical_bytes
from manifests.manifest import MANIFEST_FORMAT


def freeze_pieces(
    plan: Mapping[str, Any],
    clips: Iterable[Mapping[str, Any]],
    artifacts: Mapping[str, str],
    made_on: Mapping[str, Any],
) -> Iterator[bytes]:
    """Yield the manifest's byte string (RFC 8785) in pieces, the seal among them.

    Parameters
    ----------
    plan, artifacts, made_on : as of `manifests.manifest.freeze_manifest`
    clips : one record a clip, read once and in order
    """
    head = {**plan, "format": MANIFEST_FORMAT, "artifacts": artifacts, **made_on}
    unsealed = hashlib.sha256()
    mark = b"{"
    # RFC 8785 sorts the keys, and the seal covers all but itself
    for name in sorted({*head, "clips", "seal"}):
        if name == "seal":
            # what follows it is hashed before it is written
            rest = [(key, head[key]) for key in sorted(head) if key > name]
            for key, value in rest:
                unsealed.update(b"," + canonical_bytes(key) + b":" + canonical_bytes(value))
            unsealed.update(b"}")
            yield mark + canonical_bytes(name) + b":" + canonical_bytes(unsealed.hexdigest())
            continue
        start = mark + canonical_bytes(name) + b":"
        for piece in chain(
            [start], _list_pieces(clips) if name == "clips" else [canonical_bytes(head[name])]
        ):
            if name < "seal":
                unsealed.update(piece)
            yield piece
        mark = b","
    yield b"}"


def _list_pieces(clips: Iterable[Mapping[str, Any]]) -> Iterator[bytes]:
    mark = b"["
    for clip in clips:
        yield mark + canonical_bytes(clip)
        mark = b","
    yield b"[]" if mark == b"[" else b"]"
