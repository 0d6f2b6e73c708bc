"""mlcroissant accepts the description and reads the tables through it, each with its recorded hash."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

import musync
from flows.exporting.export import export_dataset
from manifests.canonical import sha256_of_file
from tasks.errors import InputError
from tests.flows.exporting.conftest import BRAKING
from tests.flows.older import make_older


@pytest.fixture(scope="module")
def folder(toy_dataset, tmp_path_factory):
    folder = tmp_path_factory.mktemp("croissant") / "out"
    export_dataset(
        str(toy_dataset.root), "croissant", out=str(folder), clips=list(musync.open(toy_dataset.root))
    )
    return folder


def test_every_file_has_its_hash_and_every_column_its_unit(folder, toy_dataset):
    content = json.loads((folder / "croissant.json").read_text())
    assert {
        sha256_of_file(folder / row["contentUrl"]) == row["sha256"] for row in content["distribution"]
    } == {True}
    fields = {field["name"]: field for records in content["recordSet"] for field in records["field"]}
    assert fields["ticks-dry-0000/pitch"]["description"].endswith("nose-down positive [rad]")
    assert fields["ticks-dry-0000/contact_f"]["dataType"] == "sc:Boolean"


def test_tables_of_an_older_dataset_hold_null_where_these_hold_nan(toy_dataset, tmp_path):
    older = make_older(toy_dataset, tmp_path / "older")
    export_dataset(
        str(older.root), "croissant", out=str(tmp_path / "out"), clips=list(musync.open(older.root))
    )
    names = [path.relative_to(older.root) for path in sorted(older.telemetry.rglob("*.parquet"))]
    given, whole = ([pq.read_table(place / name, partitioning=None) for name in names]
                          for place in (tmp_path / "out", toy_dataset.root))  # fmt: skip
    nulls = [[column.null_count for column in table.columns] for table in given]
    assert (
        nulls == [[column.null_count for column in table.columns] for table in whole]
        and sum(map(sum, nulls)) > 0
    )
    content = json.loads((tmp_path / "out" / "croissant.json").read_text())
    assert {
        sha256_of_file(tmp_path / "out" / row["@id"]) == row["sha256"] for row in content["distribution"]
    } == {True}


def test_some_of_the_clips_are_refused(toy_dataset, tmp_path):
    with pytest.raises(InputError, match="takes all 4 clips; 1 are asked for"):
        export_dataset(str(toy_dataset.root), "croissant", out=str(tmp_path / "out"), clips=[BRAKING])
    assert not list(tmp_path.iterdir())


def test_mlcroissant_accepts_it_and_reads_every_tick(folder, stored):
    mlcroissant = pytest.importorskip("mlcroissant", reason="pip install mlcroissant")
    read = mlcroissant.Dataset(jsonld=str(folder / "croissant.json"))
    assert not read.metadata.ctx.issues.errors
    rows = [row for row in read.records("ticks-dry-0000") if row["ticks-dry-0000/label"] == BRAKING.encode()]
    for name in ("t_ns", "speed", "pitch", "braking_slip_f"):
        there = [row[f"ticks-dry-0000/{name}"] for row in rows]
        np.testing.assert_array_equal(there, stored[BRAKING].ticks[name], name)
