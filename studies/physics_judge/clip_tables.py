"""The rows of one clip after the other, from tables of many: each file is read once."""

from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from flows.store.parquet_files import CHECKED, CLIPS_PER_FILE, call_reader, refuse_footer
from flows.store.telemetry import refuse_columns, take_columns
from tasks.conventions import ESSENTIAL


def iterate_clips(
    folder: Path, names: Iterable[str], most: int
) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Yield id and columns of each clip in a folder of Parquet files; a row group at a time is in memory.

    Parameters
    ----------
    folder : of one table
    names : columns that are returned whatever the table has: one that an older dataset does not have is NaN throughout
    most : rows of a clip, by the plan [1]

    Raises
    ------
    InputError
        As `flows.store.telemetry.read_columns` raises it.
    """
    wanted = list(names)
    required = ["clip_id", *(name for name in wanted if name in ESSENTIAL)]
    for path in sorted(folder.rglob("*.parquet")):
        refuse_footer(path, most * CLIPS_PER_FILE)
        file = call_reader(path, pq.ParquetFile, path, **CHECKED)
        rest: pa.Table | None = None
        for group in range(file.num_row_groups):
            part = call_reader(path, file.read_row_group, group)
            table = part if rest is None else pa.concat_tables([rest, part]).unify_dictionaries()
            refuse_columns(table, path, required)
            ids = table["clip_id"].to_numpy(zero_copy_only=False)
            starts = [0, *(np.flatnonzero(ids[1:] != ids[:-1]) + 1).tolist(), len(ids)]
            for start, end in pairwise(starts[:-1]):
                yield str(ids[start]), take_columns(table.slice(start, end - start), wanted)
            rest = table.slice(starts[-2])
        if rest is not None and len(rest):
            yield str(rest["clip_id"][0]), take_columns(rest, wanted)
