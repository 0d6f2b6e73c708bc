"""DuckDB over a sealed dataset's tables: queries reach the recorded files, to read, and nothing else."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq

from catalogs.sentences import shorten
from flows.reading.table_files import SCHEME, TableFiles, bound_rows, open_stored_table, table_files
from flows.reading.views import VIEWS, list_absent
from flows.store.address import open_for_reading, want_telemetry
from flows.store.layout import OBJECTS, Layout
from flows.store.missing import has_nulls
from flows.store.object_tables import read_no_objects
from flows.store.parquet_files import refuse_footer
from flows.store.sealed import read_manifest_head
from manifests.manifest import is_traced
from tasks.errors import InputError

_SQL_TYPES = {pa.float64(): "DOUBLE", pa.string(): "VARCHAR"}
_SETTINGS: dict[str, str | bool | int | float | list[str]] = {
    "autoinstall_known_extensions": False,
    "autoload_known_extensions": False,
    "python_enable_replacements": False,
    "memory_limit": "50%",  # the answer, and other programs, need some too
}
_CLOSED: dict[str, str | bool | int | float | list[str]] = {
    "temp_directory": "",
    "allow_persistent_secrets": False,
}
"""Nothing is put aside on the disk: a query that needs more memory ends with an error and fills no disk."""


def connect_views(dataset: str | Path, *, allow_files: bool = False) -> duckdb.DuckDBPyConnection:
    """Return a DuckDB connection in memory with the views of a sealed dataset; what is not represented is NULL.

    Parameters
    ----------
    dataset : a sealed dataset folder, or an address in an object store
    allow_files : queries may read and write files of this machine, and load extensions, as DuckDB does by itself

    Raises
    ------
    InputError
        If the folder is no sealed dataset.
    """
    layout = open_for_reading(dataset, want_telemetry)
    return connect_sealed(layout, read_manifest_head(layout), allow_files=allow_files)


def connect_sealed(
    layout: Layout, manifest: Mapping[str, Any], *, allow_files: bool = False
) -> duckdb.DuckDBPyConnection:
    """`connect_views` to a dataset whose manifest has been read, with its clips or without.

    Queries reach the recorded tables and nothing else: no file, network, extension or Python variable. They use at most
    half of the machine's memory, and none of its disk: a query that needs more ends with an error.
    """
    tables, traced = table_files(layout, manifest), is_traced(manifest["inputs"])
    most = bound_rows(manifest, layout)
    for table, names in tables.items():
        refuse_footer(next(iter(names.values())), most[table])
    connection = duckdb.connect(config=_SETTINGS if allow_files else _SETTINGS | _CLOSED)
    # where Python runs no file, DuckDB would print one to standard output, among the answers
    connection.execute("SET enable_progress_bar = false")
    paths = {name: path for names in tables.values() for name, path in names.items()}
    connection.register_filesystem(TableFiles(paths, most))
    if not allow_files:
        connection.execute(f"SET allowed_paths = {_format_list(map(_make_address, paths))}")
        connection.execute("SET enable_external_access = false")
        connection.execute("SET lock_configuration = true")
    try:
        for table, names in tables.items():
            schema = pq.read_schema(next(iter(names.values())))
            # of a car that was driven every tick has every number: the largest table is read as it is
            if has_nulls(schema) or (table == "ticks" and not traced):
                absent = "".join(
                    f", NULL::{_SQL_TYPES[x.type]} AS {quote_identifier(x.name)}"
                    for x in list_absent(table, schema)
                )
                connection.execute(
                    f"CREATE VIEW {table} AS SELECT *{absent} FROM"
                    f" read_parquet({_format_list(map(_make_address, names))},"
                    f" hive_partitioning = {table in {'ticks', 'frames'}})"
                )
            else:
                connection.from_arrow(open_stored_table(layout, manifest, table)).create_view(table)
        if OBJECTS not in tables:
            connection.from_arrow(read_no_objects()).create_view(OBJECTS)
        checks = ", ".join(channel.name for channel in VIEWS["verdicts"])
        connection.execute(f"CREATE VIEW verdicts AS SELECT {checks} FROM clips")
    except (duckdb.Error, pa.ArrowException, OSError) as error:
        connection.close()
        raise InputError(
            f"{layout}: its tables must be Parquet files as muSync writes them; {shorten(error)}:"
            " musync verify says whether they are damaged"
        ) from None
    return connection


def quote_identifier(name: str) -> str:
    """A column's or view's name as SQL takes it, whatever characters it has."""
    escaped = name.replace('"', '""')
    return f'"{escaped}"'


def _make_address(name: str) -> str:
    return f"{SCHEME}://{name}"


def _format_list(texts: Iterable[str]) -> str:
    """A list of texts as SQL takes it."""
    escaped = (text.replace("'", "''") for text in texts)
    return "[" + ", ".join(f"'{text}'" for text in escaped) + "]"
