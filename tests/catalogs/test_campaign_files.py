"""Columns of a run's file."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from catalogs.campaign_files import parse_columns


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        (pa.int64(), [1, None, 2**60 + 1]), (pa.int64(), [3, 2**60 + 1]), (pa.float32(), [0.1, float("inf")]),
        (pa.float64(), [None, 2.5]), (pa.float64(), [2.5, -0.0]), (pa.uint8(), []),
    ],
)  # fmt: skip
def test_a_column_is_read_as_arrow_and_pandas_read_it(tmp_path, kind, values):
    table = pa.table({"speed": pa.chunked_array([pa.array(values, kind), pa.array(values, kind)])})
    pq.write_table(table, tmp_path / "run.parquet")
    columns, _ = parse_columns((tmp_path / "run.parquet").read_bytes(), "run", ["speed"])
    expected = np.asarray(table["speed"].to_numpy(), np.float64)
    assert np.array_equal(columns["speed"], expected, equal_nan=True)
    assert columns["speed"].flags.writeable
