"""Telemetry as Arrow tables and Parquet files, labelled from the one table of conventions."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from catalogs.sentences import shorten
from flows.store.layout import write_pieces
from manifests.canonical import sha256_of
from tasks.conventions import CHANNELS_BY_NAME, Channel
from tasks.errors import InputError

ROW_GROUP_ROWS = 100_000
SHOWN_COLUMNS = 8
SEALED = "musync repair makes it again"
STAGED = "remove it, and the same musync generate command makes its clip again"
CHECKED: Mapping[str, Any] = {"page_checksum_verification": True}
"""How pyarrow is to read Parquet: each page is held against the checksum that it was written with."""


def labelled_table(columns: Mapping[str, Any], constants: Mapping[str, Any] | None = None) -> pa.Table:
    """An Arrow table whose fields carry unit, symbol, CF name and description.

    Parameters
    ----------
    columns : name to array, one row a sample; a 2-D array becomes a fixed-size list column
    constants : name to a value repeated in every row; text is dictionary-encoded
    """
    arrays: dict[str, pa.Array] = {}
    rows = len(next(iter(columns.values())))
    for name, value in (constants or {}).items():
        array = pa.repeat(pa.scalar(value, type=_constant_type(value)), rows)
        arrays[name] = array.dictionary_encode() if isinstance(value, str) else array
    for name, values in columns.items():
        values = values if isinstance(values, pa.Array) else np.asarray(values)
        if isinstance(values, np.ndarray) and values.ndim == 2:
            arrays[name] = pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])
        else:
            arrays[name] = pa.array(values)
    fields = [
        pa.field(
            name,
            array.type,
            metadata=channel_labels(CHANNELS_BY_NAME[name]) if name in CHANNELS_BY_NAME else None,
        )
        for name, array in arrays.items()
    ]
    return pa.Table.from_arrays(list(arrays.values()), schema=pa.schema(fields))


def write_parquet(table: pa.Table, path: Path) -> None:
    """Write a table as Parquet; the file is there whole or not at all."""
    write_pieces(path, _parquet_pieces([table]))


def write_tables(tables: Iterable[pa.Table], path: Path) -> None:
    """Write the bytes that `write_parquet` writes of all the tables in one; a row group at a time is in memory.

    Parameters
    ----------
    tables : at least one, of one schema and with common dictionaries
    path : of the file, which is there whole or not at all
    """
    write_pieces(path, _parquet_pieces(_cut_row_groups(tables)))


def _cut_row_groups(tables: Iterable[pa.Table]) -> Iterator[pa.Table]:
    """Yield the rows of tables again in tables of `ROW_GROUP_ROWS`, the last one shorter."""
    held: list[pa.Table] = []
    rows, is_cut = 0, False
    for table in tables:
        held.append(table)
        rows += len(table)
        del table
        while rows >= ROW_GROUP_ROWS:
            whole, is_cut = pa.concat_tables(held), True
            group = whole.slice(0, ROW_GROUP_ROWS).combine_chunks()
            held, rows = [whole.slice(ROW_GROUP_ROWS)], rows - ROW_GROUP_ROWS
            del whole  # what the group was copied from goes before the group is encoded
            yield group
            del group
    if rows or not is_cut:  # a table without rows has a row group too
        yield pa.concat_tables(held).combine_chunks()


class _Pieces:
    """Bytes that a Parquet writer has written and nobody has taken yet."""

    closed = False

    def __init__(self) -> None:
        self.written: list[bytes] = []

    def write(self, content: bytes) -> int:
        self.written.append(bytes(content))
        return len(content)

    def flush(self) -> None:
        """Nothing waits: what is written is there to be taken."""

    def take(self) -> list[bytes]:
        taken, self.written = self.written, []
        return taken


def _parquet_pieces(tables: Iterable[pa.Table]) -> Iterator[bytes]:
    """The bytes of a Parquet file, each table's as soon as it is encoded."""
    left = iter(tables)
    waiting = [next(left)]
    pieces, schema = _Pieces(), waiting[0].schema
    floats = [field.name for field in schema if pa.types.is_floating(field.type)]
    with pq.ParquetWriter(
        pa.PythonFile(pieces, "w"),
        schema,
        compression="zstd",
        compression_level=3,
        use_dictionary=[field.name for field in schema if pa.types.is_dictionary(field.type)],
        column_encoding=dict.fromkeys(floats, "BYTE_STREAM_SPLIT"),
        write_page_checksum=True,
    ) as writer:
        while waiting:
            writer.write_table(waiting.pop(), row_group_size=ROW_GROUP_ROWS)
            yield from pieces.take()
            waiting += islice(left, 1)
    yield from pieces.take()
    pa.default_memory_pool().release_unused()  # what encoding took, which it would keep for the next time


def read_parts(paths: Iterable[Path]) -> Iterator[pa.Table]:
    """Yield the tables of files one at a time, with common dictionaries: together they are one table.

    Parameters
    ----------
    paths : Parquet files of one schema, fewer than a process may have open

    Raises
    ------
    InputError
        If one is missing, or is no table as muSync writes it.
    """
    # without buffers ahead, which a file would hold until it is closed
    options = {"pre_buffer": False, **CHECKED}
    files = [(path, _read_file(path, pq.ParquetFile, path, remedy=STAGED, **options)) for path in paths]
    encoded = [field.name for field in files[0][1].schema_arrow if pa.types.is_dictionary(field.type)]
    constants = pa.concat_tables(
        _read_file(path, file.read, encoded, remedy=STAGED, use_threads=False) for path, file in files
    ).unify_dictionaries()
    common = {name: constants[name].chunk(0).slice(0, 0) for name in encoded}
    for path, file in files:
        table = _read_file(path, file.read, remedy=STAGED, use_threads=False)
        file.close()
        _refuse_columns(table, path)
        for name, empty in common.items():
            chunks = pa.chunked_array([empty, *table[name].chunks]).unify_dictionaries().chunks[1:]
            place = table.schema.get_field_index(name)
            table = table.set_column(place, table.schema.field(place), pa.chunked_array(chunks))
        yield table


def read_table(path: Path, clip_id: str | None = None, required: Iterable[str] = ()) -> pa.Table:
    """A Parquet file, or a folder of them.

    Parameters
    ----------
    path : file or folder
    clip_id : clip whose rows are read; None takes all
    required : names of columns that must be there

    Raises
    ------
    InputError
        If there is no such file, it is no table as muSync writes it, lacks a column, or has no row of the clip.
    """
    filters = None if clip_id is None else [("clip_id", "==", clip_id)]
    table = _read_file(path, pq.read_table, path, filters=filters, **CHECKED)
    _refuse_columns(table, path, required, clip_id)
    return table


def iterate_clips(folder: Path, required: Iterable[str] = ()) -> Iterator[tuple[str, pa.Table]]:
    """Yield id and rows of each clip in a folder of Parquet files; each file is read once, a row group at a time.

    Parameters
    ----------
    folder : of one table
    required : names of columns that must be there

    Raises
    ------
    InputError
        As `read_table` raises it.
    """
    for path in sorted(folder.rglob("*.parquet")):
        file = _read_file(path, pq.ParquetFile, path, **CHECKED)
        rest: pa.Table | None = None
        for group in range(file.num_row_groups):
            part = _read_file(path, file.read_row_group, group)
            table = part if rest is None else pa.concat_tables([rest, part]).unify_dictionaries()
            _refuse_columns(table, path, ["clip_id", *required])
            ids = table["clip_id"].to_numpy(zero_copy_only=False)
            starts = [0, *(np.flatnonzero(ids[1:] != ids[:-1]) + 1).tolist(), len(ids)]
            for start, end in pairwise(starts[:-1]):
                yield str(ids[start]), table.slice(start, end - start)
            rest = table.slice(starts[-2])
        if rest is not None and len(rest):
            yield str(rest["clip_id"][0]), rest


def _read_file(
    path: Path, read: Callable[..., Any], *arguments: Any, remedy: str = SEALED, **options: Any
) -> Any:
    """Call a reader of Parquet, whose errors become sentences about the file."""
    try:
        return read(*arguments, **options)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; is this a finished muSync dataset?") from None
    except (pa.ArrowException, OSError, ValueError, TypeError) as error:
        raise InputError(
            f"{path}: must be a Parquet table as muSync writes it; {shorten(error)}: {remedy}"
        ) from None


def _refuse_columns(
    table: pa.Table, path: Path, required: Iterable[str] = (), clip_id: str | None = None
) -> None:
    """Raise `InputError` for a table that lacks a column or a clip, or has text where numbers belong."""
    odd = [
        field.name
        for field in table.schema
        if field.name in CHANNELS_BY_NAME
        and CHANNELS_BY_NAME[field.name].unit
        and not _holds_numbers(table[field.name])
    ]
    faults = {
        "lacks": [name for name in required if name not in table.column_names],
        "has no numbers in": odd,
        "holds no row of clip": [clip_id] if clip_id is not None and not table.num_rows else [],
    }
    problems = [
        f"{path}: {fault} {', '.join(names[:SHOWN_COLUMNS])}: musync repair makes the table again"
        for fault, names in faults.items()
        if names
    ]
    if problems:
        raise InputError(problems)


def read_columns(
    path: Path, clip_id: str | None = None, required: Iterable[str] = (), rows: int | None = None
) -> dict[str, np.ndarray]:
    """The columns of `read_table` as NumPy arrays.

    Parameters
    ----------
    path, clip_id, required : as of `read_table`
    rows : how many there must be; None takes any number [1]

    Raises
    ------
    InputError
        As `read_table` raises it, or for another number of rows.
    """
    table = read_table(path, clip_id, required)
    if rows is not None and len(table) != rows:
        raise InputError(
            f"{path}: must hold {rows} rows of clip {clip_id}; it holds {len(table)}: musync repair makes the table"
            " again"
        )
    return table_columns(table)


def table_columns(table: pa.Table) -> dict[str, np.ndarray]:
    """Return NumPy arrays by column name; a fixed-size list column is 2-D."""
    columns = {}
    for name in table.column_names:
        column = table[name].combine_chunks()
        if pa.types.is_fixed_size_list(column.type):
            columns[name] = column.flatten().to_numpy().reshape(len(column), column.type.list_size)
        else:
            columns[name] = column.to_numpy(zero_copy_only=False)
    return columns


def columns_hash(columns: Mapping[str, np.ndarray], names: Iterable[str]) -> str:
    """SHA-256 over the named columns' decoded bytes: the same on any Arrow version."""
    parts: list[bytes | memoryview] = []
    for name in names:
        values = np.ascontiguousarray(columns[name])
        parts += [f"{name} {values.dtype.str} {values.shape}\n".encode(), values.data.cast("B")]
    return sha256_of(parts)


def _holds_numbers(column: pa.ChunkedArray) -> bool:
    kind = column.type
    if pa.types.is_fixed_size_list(kind):
        if column.null_count:
            return False
        kind = kind.value_type
    return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind))


def _constant_type(value: Any) -> pa.DataType:
    if isinstance(value, bool):
        return pa.bool_()
    if isinstance(value, int):
        return pa.int64()
    return pa.string() if isinstance(value, str) else pa.float64()


def channel_labels(channel: Channel) -> dict[str, str]:
    """Return the metadata of a column or array, without empty entries."""
    labels = {
        "units": channel.unit,
        "symbol": channel.symbol,
        "standard_name": channel.standard_name,
        "description": channel.description,
    }
    return {key: text for key, text in labels.items() if text}
