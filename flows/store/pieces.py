"""Writing a file piece by piece, so that it is there whole or not at all and never whole in memory."""

import os
from collections.abc import Iterable
from pathlib import Path

from flows.store.layout import PARTIAL, write_atomically


def write_pieces(path: Path, pieces: Iterable[bytes]) -> None:
    """Write pieces beside the target, flush them to the disk, then rename the file over it.

    Parameters
    ----------
    path : of the file
    pieces : its content, in order
    """
    # claims the name, its folder and the folders above it on the disk, as for every other file
    partial = path.with_name(f"{path.name}.{os.getpid()}{PARTIAL}")
    write_atomically(partial, b"")
    try:
        with partial.open("r+b") as stream:
            for piece in pieces:
                stream.write(piece)
            stream.flush()
            os.fsync(stream.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    descriptor = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
