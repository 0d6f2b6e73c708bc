"""Where everything lies in a dataset folder, and writing a file so that it is there whole or not at all."""

import json
import os
import re
import shutil
from collections.abc import Container, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import get_native_id
from typing import Any

from catalogs.documents import read_json_document
from flows.store.arrays import EVERY_ARRAY

STAGED_TABLES = ("ticks", "frames")
OBJECTS = "objects"
"""Name of the table of road users, and of its hash in a clip's record."""
STAGING = ".staging"
PARTIAL = ".musync-partial"
"""End of the name of a file that is being written."""
_HALF = re.compile(rf"(.+)\.(\d+)(?:-\d+)?{re.escape(PARTIAL)}", re.DOTALL)
RECORD = "file of a muSync dataset"
"""How messages call plan, receipts and manifest."""


@dataclass(frozen=True)
class Layout:
    """Paths of one dataset; nothing is created by asking for them.

    Parameters
    ----------
    root : folder
    origin : address in an object store that the folder stands for; None for a folder in its own right
    """

    root: Path
    origin: str | None = None

    def __str__(self) -> str:
        return self.origin or str(self.root)

    @property
    def manifest(self) -> Path:
        return self.root / "manifest.json"

    @property
    def plan(self) -> Path:
        return self.root / "plan.json"

    @property
    def inputs(self) -> Path:
        """Frozen copies of the catalogue entries that the run read."""
        return self.root / "inputs"

    @property
    def frames(self) -> Path:
        return self.root / "frames.zarr"

    @property
    def telemetry(self) -> Path:
        return self.root / "telemetry"

    @property
    def previews(self) -> Path:
        return self.root / "previews"

    @property
    def staging(self) -> Path:
        """Clips that are made but not yet sealed into the dataset."""
        return self.root / STAGING

    def receipt(self, clip_id: str) -> Path:
        """Written last for each clip: where it exists, the clip is complete."""
        return self.staging / f"{clip_id}.json"

    def staged(self, clip_id: str, table: str) -> Path:
        return self.staging / f"{clip_id}.{table}.parquet"

    def frame_shard(self, array: str, index: int) -> Path:
        """The one file that holds a clip's frames of one array (Zarr v3 default chunk keys)."""
        further = EVERY_ARRAY[array].dimensions
        return self.frames.joinpath(array, "c", str(index), "0", "0", "0", *("0" for _ in further))

    def object_table(self, index: int) -> Path:
        """The file with a clip's road users, of a dataset that has any."""
        return self.telemetry / "objects" / f"clip-{index:05d}.parquet"

    def relative(self, path: Path) -> str:
        return path.relative_to(self.root).as_posix()


def write_atomically(path: Path, content: bytes | memoryview) -> None:
    """Write beside the target, flush to the disk, then rename over it, so that the file is there whole or not at all.

    Folders are flushed too: what was written before this file is on the disk when this file is.
    """
    write_pieces(path, [content])


def write_pieces(path: Path, pieces: Iterable[bytes | memoryview]) -> None:
    """Write pieces in their order as `write_atomically` does; the file is never whole in memory."""
    _make_folder(path.parent)
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
    _flush_folder(path.parent)


def _make_folder(folder: Path) -> None:
    """Make a folder and those above it, each on the disk before the next."""
    if not folder.is_dir():
        _make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        _flush_folder(folder.parent)


def _flush_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_json(path: Path, value: Any) -> None:
    """Write readable JSON with sorted keys; the same value gives the same bytes."""
    write_atomically(path, encode_json(value))


def encode_json(value: Any) -> bytes:
    """Return the bytes that `write_json` writes."""
    text = json.dumps(value, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False)
    return (text + "\n").encode()


def read_json(path: Path) -> Any:
    """Read a JSON file of a dataset.

    Raises
    ------
    InputError
        If it is missing, no regular file, or not JSON.
    """
    return read_json_document(path, RECORD)


@contextmanager
def write_folder(folder: Path) -> Iterator[Path]:
    """Yield a folder to fill beside the final one, which takes its place when all is written.

    Parameters
    ----------
    folder : final place, new or empty
    """
    for left in list_abandoned(folder.absolute().parent, {folder.absolute().name}):
        if left.is_dir() and not left.is_symlink():
            shutil.rmtree(left)
    partial = folder.absolute().with_name(f"{folder.absolute().name}.{os.getpid()}{PARTIAL}")
    partial.mkdir(parents=True)
    try:
        yield partial
        partial.replace(folder)  # takes the place of an empty folder too, and of nothing else
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def list_abandoned(folder: Path, names: Container[str]) -> list[Path]:
    """Return the halves of files and folders that processes of this machine were writing which are no more.

    Parameters
    ----------
    folder : in which they lie; it need not exist
    names : that the whole ones would have
    """
    halves = ((path, _HALF.fullmatch(path.name)) for path in (folder.iterdir() if folder.is_dir() else ()))
    return [path for path, half in halves if half and half[1] in names and not is_alive(int(half[2]))]


def is_alive(process: int) -> bool:
    """Whether a process of this machine has that number."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True
