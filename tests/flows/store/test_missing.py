"""NaN of the science is NULL in a table, and NaN of the same bits where science reads it back."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from flows.store.missing import has_nulls, null_missing
from flows.store.telemetry import columns_hash, labelled_table, read_columns, read_table, write_parquet

COLUMNS = {
    "speed": np.array([1.5, np.nan, -0.0]),
    "t_ns": np.array([0, 1, 2]),
    "contact_f": np.array([True, False, True]),
    "T_world_rig": np.array([[1.0, np.nan], [np.nan, np.nan], [3.0, 4.0]]),
}


def test_a_table_holds_null_in_floats_and_in_lists_of_them(tmp_path):
    write_parquet(labelled_table(COLUMNS, {"depth": float("nan"), "label": "a"}), tmp_path / "t.parquet")
    stored = pq.read_table(tmp_path / "t.parquet")
    assert has_nulls(stored.schema) and stored["depth"].null_count == 3
    assert stored["speed"].to_pylist() == [1.5, None, 0.0]
    assert stored["T_world_rig"].to_pylist() == [[1.0, None], None, [3.0, 4.0]]


def test_what_is_read_back_has_the_bits_and_the_hash_of_what_was_written(tmp_path):
    write_parquet(labelled_table(COLUMNS), tmp_path / "t.parquet")
    back = read_columns(tmp_path / "t.parquet", most=9, exact=False)
    assert columns_hash(back, COLUMNS) == columns_hash(COLUMNS, COLUMNS)
    assert {name: values.tobytes() for name, values in back.items()} == {
        name: values.tobytes() for name, values in COLUMNS.items()
    }


def test_null_among_integers_and_truth_values_is_nan_too(tmp_path):
    poses = pa.array([[1.0], None], pa.list_(pa.float64(), 1))
    table = pa.table({"frame": [1, None], "check_passed": [True, None], "poses": poses})
    write_parquet(table, tmp_path / "t.parquet")
    back = read_columns(tmp_path / "t.parquet", most=9, exact=False)
    assert all(np.isnan(values[1]) and values[0] == 1 for values in back.values())


def test_a_table_of_an_older_dataset_is_read_with_null(tmp_path):
    older = pa.table({"speed": COLUMNS["speed"], "label": ["a", "b", "c"]})
    pq.write_table(older, tmp_path / "t.parquet")
    assert read_table(tmp_path / "t.parquet", most=9).column("speed").null_count == 1
    sliced = pa.FixedSizeListArray.from_arrays(pa.array(COLUMNS["T_world_rig"].ravel()), 2).slice(1)
    assert null_missing(pa.table({"m": sliced}))["m"].to_pylist() == [None, [3.0, 4.0]]
