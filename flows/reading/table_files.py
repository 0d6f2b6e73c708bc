"""The recorded Parquet files of a dataset: as pyarrow tables, and as a file system for DuckDB that only reads them.

DuckDB's own list of allowed paths lets a query write to them (``COPY ... TO``, also inside ``WITH``). Here writing is
refused where files are opened, whatever the query looks like; and a name is not a path: glob characters or quotes in a
folder's name mean nothing to SQL.
"""

import io
import os
import re
import threading
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq
from fsspec import AbstractFileSystem  # type: ignore[import-untyped]

from catalogs.sentences import shorten, shorten_value
from flows.reading.views import list_absent
from flows.store.layout import OBJECTS, Layout
from flows.store.missing import has_nulls
from flows.store.parquet_files import CHECKED, CLIPS_PER_FILE, refuse_footer
from flows.store.sealed import recorded_grid
from tasks.errors import InputError

if TYPE_CHECKING:
    import pyarrow.dataset
SCHEME = "musync"
STORED = ("clips", "ticks", "frames", "pairs")
"""Tables of every dataset; one with road users has ``objects`` too."""
MOST_ROWS = {"clips": 100_000, "pairs": 10_000_000, "objects": 10_000_000}
"""Rows of the tables that hold a dataset's clips, and the pairs of them, in one file [1]."""
_WHOLE = re.compile(r"telemetry/(?P<table>clips|pairs)\.parquet")
_PART = re.compile(r"telemetry/(?P<table>ticks|frames)/family=[a-z0-9_-]{1,64}/part-[0-9]{4,9}\.parquet")


def table_files(layout: Layout, manifest: Mapping[str, Any]) -> dict[str, dict[str, Path]]:
    """The recorded files of the tables clips, pairs, ticks and frames: name below ``telemetry`` to path.

    Raises
    ------
    InputError
        Listing the tables of which files are missing, and recorded files that lie where no table's do.
    """
    tables: dict[str, dict[str, Path]] = {table: {} for table in STORED}
    problems = []
    for recorded in sorted(manifest["artifacts"]):
        if not recorded.startswith("telemetry/"):
            continue
        named = _WHOLE.fullmatch(recorded) or _PART.fullmatch(recorded)
        if named is None:
            problems.append(f"{layout}/manifest.json: {shorten_value(recorded)}: no place of a table's files")
            continue
        tables[named["table"]][recorded.removeprefix("telemetry/")] = layout.root / recorded
    if recorded_grid(manifest["grid"], layout).has_objects:
        # their records are the clips', which readers of tables leave aside
        files = sorted((layout.telemetry / OBJECTS).glob("clip-*.parquet"))
        tables[OBJECTS] = {f"{OBJECTS}/{path.name}": path for path in files}
    problems += [
        f"{layout}: the files of {table} are missing: musync lab repair makes them again"
        for table, files in tables.items()
        if not files or not all(path.is_file() for path in files.values())
    ]
    if problems:
        raise InputError(problems)
    return tables


def bound_rows(manifest: Mapping[str, Any], origin: object) -> dict[str, int]:
    """Return how many rows a file of each table may have by the grid of its dataset.

    Parameters
    ----------
    manifest : of the dataset
    origin : what messages call it
    """
    clip_rows = recorded_grid(manifest["grid"], origin).rows_per_clip
    return {table: rows * CLIPS_PER_FILE for table, rows in clip_rows.items()} | MOST_ROWS


def open_stored_table(layout: Layout, manifest: Mapping[str, Any], table: str) -> "pyarrow.dataset.Dataset":
    """Return a stored table, clips, ticks, frames or pairs, as a lazy pyarrow dataset; its schema has the units.

    What is not represented is NULL, whichever version of muSync wrote the files.

    Raises
    ------
    InputError
        If its files are missing, or are not as muSync writes them.
    """
    from pyarrow import dataset  # it imports pandas, which takes a third of a second

    paths = list(table_files(layout, manifest)[table].values())
    for path in paths:
        refuse_footer(path, bound_rows(manifest, layout)[table])
    try:
        # without the metadata of the whole: libraries read settings for other libraries there
        stored = pq.read_schema(paths[0])
        schema = pa.schema([*stored, *list_absent(table, stored)])
        checked = dataset.ParquetFileFormat(
            default_fragment_scan_options=dataset.ParquetFragmentScanOptions(**CHECKED)
        )
        partitioning = None
        if table in {"ticks", "frames"}:
            partitioning = dataset.partitioning(pa.schema([("family", pa.string())]), flavor="hive")
            schema = schema.append(pa.field("family", pa.string()))
        opened = dataset.dataset(paths, schema=schema, format=checked, partitioning=partitioning)
        if has_nulls(stored):
            return opened
        from flows.reading.older_tables import OlderTable

        return OlderTable(list(opened.get_fragments()), schema, checked, opened.filesystem)
    except (pa.ArrowException, OSError) as error:
        raise explain_unreadable(layout, error) from None


def explain_unreadable(layout: Layout, error: Exception) -> InputError:
    """Return the refusal of tables that a library cannot read."""
    return InputError(
        f"{layout}: its tables must be as muSync writes them; {shorten(error)}:"
        " musync verify says whether they are damaged"
    )


class TableFiles(AbstractFileSystem):
    """Files to read by name; no other name exists, and nothing can be written.

    Parameters
    ----------
    files : name to path
    most : rows that a file of each table may have [1]
    """

    protocol = SCHEME
    cachable = False

    def __init__(self, files: Mapping[str, Path], most: Mapping[str, int]):
        super().__init__()
        self.files, self.most = dict(files), dict(most)

    def _open(self, path: str, mode: str = "rb", **_: Any) -> "_TableFile":
        if mode != "rb":
            raise PermissionError(f"{path}: a query does not write to a dataset")
        table = re.split(r"[/.]", self._strip_protocol(path))[0]
        refuse_footer(self._path(path), self.most[table])
        return _TableFile(self._path(path))

    def info(self, path: str, **_: Any) -> dict[str, Any]:
        """Name, type and size [B]."""
        return {
            "name": self._strip_protocol(path),
            "type": "file",
            "size": self._path(path).stat().st_size,
        }

    def modified(self, path: str) -> datetime:
        """When the file's content changed last."""
        return datetime.fromtimestamp(self._path(path).stat().st_mtime, UTC)

    def exists(self, path: str, **_: Any) -> bool:
        """Whether there is a file of that name."""
        return self._strip_protocol(path) in self.files

    def glob(self, path: str, **_: Any) -> list[str]:
        """The file of that name, whatever characters it has."""
        return [self._strip_protocol(path)] if self.exists(path) else []

    def _path(self, name: str) -> Path:
        found = self.files.get(self._strip_protocol(name))
        if found is None:
            raise FileNotFoundError(f"{name}: no recorded file of a table")
        return found


class _TableFile(io.RawIOBase):
    """A file that several threads read at once: each has a position of its own."""

    def __init__(self, path: Path):
        self._descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        self._size = os.fstat(self._descriptor).st_size
        self._position = threading.local()

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return getattr(self._position, "value", 0)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self.tell(), os.SEEK_END: self._size}[whence]
        self._position.value = start + offset
        return start + offset

    def read(self, size: int = -1) -> bytes:
        start = self.tell()
        content = os.pread(self._descriptor, self._size - start if size < 0 else size, start)
        self._position.value = start + len(content)
        return content

    def close(self) -> None:
        if not self.closed:
            os.close(self._descriptor)
        super().close()
