"""A dataset as five SQL views, and what its columns mean."""

import math
from pathlib import Path
from typing import Any, Literal

import duckdb
import pyarrow.parquet as pq

from flows.store.address import reading, telemetry
from flows.store.arrays import arrays_of
from flows.store.layout import Layout
from flows.store.sealed import read_manifest
from tasks.conventions import (
    CHECK_CHANNELS,
    CLIP_CHANNELS,
    FRAME_CHANNELS,
    IDENTITY_CHANNELS,
    PAIR_CHANNELS,
    TICK_CHANNELS,
    Channel,
)
from tasks.errors import InputError

_JOIN_KEYS = tuple(c for c in IDENTITY_CHANNELS if c.name in {"clip_id", "label", "weather"})
_SURFACE = tuple(c for c in CLIP_CHANNELS if c.name in {
    "film_depth_mm", "snow_depth_mm", "snow_coverage", "surface_friction", "tyre_peak",
})  # fmt: skip
VIEWS: dict[str, tuple[Channel, ...]] = {
    "clips": (*IDENTITY_CHANNELS, *CLIP_CHANNELS, *CHECK_CHANNELS),
    "ticks": (*_JOIN_KEYS, *TICK_CHANNELS),
    "frames": (*_JOIN_KEYS, *_SURFACE, *FRAME_CHANNELS, *TICK_CHANNELS),
    "verdicts": (*_JOIN_KEYS, *CHECK_CHANNELS),
    "pairs": PAIR_CHANNELS,
}
"""The views and their columns; ``ticks`` and ``frames`` also have ``family``, by which their files lie."""


def table_files(layout: Layout, table: str) -> str:
    """Glob of the Parquet files of a stored table: clips, pairs, ticks or frames."""
    if table in {"clips", "pairs"}:
        return str(layout.telemetry / f"{table}.parquet")
    return str(layout.telemetry / table / "*" / "*.parquet")


def connect(dataset: str | Path) -> duckdb.DuckDBPyConnection:
    """A DuckDB connection in memory with the views of a sealed dataset; what is not represented is NULL.

    Raises
    ------
    InputError
        If the folder is no sealed dataset.
    """
    layout = reading(dataset, telemetry)
    read_manifest(layout)
    return connect_sealed(layout)


def connect_sealed(layout: Layout) -> duckdb.DuckDBPyConnection:
    """`connect` to a dataset whose manifest has been read."""
    connection = duckdb.connect()
    for table in ("clips", "pairs", "ticks", "frames"):
        files = table_files(layout, table).replace("'", "''")
        connection.execute(
            f"CREATE VIEW {table} AS SELECT {_columns(layout, table)}"
            f" FROM read_parquet('{files}', hive_partitioning = {table in {'ticks', 'frames'}})"
        )
    checks = ", ".join(channel.name for channel in CHECK_CHANNELS)
    connection.execute(f"CREATE VIEW verdicts AS SELECT clip_id, label, weather, {checks} FROM clips")
    return connection


def _columns(layout: Layout, table: str) -> str:
    """All columns, with NaN as NULL: SQL's aggregates leave NULL out, and would return NaN for NaN."""
    if table == "ticks":  # every tick has every number
        return "*"
    first = next(layout.root.glob(str(Path(table_files(layout, table)).relative_to(layout.root))), None)
    if first is None:
        raise InputError(f"{layout}: the files of {table} are missing: musync repair makes them again")
    floats = [field.name for field in pq.read_schema(first) if str(field.type) == "double"]
    nulls = ", ".join(f'nullif("{name}", \'nan\'::DOUBLE) AS "{name}"' for name in floats)
    return f"* REPLACE ({nulls})"


def sql(dataset: str, query: str) -> dict[str, Any]:
    """Answer an SQL query over the views clips, ticks, frames, verdicts and pairs.

    Parameters
    ----------
    dataset : a sealed dataset folder
    query : DuckDB SQL, one statement

    Returns
    -------
    ``columns[]`` and ``rows[]``, each a mapping of column to value; NULL is None.

    Raises
    ------
    InputError
        The folder is no sealed dataset, or the query is none that DuckDB answers.
    """
    with connect(dataset) as connection:
        try:
            answer = connection.execute(query)
            names = [column[0] for column in answer.description or ()]
            rows = answer.fetchall()
        except duckdb.Error as error:
            raise InputError(
                f"--- {query}: {str(error).strip()}\nviews are {', '.join(VIEWS)}; musync schema lists their columns"
            ) from None
    return {"columns": names, "rows": [dict(zip(names, map(_plain, row), strict=True)) for row in rows]}


def schema(of: Literal["views", "grid"] = "views") -> dict[str, Any]:
    """Every view's columns: name, unit, paper symbol, CF standard name and description, from the one table.

    The key ``arrays`` holds those of the frames: type and dimensions too.

    Parameters
    ----------
    of : ``grid`` gives the JSON Schema of a grid file instead
    """
    if of == "grid":
        from catalogs.grids.schema import grid_schema

        return grid_schema()
    views = {view: [_meaning(channel) for channel in channels] for view, channels in VIEWS.items()}
    return views | {
        "arrays": [
            _meaning(array.channel)
            | {"dtype": array.dtype, "dimensions": ["clip", "frame", "y", "x", *array.dimensions]}
            for array in arrays_of(labels=True).values()
        ]
    }


def _meaning(channel: Channel) -> dict[str, Any]:
    return {
        "name": channel.name,
        "unit": channel.unit,
        "symbol": channel.symbol,
        "standard_name": channel.standard_name,
        "description": channel.description,
    }


def _plain(value: Any) -> Any:
    """A value that JSON has."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value if isinstance(value, bool | int | float | str | None) else str(value)
