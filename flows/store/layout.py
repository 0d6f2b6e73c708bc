"""Where everything lies in a dataset folder, and writing a file so that it is there whole or not at all."""

import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flows.store.arrays import arrays_of
from tasks.errors import InputError

STAGED_TABLES = ("ticks", "frames")


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
        return self.root / ".staging"

    def receipt(self, clip_id: str) -> Path:
        """Written last for each clip: where it exists, the clip is complete."""
        return self.staging / f"{clip_id}.json"

    def staged(self, clip_id: str, table: str) -> Path:
        return self.staging / f"{clip_id}.{table}.parquet"

    def frame_shard(self, array: str, index: int) -> Path:
        """The one file that holds a clip's frames of one array (Zarr v3 default chunk keys)."""
        further = arrays_of(labels=True)[array].dimensions
        return self.frames.joinpath(array, "c", str(index), "0", "0", "0", *("0" for _ in further))

    def relative(self, path: Path) -> str:
        return path.relative_to(self.root).as_posix()


def write_atomically(path: Path, content: bytes) -> None:
    """Write beside the target, flush to the disk, then rename over it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        with partial.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write_json(path: Path, value: Any) -> None:
    """Readable JSON with sorted keys; the same value gives the same bytes."""
    text = json.dumps(value, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False)
    write_atomically(path, (text + "\n").encode())


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises
    ------
    InputError
        If it is missing or not JSON.
    """
    try:
        return json.loads(path.read_text())
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; is this a muSync dataset?") from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: must be valid JSON; {error}") from None


def clear_partial_files(layout: Layout) -> None:
    """Remove what a killed writer left behind; committed files are never named like this."""
    for path in layout.root.rglob("*.partial*"):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
