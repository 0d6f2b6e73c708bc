"""The files of a campaign folder, each checked by itself: campaign.yaml, runs.csv, and a run's Parquet."""

import csv
import io
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from catalogs.channel_maps import HIGHEST_RATE
from catalogs.channel_maps.conditions import find_condition_problems
from catalogs.documents import LARGEST_YAML, read_content
from catalogs.names import find_name_problem
from catalogs.quantities import Text
from catalogs.sentences import shorten, shorten_value
from tasks.errors import InputError
from tasks.surface.weather import find_weather_problem

LARGEST_TABLE = 64 * 2**20
"""Bytes of runs.csv [1]: a line of 200 bytes for each of 300,000 runs."""
LARGEST_RUN = 2**31
"""Bytes of a run's Parquet [1]."""
SPELLINGS = {"m s-1": "m/s", "m s-2": "m/s^2", "rad s-1": "rad/s"}
"""Units as the telemetry of a dataset writes them, and as a campaign does."""
MOST_SAMPLES = 20_000_000
"""Samples of a run [1]: five hours at 1 kHz; a few bytes of Parquet can claim billions."""
MOST_COLUMNS, LONGEST_COLUMN = 20_000, 1_000
"""Columns of a table, and characters of the name of one [1]."""


class CampaignHeader(BaseModel):
    """Keys of campaign.yaml that every reader needs; other keys are notes."""

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)

    campaign: Text
    vehicle: Text
    sample_rate_hz: Annotated[float, Field(strict=True, gt=0, le=HIGHEST_RATE)]


def read_header_bytes(folder: Path) -> tuple[bytes, bytes]:
    """The content of campaign.yaml and runs.csv.

    Parameters
    ----------
    folder : of the campaign

    Raises
    ------
    InputError
        Naming each that is missing or cannot be read.
    """
    missing = [name for name in ("campaign.yaml", "runs.csv") if not os.path.isfile(folder / name)]
    if missing:
        raise InputError([f"a campaign folder needs {name}; {shorten(folder)} has none" for name in missing])
    contents: list[bytes] = []
    problems: list[str] = []
    for name, largest in (("campaign.yaml", LARGEST_YAML), ("runs.csv", LARGEST_TABLE)):
        try:
            contents.append(read_content(folder / name, f"campaign folder's {name}", largest))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return contents[0], contents[1]


def parse_rows(content: bytes, needed: Collection[str], numbers: Collection[str]) -> list[dict[str, str]]:
    """The lines of runs.csv, each with its run, weather and numbers checked.

    Parameters
    ----------
    content : CSV as UTF-8
    needed : columns that there must be
    numbers : columns that hold finite numbers, where there are such

    Raises
    ------
    InputError
        With one sentence per problem.
    """
    try:
        reader = csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline=""), strict=True)
        names, rows = list(reader.fieldnames or ()), list(reader)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"runs.csv must be UTF-8 text; line {line} is not: save it as UTF-8") from None
    except csv.Error as error:
        raise InputError(f"runs.csv must be CSV; {shorten(error)}") from None
    problems = [f"runs.csv needs the column {name}" for name in needed if name not in names]
    problems += [
        f"runs.csv must have distinct columns; {shorten_value(name)} stands there twice"
        for name in dict.fromkeys(names)
        if names.count(name) > 1
    ]
    if not rows:
        problems.append("runs.csv must list at least one run; it lists none")
    if problems:
        raise InputError(problems)
    seen: set[str] = set()
    for number, row in enumerate(rows, start=1):
        problems += _find_row_problems(row, numbers, f"runs.csv, run {number}", seen)
    if problems:
        raise InputError(problems)
    return rows


def _find_row_problems(row: dict[str, str], numbers: Collection[str], line: str, seen: set[str]) -> list[str]:
    if None in row or None in row.values():
        return [f"{line}: must have as many fields as there are columns"]
    problems = []
    name = row["run"]
    if problem := find_name_problem(name):
        return [f"{line}: a run's name must {problem}"]
    if name in seen:
        problems.append(f"{name}: stands twice in runs.csv: give each run its own name")
    seen.add(name)
    numbers = [key for key in numbers if key in row]
    wrong = [key for key in numbers if not _is_number(row[key])]
    problems += [f"{name}: {key} must be a finite number; it is {shorten_value(row[key])}" for key in wrong]
    if problem := find_weather_problem(row["weather"]):
        problems.append(f"{name}: weather {problem}")
    elif not wrong:
        facts = {"weather": row["weather"], **{key: float(row[key]) for key in numbers}}
        problems += [f"{name}: {problem}" for problem in find_condition_problems(facts)]
    return problems


def _is_number(text: str) -> bool:
    try:
        return isfinite(float(text))
    except ValueError:
        return False


def parse_columns(
    content: bytes, file: str, names: Collection[str]
) -> tuple[dict[str, NDArray[np.float64]], dict[str, str]]:
    """Columns of a run's Parquet file, and the units that its metadata gives for them.

    Parameters
    ----------
    content : the file
    file : its name, for the sentences
    names : columns to take where they are there

    Raises
    ------
    InputError
        With one sentence per problem: no Parquet, too many samples, columns that are no numbers or stand twice.
    """
    with open_parquet(content, file) as parquet:
        schema = parquet.schema_arrow
        found = [name for name in schema.names if name in names]
        if problems := _find_column_problems(schema, found, file):
            raise InputError(problems)
        table = parquet.read(columns=found, use_threads=False)
        columns = {name: _as_floats(table[name].combine_chunks()) for name in found}
        units = {name: read_unit(schema.field(name)) for name in found}
    return columns, {name: unit for name, unit in units.items() if unit is not None}


@contextmanager
def open_parquet(content: bytes, file: str, **options: Any) -> Iterator[pq.ParquetFile]:
    """Open the Parquet file of somebody else; what Arrow raises while it is read becomes a sentence.

    Read its columns with ``use_threads=False``: a thread of Arrow that outlives a command aborts it as it ends.

    Parameters
    ----------
    content : the file
    file : its name, for the sentences
    options : of `pyarrow.parquet.ParquetFile`

    Raises
    ------
    InputError
        If it is no Parquet, or its footer promises more rows, columns or longer names than a recording may have.
    """
    try:
        with pq.ParquetFile(pa.BufferReader(content), pre_buffer=False, **options) as parquet:
            count = parquet.metadata.num_rows
            problems = find_name_bounds(parquet.schema_arrow.names, file)
            if not 0 <= count <= MOST_SAMPLES:
                problems.append(f"{file} must have at most {MOST_SAMPLES} samples; it has {count}")
            if problems:
                raise InputError(problems)
            yield parquet
    except InputError:
        raise
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError, OverflowError) as error:
        raise InputError(f"{file} must be a Parquet file of numbers; {shorten(error)}") from None


def find_name_bounds(names: Sequence[str], file: str) -> list[str]:
    """Return the problems of a table with more columns, or a longer name of one, than a recording has.

    Parameters
    ----------
    names : of its columns
    file : its name, for the sentences
    """
    problems = []
    if len(names) > MOST_COLUMNS:
        problems.append(f"{file} must have at most {MOST_COLUMNS} columns; it has {len(names)}")
    if (longest := max(map(len, names), default=0)) > LONGEST_COLUMN:
        problems.append(
            f"{file} must have names of at most {LONGEST_COLUMN} characters; one has {longest}: rename that column"
        )
    return problems


def find_unit_problems(units: Mapping[str, str], wanted: Mapping[str, str], file: str) -> list[str]:
    """Return a sentence for each column whose file states another unit than its reader takes.

    Parameters
    ----------
    units : that the file states, by column; a column without one counts as correct
    wanted : by column
    file : its name, for the sentences
    """
    return [
        f"{file}: column {name} must be in {wanted[name]}; its metadata says {shorten(unit, 40)}: convert it"
        for name, unit in units.items()
        if SPELLINGS.get(unit, unit) != wanted[name]
    ]


def _find_column_problems(schema: pa.Schema, found: Sequence[str], file: str) -> list[str]:
    problems = [
        f"{file} must have distinct columns; {name} stands there twice"
        for name in dict.fromkeys(found)
        if found.count(name) > 1
    ]
    if problems:
        return problems
    return [
        f"channel {name} must be of numbers; {file} has it as {shorten(schema.field(name).type, 60)}"
        for name in found
        if not (pa.types.is_integer(schema.field(name).type) or pa.types.is_floating(schema.field(name).type))
    ]


def _as_floats(column: pa.Array) -> NDArray[np.float64]:
    """Return the numbers of a column, null as NaN; Arrow's own way imports pandas, a sixth of a verdict's start."""
    numbers = column.to_numpy(zero_copy_only=False) if column.null_count else np.from_dlpack(column)
    return np.array(numbers, dtype=np.float64)


def read_unit(field: pa.Field) -> str | None:
    """Return the unit that a field's metadata states; None if it states none."""
    metadata = field.metadata or {}
    return metadata[b"units"].decode("utf-8", "replace") if b"units" in metadata else None
