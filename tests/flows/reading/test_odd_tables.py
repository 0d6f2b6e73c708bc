"""Parquet files that a stranger put into a dataset: one sentence from every library's door, no traceback."""

import shutil
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import musync
from flows.reading.query import query_dataset
from flows.store.layout import Layout
from tasks.errors import InputError
from tests.flows.reseal import reseal


@pytest.fixture
def copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


def change(path: Path, alter) -> None:
    table = alter(pq.read_table(path, partitioning=None))
    if table is not None:
        pq.write_table(table, path)


def other_type(table: pa.Table, kind: pa.DataType, values: list) -> pa.Table:
    place = table.schema.get_field_index("speed")
    return table.set_column(place, "speed", pa.array((values * table.num_rows)[: table.num_rows], kind))


REFUSED = {
    "rows missing": lambda t: t.slice(0, t.num_rows - 3),
    "rows shuffled": lambda t: t.take(list(range(t.num_rows))[::-2] + list(range(t.num_rows))[::2]),
    "no rows": lambda t: t.slice(0, 0),
    "a clip twice": lambda t: pa.concat_tables([t.slice(0, 11), t.slice(0, 11)]),
    "no clip_id": lambda t: t.drop_columns(["clip_id"]),
    "no speed": lambda t: t.drop_columns(["speed"]),
    "speed twice": lambda t: t.append_column("speed", t["speed"]),
    "speed as text": lambda t: other_type(t, pa.string(), ["fast"]),
}


@pytest.mark.parametrize("oddity", REFUSED)
def test_frame_tables_that_windows_cannot_be_cut_from_are_refused(copy, oddity):
    change(copy.telemetry / "frames" / "family=snow" / "part-0000.parquet", REFUSED[oddity])
    reseal(copy)
    with pytest.raises(InputError):
        musync.open(copy.root).torch(window=4, columns=["speed"], arrays=[], quarantined=True)


SHOWN = {
    "columns of odd names": lambda t: (
        t.append_column('a"; DROP VIEW clips; --', [[1.5] * t.num_rows])
        .append_column("", [[1] * t.num_rows])
        .append_column("\n\x1b[31m</script>", [[1] * t.num_rows])
    ),
    "a nested column": lambda t: t.append_column("n", pa.array([[[1, 2], [3]]] * t.num_rows)),
    "a large dictionary": lambda t: t.append_column(
        "d", pa.array([f"{i:0200d}" for i in range(t.num_rows)]).dictionary_encode()
    ),
    "an extension type": lambda t: t.append_column(
        "e", pa.ExtensionArray.from_storage(pa.json_(), pa.array(['{"a": 1}'] * t.num_rows))
    ),
    "settings of pandas": lambda t: t.replace_schema_metadata(
        {b"pandas": b'{"index_columns": [[[', b"x": b"\xff"}
    ),
    "no columns of ours": lambda t: pa.table({"x": [1.0]}),
    "no rows": lambda t: t.slice(0, 0),
}


@pytest.mark.parametrize("oddity", SHOWN)
def test_an_odd_table_is_shown_or_refused_with_a_sentence_by_every_library(copy, oddity):
    pytest.importorskip("polars", reason="polars is optional")
    for path in (copy.telemetry / "clips.parquet", *copy.telemetry.glob("frames/*/*.parquet")):
        change(path, SHOWN[oddity])
    reseal(copy)
    data = musync.open(copy.root)
    for table in ("clips", "frames", "verdicts"):
        for reader in (
            lambda table: query_dataset(str(copy.root), f"SELECT * FROM {table}"),
            data.pandas,
            data.polars,
            lambda table: data.telemetry("clips" if table == "verdicts" else table).head(2),
        ):
            try:
                reader(table)
            except InputError as error:
                assert "Traceback" not in str(error)


@pytest.mark.parametrize("content", [b"", b"PAR1" + bytes(100) + b"PAR1"])
def test_a_file_that_is_no_parquet_is_one_sentence(copy, content):
    (copy.telemetry / "clips.parquet").write_bytes(content)
    (copy.telemetry / "frames" / "family=dry" / "part-0000.parquet").write_bytes(content)
    data = musync.open(copy.root)
    for reader in (
        lambda: query_dataset(str(copy.root), "SELECT 1"),
        lambda: data.pandas("clips"),
        lambda: data.telemetry("clips"),
        lambda: data.telemetry("frames"),
        lambda: data.torch(window=4, quarantined=True),
    ):
        with pytest.raises(InputError, match=r"musync (verify|lab repair)"):
            reader()
