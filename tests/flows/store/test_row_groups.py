"""Tables that are written a row group at a time have the bytes of the whole."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flows.store import telemetry
from flows.store.telemetry import labelled_table, read_parts, write_parquet, write_tables
from tasks.errors import InputError


def make_table(rows: int, clip: str) -> pa.Table:
    speed = np.arange(rows, dtype=float) + len(clip)
    return labelled_table(
        {"speed": speed, "T_world_rig": np.ones((rows, 16))}, {"clip_id": clip, "weather": "rain"}
    )


@pytest.fixture
def few_rows(monkeypatch):
    monkeypatch.setattr(telemetry, "ROW_GROUP_ROWS", 10)


@pytest.mark.parametrize("sizes", [(0,), (0, 3), (4, 7, 25, 1), (10, 10), (35,)])
def test_tables_one_after_the_other_have_the_bytes_of_one_table(tmp_path, few_rows, sizes):
    whole = make_table(sum(sizes), "a")
    starts = np.cumsum((0, *sizes))
    write_parquet(whole, tmp_path / "whole.parquet")
    write_tables((whole.slice(a, n) for a, n in zip(starts, sizes, strict=False)), tmp_path / "parts.parquet")
    assert (tmp_path / "parts.parquet").read_bytes() == (tmp_path / "whole.parquet").read_bytes()
    assert pq.ParquetFile(tmp_path / "parts.parquet").num_row_groups == max(1, -(-sum(sizes) // 10))


def test_files_are_gathered_into_the_bytes_of_one_table(tmp_path, few_rows):
    tables = [make_table(rows, clip) for rows, clip in ((7, "b"), (12, "a"), (1, "c"))]
    paths = [tmp_path / f"{place}.parquet" for place in range(3)]
    for table, path in zip(tables, paths, strict=True):
        write_parquet(table, path)
    # a list's item has another name in a file than in a table that was never in one
    read = [pq.read_table(path) for path in paths]
    write_parquet(pa.concat_tables(read).unify_dictionaries().combine_chunks(), tmp_path / "whole.parquet")
    write_tables(read_parts(paths, 12), tmp_path / "parts.parquet")
    assert (tmp_path / "parts.parquet").read_bytes() == (tmp_path / "whole.parquet").read_bytes()


def test_one_row_group_at_a_time_is_asked_for(tmp_path, few_rows):
    asked, written = [], []

    def tables():
        for place in range(4):
            asked.append(place)
            yield make_table(10, "a")

    for piece in telemetry._parquet_pieces(telemetry._cut_row_groups(tables())):
        written.append((len(asked), len(piece)))
    assert {count for count, _ in written} >= {1, 2, 3, 4}  # bytes came between one table and the next


def test_a_damaged_file_among_those_to_gather_is_named(tmp_path):
    write_parquet(make_table(3, "a"), tmp_path / "a.parquet")
    (tmp_path / "b.parquet").write_bytes(b"PAR1 and nothing else")
    with pytest.raises(InputError, match=r"b\.parquet: must be a Parquet table"):
        list(read_parts([tmp_path / "a.parquet", tmp_path / "b.parquet"], 12))
    with pytest.raises(InputError, match=r"c\.parquet: no such file"):
        list(read_parts([tmp_path / "a.parquet", tmp_path / "c.parquet"], 12))
