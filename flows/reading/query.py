"""A dataset as five SQL views, and what its columns mean."""

import re
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, TypeVar

import duckdb
import pyarrow as pa

from catalogs.sentences import shorten
from flows.reading.answer_files import format_csv, format_parquet, make_plain, open_answer_file
from flows.reading.connection import connect_views
from flows.reading.suggestions import suggest_names
from flows.reading.views import VIEWS
from flows.store.arrays import EVERY_ARRAY
from tasks.conventions import SOME_CLIPS_CHANNELS, Channel
from tasks.errors import InputError

MOST_VALUES = 20_000_000
"""Of one answer [1]: as Python objects they take some 2 GB."""
_FETCHED_AT_ONCE = 10_000
_SECONDS_TO_END = 5.0
_REACHED = re.compile(
    r'Cannot access (?:file|directory) "(?P<place>.*)" - file system operations are disabled'
    r"|the configuration has been locked|Loading external extensions is disabled"
)
_NO_COLUMN = re.compile(
    r'column (?:named |with name )?"+(?P<name>[^"\n]+)"[^\n]*(?:not found|does not exist|no matching entry)'
    r'|does not have a column (?:named|with name) "(?P<of_table>[^"\n]+)"',
    re.IGNORECASE,
)
_LISTED = f"views are {', '.join(VIEWS)}; musync lab schema lists their columns"
_CANDIDATES = re.compile(r'"([^"\n]+)"')
_Result = TypeVar("_Result")


def query_dataset(
    dataset: str, query: str, *, allow_files: bool = False, to: str | None = None, out: str | None = None
) -> dict[str, Any]:
    """Answer an SQL query over the views clips, ticks, frames, verdicts and pairs; Ctrl-C ends it.

    Parameters
    ----------
    dataset : a sealed dataset folder
    query : DuckDB SQL, one statement; with ``allow_files`` several, of which the last one is answered
    allow_files : the query may read and write files of this machine, and load extensions; else it reaches the views
        alone
    to : csv or parquet writes the answer to a file; None returns it
    out : that file; one that ``musync sql`` has not written is never overwritten

    Returns
    -------
    ``columns[]`` and ``rows[]``, each a mapping of column to value; NULL is None. Of columns with one name the second
    is called ``name_1``, as in ``data.sql(...).df()``. With ``to``: ``file``, ``columns[]`` and the number of rows,
    ``row_count``.

    Raises
    ------
    InputError
        The folder is no sealed dataset, the query is none that DuckDB answers or more than one, it asks for files
        without ``allow_files``, its answer is too large to be returned, or the file cannot be written.
    """
    file = open_answer_file(to, out)
    fetch = _fetch_table if to == "parquet" else _fetch_rows
    with connect_views(dataset, allow_files=allow_files) as connection:
        try:
            refuse_several(connection, query, allow_files=allow_files)
            names, rows = run_interruptibly(connection, lambda: fetch(connection, query))
        except duckdb.Error as error:
            raise refused_query(query, error, "--allow-files") from None
    names = number_repeats(names)
    if file is None:
        return {
            "columns": names,
            "rows": [dict(zip(names, map(make_plain, row), strict=True)) for row in rows],
        }
    (name,) = file.names
    file.write(
        name, format_parquet(rows.rename_columns(names)) if to == "parquet" else format_csv(names, rows)
    )
    return {"file": str(file.path(name)), "columns": names, "row_count": len(rows)}


def number_repeats(names: Sequence[str]) -> list[str]:
    """Return names of which no two are the same to SQL, which knows no case: a, A and a become a, A_1 and a_2."""
    numbered: list[str] = []
    repeats: dict[str, int] = {}
    for name in names:
        unique, known = name, name.casefold()
        while unique.casefold() in repeats:
            repeats[known] += 1
            unique = f"{name}_{repeats[known]}"
        repeats[unique.casefold()] = 0
        numbered.append(unique)
    return numbered


def refuse_several(connection: duckdb.DuckDBPyConnection, query: str, *, allow_files: bool) -> None:
    """Raise `InputError` unless a query is one statement: of several, DuckDB answers the last one alone.

    Parameters
    ----------
    connection : that parses it
    query : as it was asked
    allow_files : several are taken, as LOAD and ATTACH come before the question
    """
    count = len(connection.extract_statements(query))
    if count == 0 or (count > 1 and not allow_files):
        raise InputError(f"query {shorten(query)}: must be one SQL statement; it holds {count}")


def _fetch_rows(connection: duckdb.DuckDBPyConnection, query: str) -> tuple[list[str], Any]:
    """Names of the columns, and tuples."""
    answer = connection.execute(query)
    names = [column[0] for column in answer.description or ()]
    rows: list[tuple[Any, ...]] = []
    while some := answer.fetchmany(_FETCHED_AT_ONCE):
        rows += some
        _bound_answer(query, len(rows), len(names))
    return names, rows


def _fetch_table(connection: duckdb.DuckDBPyConnection, query: str) -> tuple[list[str], Any]:
    """Names of the columns, and an Arrow table."""
    relation = connection.sql(query)
    count, batches = 0, []
    reader = pa.RecordBatchReader.from_stream(relation)
    for batch in reader:
        batches.append(batch)
        count += batch.num_rows
        _bound_answer(query, count, batch.num_columns)
    return reader.schema.names, pa.Table.from_batches(batches, reader.schema)


def _bound_answer(query: str, rows: int, columns: int) -> None:
    if rows * columns > MOST_VALUES:
        raise InputError(
            f"query {shorten(query)}: the answer must have at most {MOST_VALUES:,} values (rows times columns); it"
            " has more: add LIMIT, or take it in parts with musync.open(...).sql(...).to_arrow_reader()"
        )


def run_interruptibly(connection: duckdb.DuckDBPyConnection, work: Callable[[], _Result]) -> _Result:
    """Do ``work`` with a connection so that Ctrl-C ends it: DuckDB by itself looks at signals only between results."""
    outcome: Future[_Result] = Future()

    def run() -> None:
        try:
            outcome.set_result(work())
        except BaseException as error:  # handed over to the thread that waits
            outcome.set_exception(error)

    worker = threading.Thread(target=run, name="musync-sql", daemon=True)
    worker.start()
    try:
        return outcome.result()
    except KeyboardInterrupt:
        connection.interrupt()
        worker.join(_SECONDS_TO_END)
        raise


def refused_query(query: str, error: Exception, option: str) -> InputError:
    """The sentence for a query that DuckDB refuses; where it reaches for more than the views, what would let it.

    Parameters
    ----------
    query : as it was asked
    error : DuckDB's
    option : how the caller lets SQL use files
    """
    text = str(error).strip()
    reached = _REACHED.search(text)
    if (wrong := _NO_COLUMN.search(text)) is not None:
        return _suggest_columns(query, wrong["name"] or wrong["of_table"], text)
    if reached is None:
        return InputError(f"query {shorten(query)}: {_last_line(text)}\n{_LISTED}")
    asked = (
        shorten(reached["place"]) if reached["place"] else "a change of DuckDB's settings, or an extension"
    )
    return InputError(
        f"query {shorten(query)}: this query asks for {asked}, and may read the dataset's views alone;"
        f" {option} lets SQL read and write files of this machine"
    )


def _suggest_columns(query: str, name: str, text: str) -> InputError:
    """The sentence for a column that does not exist: near names of the views that the query reads, and who has it."""
    read = [view for view in VIEWS if re.search(rf"\b{view}\b", query, re.IGNORECASE)] or list(VIEWS)
    known = [channel.name for view in read for channel in VIEWS[view]]
    known += _CANDIDATES.findall(text.partition("Candidate")[2])  # of the query's own tables too
    error = suggest_names(
        f"query {shorten(query)}: {' and '.join(read)}: column",
        [name],
        list(dict.fromkeys(known)),
        "musync lab schema",
    )
    having = [view for view, channels in VIEWS.items() if name.casefold() in {c.name for c in channels}]
    elsewhere = f"; {' and '.join(having)} have this column" if having else ""
    return InputError(
        f"{error.problems[0]}{elsewhere}\nviews are {', '.join(VIEWS)}; musync lab schema lists their columns"
    )


def _last_line(text: str) -> str:
    """Return DuckDB's message; of an exception that a file raised, its sentence without the traceback."""
    return text.splitlines()[-1] if text.startswith("Traceback") else text


def list_columns(*, grid: bool = False) -> dict[str, Any]:
    """Every view's columns: name, unit, paper symbol, CF standard name and description, from the one table.

    The key ``arrays`` holds those of the frames: type and dimensions too.

    Parameters
    ----------
    grid : whether to return the JSON Schema of a grid file instead
    """
    if grid:
        from catalogs.grids.schema import grid_schema

        return grid_schema()
    views = {view: [_describe_channel(channel) for channel in channels] for view, channels in VIEWS.items()}
    views["clips"] += [_describe_channel(channel) for channel in SOME_CLIPS_CHANNELS]
    return views | {
        "arrays": [
            _describe_channel(array.channel)
            | {"dtype": array.dtype, "dimensions": ["clip", "frame", "y", "x", *array.dimensions]}
            for array in EVERY_ARRAY.values()
        ]
    }


def _describe_channel(channel: Channel) -> dict[str, Any]:
    return {
        "name": channel.name,
        "unit": channel.unit,
        "symbol": channel.symbol,
        "standard_name": channel.standard_name,
        "description": channel.description,
    }
