"""mlcroissant accepts the description and reads the tables through it, each with its recorded hash."""

import json

import numpy as np
import pytest

import musync
from flows.exporting.export import export_dataset
from manifests.canonical import sha256_of_file
from tasks.errors import InputError
from tests.flows.exporting.conftest import BRAKING


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
