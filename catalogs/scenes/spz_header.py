"""Compare the size that a .spz announces with the size it unpacks to: a few bytes can stand for terabytes."""

import struct
import zlib
from pathlib import Path

from tasks.errors import InputError

GZIP, NGSP = b"\x1f\x8b", b"NGSP"
HEADER = struct.Struct("<4sIIBBBB")
"""Magic, version, Gaussians, degree of the spherical harmonics, fractional bits, flags, reserved."""
VERSIONS = (1, 2, 3, 4)
ANTIALIASED, EXTENDED = 1, 2
"""Flags: the cloud is drawn antialiased; extensions follow the Gaussians."""
HARMONICS = (0, 3, 8, 15)
"""Number of coefficients of each colour after the first, by degree."""
LARGEST_FREE, LARGEST_RATIO = 2**26, 64
"""Bytes that any .spz may unpack to, and by how many times its own size a larger one may grow [1]: of quantised clouds
without view-dependent colour, which compress best, gzip leaves a tenth."""
EXTENSION_ROOM = 2**20
"""Bytes of extensions behind the Gaussians [1]."""
PIECE = 2**20


def check_spz(path: Path) -> bool:
    """Whether the cloud of a .spz is drawn antialiased; the file holds what its header announces, and no more.

    Parameters
    ----------
    path : the file

    Raises
    ------
    InputError
        If it is no .spz, is cut off, or unpacks to more than it announces or than may be.
    """
    content = path.read_bytes()
    unpacked = zlib.decompressobj(31)
    try:
        # version 4 packs what follows its header, earlier ones the header too
        head = content if content.startswith(NGSP) else unpacked.decompress(content, HEADER.size)
    except zlib.error:
        head = b""
    if len(head) < HEADER.size:
        raise InputError(f"{path}: must be a whole .spz file; it cannot be unpacked: is it truncated?")
    magic, version, count, degree, _, flags, _ = HEADER.unpack(head[: HEADER.size])
    if magic != NGSP or version not in VERSIONS or degree >= len(HARMONICS):
        raise InputError(
            f"{path}: must be a .spz of version {VERSIONS[0]} to {VERSIONS[-1]} and degree 0 to {len(HARMONICS) - 1};"
            f" it begins with {magic!r}, version {version}, degree {degree}"
        )
    if flags & ~(ANTIALIASED | EXTENDED):
        raise InputError(
            f"{path}: the flags of a .spz must be {ANTIALIASED} (antialiased) and {EXTENDED} (extensions); they are"
            f" {flags:#x}"
        )
    announced = count * (16 + (4 if version >= 3 else 3) + 3 * HARMONICS[degree])
    most = max(LARGEST_FREE, LARGEST_RATIO * len(content))
    if announced > most:
        raise InputError(
            f"{path}: {len(content)} bytes of .spz may unpack to at most {most}; its header announces {count} Gaussians"
            f" in {announced} bytes"
        )
    if content.startswith(GZIP):
        _check_size(path, unpacked, announced)
    return bool(flags & ANTIALIASED)


def _check_size(path: Path, unpacked: "zlib._Decompress", announced: int) -> None:
    """Unpack piece by piece, keeping none, up to what may be."""
    size, waiting = 0, unpacked.unconsumed_tail
    try:
        while not unpacked.eof and size <= announced + EXTENSION_ROOM:
            piece = unpacked.decompress(waiting, PIECE)
            if not piece and not unpacked.unconsumed_tail and not unpacked.eof:
                break
            size, waiting = size + len(piece), unpacked.unconsumed_tail
    except zlib.error as error:
        raise InputError(f"{path}: must be a whole .spz file; it is damaged: {error}") from None
    if size < announced or not (unpacked.eof or size > announced + EXTENSION_ROOM):
        raise InputError(
            f"{path}: its header announces {announced} bytes of Gaussians; {size} are there: it is truncated"
        )
    if size > announced + EXTENSION_ROOM or unpacked.unused_data:
        raise InputError(
            f"{path}: its header announces {announced} bytes of Gaussians; it holds more than extensions take"
        )
