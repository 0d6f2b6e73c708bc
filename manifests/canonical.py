"""Canonical JSON (RFC 8785) and the content ids made from it."""

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import rfc8785

ID_LENGTH = 16
"""Hex digits of a content id: 64 bits, a collision chance of 3e-8 among a million clips."""


def canonical_bytes(value: Any) -> bytes:
    """The one byte string of a JSON value under RFC 8785 (sorted keys, shortest numbers, UTF-8).

    Raises
    ------
    rfc8785.CanonicalizationError
        For NaN, infinities, integers beyond 2^53 and types JSON lacks.
    """
    return rfc8785.dumps(value)


def sha256_of(parts: Iterable[bytes | memoryview]) -> str:
    """SHA-256 of the concatenated parts, in hex."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()


def sha256_of_file(path: Path) -> str:
    """SHA-256 of a file's bytes, in hex."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def content_id(value: Any) -> str:
    """The first `ID_LENGTH` hex digits of the SHA-256 of the canonical form."""
    return sha256_of([canonical_bytes(value)])[:ID_LENGTH]
