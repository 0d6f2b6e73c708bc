"""The crate passes roc-validator, and the prov package reads its provenance."""

import json
from importlib.resources import files

import pytest

import musync
from flows.exporting.export import export_dataset
from manifests.canonical import sha256_of_file
from tests.flows.older import make_older


@pytest.fixture(scope="module")
def folder(toy_dataset, tmp_path_factory):
    folder = tmp_path_factory.mktemp("crate") / "out"
    export_dataset(
        str(toy_dataset.root), "ro-crate", out=str(folder), clips=list(musync.open(toy_dataset.root))
    )
    return folder


def test_every_part_is_there_with_its_hash_and_the_run_names_inputs_and_results(folder, toy_dataset):
    graph = {row["@id"]: row for row in json.loads((folder / "ro-crate-metadata.json").read_text())["@graph"]}
    manifest = json.loads(toy_dataset.manifest.read_text())
    for part in graph["./"]["hasPart"]:
        assert sha256_of_file(folder / part["@id"]) == graph[part["@id"]]["sha256"]
    run = graph["#run"]
    assert {row["@id"] for row in run["object"]} == {f"inputs/{name}" for name in manifest["inputs"]}
    for row in run["result"]:
        assert graph[row["@id"]]["sha256"] == manifest["artifacts"][row["@id"]]


def test_a_crate_of_an_older_dataset_keeps_its_bytes_and_says_that_they_hold_nan(
    folder, toy_dataset, tmp_path
):
    older = make_older(toy_dataset, tmp_path / "older")
    export_dataset(
        str(older.root), "ro-crate", out=str(tmp_path / "out"), clips=list(musync.open(older.root))
    )
    name = "telemetry/clips.parquet"
    assert (tmp_path / "out" / name).read_bytes() == (older.root / name).read_bytes()
    told = [
        "hold NaN" in (place / "ro-crate-metadata.json").read_text() for place in (tmp_path / "out", folder)
    ]
    assert told == [True, False]


def test_prov_reads_what_the_run_used_and_made(folder, toy_dataset):
    model = pytest.importorskip("prov.model", reason="pip install prov")
    read = model.ProvDocument.deserialize(str(folder / "prov.json"), format="json")
    manifest = json.loads(toy_dataset.manifest.read_text())
    (run,) = read.get_records(model.ProvActivity)
    assert run.identifier.localpart == f"run-{manifest['run_id']}"
    assert len(list(read.get_records(model.ProvUsage))) == len(manifest["inputs"])
    made = {str(use.args[0].localpart) for use in read.get_records(model.ProvGeneration)}
    assert made == {name for name in manifest["artifacts"] if name.endswith(".parquet")}


def test_roc_validator_finds_nothing_that_the_profile_requires(folder, monkeypatch):
    services = pytest.importorskip("rocrate_validator.services", reason="pip install roc-validator rocrate")
    pytest.importorskip("rocrate")
    from rocrate_validator import models
    from rocrate_validator.utils import document_loader

    # the context as the rocrate package holds it, so that the test needs no network
    context = json.loads((files("rocrate") / "data" / "ro-crate.jsonld").read_text())
    monkeypatch.setattr(document_loader, "_fetch_json_ld", lambda url: context)
    settings = services.ValidationSettings(
        rocrate_uri=str(folder),
        profile_identifier="ro-crate-1.1",
        requirement_severity=models.Severity.REQUIRED,
    )
    result = services.validate(settings)
    found = [(issue.check.identifier, issue.message) for issue in result.get_issues()]
    # two checks ask the network whether the context of the specification is there
    assert [
        (check, message)
        for check, message in found
        if "w3id.org" not in message and "/context" not in message
    ] == []
