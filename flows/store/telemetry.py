"""Telemetry as Arrow tables and Parquet files, labelled from the one table of conventions."""

import shutil
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from flows.store.layout import write_pieces
from flows.store.missing import has_nulls, null_missing, read_values
from flows.store.parquet_files import CHECKED, CLIPS_PER_FILE, STAGED, call_reader, refuse_footer
from manifests.canonical import sha256_of
from tasks.conventions import CHANNELS_BY_NAME, ESSENTIAL, FRAME_CHANNELS, TICK_CHANNELS, Channel
from tasks.errors import InputError

ROW_GROUP_ROWS = 100_000
SHOWN_COLUMNS = 8


def labelled_table(columns: Mapping[str, Any], constants: Mapping[str, Any] | None = None) -> pa.Table:
    """An Arrow table whose fields carry unit, symbol, CF name and description; NaN becomes NULL.

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
    fields = [labelled_field(name, array.type) for name, array in arrays.items()]
    return null_missing(pa.Table.from_arrays(list(arrays.values()), schema=pa.schema(fields)))


def labelled_field(name: str, kind: pa.DataType) -> pa.Field:
    """Return a column's field with the unit, symbol, CF name and description of its channel, if it is one."""
    channel = CHANNELS_BY_NAME.get(name)
    return pa.field(name, kind, metadata=None if channel is None else channel_labels(channel))


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
    write_pieces(path, encode_tables(tables))


def copy_table(source: Path, target: Path) -> None:
    """Copy a sealed Parquet file; that of an older dataset is written again, with NULL where a value is NaN."""
    with call_reader(source, pq.ParquetFile, source, pre_buffer=False, **CHECKED) as file:
        if has_nulls(file.schema_arrow):
            shutil.copyfile(source, target)
        else:
            write_tables(map(null_missing, map(file.read_row_group, range(file.num_row_groups))), target)


def encode_tables(tables: Iterable[pa.Table]) -> Iterator[bytes]:
    """Yield the bytes that `write_tables` writes, those of a row group as soon as they are there."""
    return _parquet_pieces(_cut_row_groups(tables))


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


def read_parts(paths: Iterable[Path], most: int) -> Iterator[pa.Table]:
    """Yield the tables of files one at a time, with common dictionaries: together they are one table.

    Parameters
    ----------
    paths : Parquet files of one schema, fewer than a process may have open
    most : rows that each may have [1]

    Raises
    ------
    InputError
        If one is missing, or is no table as muSync writes it.
    """
    paths = list(paths)
    for path in paths:
        refuse_footer(path, most, STAGED)
    # without buffers ahead, which a file would hold until it is closed
    options = {"pre_buffer": False, **CHECKED}
    files = [(path, call_reader(path, pq.ParquetFile, path, remedy=STAGED, **options)) for path in paths]
    encoded = [field.name for field in files[0][1].schema_arrow if pa.types.is_dictionary(field.type)]
    constants = pa.concat_tables(
        call_reader(path, file.read, encoded, remedy=STAGED, use_threads=False) for path, file in files
    ).unify_dictionaries()
    common = {name: constants[name].chunk(0).slice(0, 0) for name in encoded}
    for path, file in files:
        table = call_reader(path, file.read, remedy=STAGED, use_threads=False)
        file.close()
        refuse_columns(table, path)
        for name, empty in common.items():
            chunks = pa.chunked_array([empty, *table[name].chunks]).unify_dictionaries().chunks[1:]
            index = table.schema.get_field_index(name)
            table = table.set_column(index, table.schema.field(index), pa.chunked_array(chunks))
        yield table


def read_table(
    path: Path, clip_id: str | None = None, required: Iterable[str] = (), *, most: int
) -> pa.Table:
    """A Parquet file, or a folder of them, with NULL where a value is not represented.

    Parameters
    ----------
    path : file or folder
    clip_id : clip whose rows are read; None takes all
    required : names of columns that must be there
    most : rows of the clip, or without one of the table, by the plan: no file has more than those of `CLIPS_PER_FILE`
        clips [1]

    Raises
    ------
    InputError
        If there is no such file, it is no table as muSync writes it, lacks a column, or has no row of the clip.
    """
    for file in sorted(path.rglob("*.parquet")) if path.is_dir() else [path]:
        refuse_footer(file, most if clip_id is None else most * CLIPS_PER_FILE)
    filters = None if clip_id is None else [("clip_id", "==", clip_id)]
    table = call_reader(path, pq.read_table, path, filters=filters, **CHECKED)
    refuse_columns(table, path, required, clip_id)
    return table if has_nulls(table.schema) else null_missing(table)


def refuse_columns(
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
        f"{path}: {fault} {', '.join(names[:SHOWN_COLUMNS])}: musync lab repair makes the table again"
        for fault, names in faults.items()
        if names
    ]
    if problems:
        raise InputError(problems)


def list_columns(path: Path) -> list[str]:
    """Return the names of the columns of a Parquet file, or of those of a folder.

    Parameters
    ----------
    path : file or folder

    Raises
    ------
    InputError
        If there is no such file, or it is no table as muSync writes it.
    """
    names: list[str] = call_reader(path, pq.ParquetDataset, path).schema.names
    return names


def read_columns(
    path: Path, clip_id: str | None = None, names: Iterable[str] = (), *, most: int, exact: bool = True
) -> dict[str, np.ndarray]:
    """The columns of `read_table` as NumPy arrays.

    Parameters
    ----------
    path, clip_id, most : as of `read_table`
    names : columns that are returned whatever the table has: one that an older dataset does not have is NaN throughout
    exact : whether the clip must have just as many rows

    Raises
    ------
    InputError
        As `read_table` raises it, for another number of rows, or if one of the names is `ESSENTIAL` and not there.
    """
    wanted = list(names)
    table = read_table(path, clip_id, [name for name in wanted if name in ESSENTIAL], most=most)
    if exact and len(table) != most:
        raise InputError(
            f"{path}: must hold {most} rows of clip {clip_id}; it holds {len(table)}: musync lab repair makes the table"
            " again"
        )
    return take_columns(table, wanted)


def take_columns(table: pa.Table, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Return the columns of a table, and each of ``names`` that it does not have as NaN."""
    columns = table_columns(table)
    return columns | {name: np.full(len(table), np.nan) for name in names if name not in columns}


def table_columns(table: pa.Table) -> dict[str, np.ndarray]:
    """Return NumPy arrays by column name: NULL is NaN again, and a fixed-size list column is 2-D."""
    return {name: read_values(table[name].combine_chunks()) for name in table.column_names}


def content_hash(table: str, columns: Mapping[str, np.ndarray]) -> str:
    """Return what a clip's record holds of its ticks or frames: a table of an older dataset decides its columns.

    Parameters
    ----------
    table : ticks or frames
    columns : of one clip; those that repeat its id and figures in every row do not count
    """
    if table == "ticks":
        return columns_hash(columns, [channel.name for channel in TICK_CHANNELS if channel.name in columns])
    names = {channel.name for channel in (*FRAME_CHANNELS, *TICK_CHANNELS)}
    return columns_hash(columns, sorted(names & columns.keys()))


def columns_hash(columns: Mapping[str, np.ndarray], names: Iterable[str]) -> str:
    """SHA-256 over the named columns' decoded bytes: the same on any Arrow version, and for every NaN."""
    parts: list[bytes | memoryview] = []
    for name in names:
        values = np.ascontiguousarray(columns[name])
        if values.dtype.kind == "f":
            values = np.where(np.isnan(values), np.nan, values)
        parts += [f"{name} {values.dtype.str} {values.shape}\n".encode(), values.data.cast("B")]
    return sha256_of(parts)


def _holds_numbers(column: pa.ChunkedArray) -> bool:
    kind = column.type
    if pa.types.is_fixed_size_list(kind):
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
