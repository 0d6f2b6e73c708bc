"""Writing a file piece by piece, so that it is there whole or not at all and never whole in memory."""

import os
from collections.abc import Iterable
from pathlib import Path
from threading import get_native_id

from flows.store.layout import PARTIAL


def write_pieces(path: Path, pieces: Iterable[bytes]) -> None:
    """Write pieces beside the target, flush them to the disk, then rename the file over it.

    Parameters
    ----------
    path : of the file, in a folder that is there
    pieces : its content, in order
    """
    # the form of `flows.store.layout.write_atomically`, by which what a killed run left is known
    partial = path.with_name(f"{path.name}.{os.getpid()}-{get_native_id()}{PARTIAL}")
    partial.unlink(missing_ok=True)
    try:
        with partial.open("xb") as stream:  # exclusive: a link that lies there is not followed
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
