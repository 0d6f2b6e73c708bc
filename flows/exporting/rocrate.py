"""RO-Crate 1.1 with W3C PROV: a dataset's record, its inputs and its tables, for archives and audits.

``manifest.json``, ``plan.json``, ``inputs/`` and ``telemetry/`` are copied as they are, so that recorded hashes hold;
``ro-crate-metadata.json`` (JSON-LD) names each file with size and SHA-256 and says that the run of muSync made the
tables from the inputs; ``prov.json`` (PROV-JSON) says the same in PROV's words: entities, one activity, one software
agent. The date is that of the export. Pictures are not exported. Tables of an older dataset hold NaN where others hold
NULL, and the crate's description says so.

Formats: https://www.researchobject.org/ro-crate/1.1 and https://www.w3.org/Submission/prov-json
"""

import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from catalogs.variants import warn_of_variant
from flows.exporting.dataset import ExportedDataset
from flows.store.layout import write_json
from flows.store.missing import has_nulls
from manifests.canonical import sha256_of_file
from manifests.manifest import describe_scenes

METADATA = "ro-crate-metadata.json"
VERSION = "https://w3id.org/ro/crate/1.1"
SOFTWARE = "#musync"
KINDS = {
    ".parquet": "application/vnd.apache.parquet",
    ".json": "application/json",
    ".yaml": "application/yaml",
}


def write_rocrate(dataset: ExportedDataset, folder: Path) -> None:
    """Write the crate.

    Parameters
    ----------
    dataset : with frames or without, all of its clips
    folder : empty
    """
    inputs = sorted(f"inputs/{name}" for name in dataset.manifest["inputs"])
    tables = sorted(name for name in dataset.manifest["artifacts"] if name.endswith(".parquet"))
    names = ["manifest.json", "plan.json", *inputs, *tables]
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(dataset.layout.root / name, folder / name)
    write_json(folder / "prov.json", describe_provenance(dataset, inputs, tables))
    files = [_describe_file(folder, name) for name in (*names, "prov.json")]
    content = {
        "@context": f"{VERSION}/context",
        "@graph": [
            _describe_itself(),
            _describe_root(dataset, names, tables),
            *files,
            *_describe_run(dataset, inputs, tables),
        ],
    }
    write_json(folder / METADATA, content)
    for _ in dataset:  # all rows of the clips are in the tables
        pass


def describe_provenance(dataset: ExportedDataset, inputs: list[str], tables: list[str]) -> dict[str, Any]:
    """Return PROV-JSON: which files the run used, and which it made.

    Parameters
    ----------
    dataset : that was made
    inputs, tables : names of files
    """
    run, agent = f"musync:run-{dataset.manifest['run_id']}", "musync:software"
    hashes = {f"inputs/{name}": digest for name, digest in dataset.manifest["inputs"].items()}
    hashes |= dataset.manifest["artifacts"]
    return {
        "prefix": {"musync": "urn:musync:"},
        "entity": {f"musync:{name}": {"musync:sha256": hashes[name]} for name in (*inputs, *tables)},
        "activity": {run: {"prov:type": "musync generate", "musync:backend": dataset.manifest["backend"]}},
        "agent": {
            agent: {
                "prov:type": {"$": "prov:SoftwareAgent", "type": "prov:QUALIFIED_NAME"},
                **_describe_code(dataset),
            }
        },
        "used": {
            f"_:u{k}": {"prov:activity": run, "prov:entity": f"musync:{name}"}
            for k, name in enumerate(inputs)
        },
        "wasGeneratedBy": {
            f"_:g{k}": {"prov:entity": f"musync:{name}", "prov:activity": run}
            for k, name in enumerate(tables)
        },
        "wasAssociatedWith": {"_:a": {"prov:activity": run, "prov:agent": agent}},
    }


def _describe_code(dataset: ExportedDataset) -> dict[str, str]:
    return {f"musync:{key}": str(value) for key, value in dataset.manifest["made_with"]["code"].items()}


def _describe_itself() -> dict[str, Any]:
    return {
        "@id": METADATA,
        "@type": "CreativeWork",
        "about": {"@id": "./"},
        "conformsTo": {"@id": VERSION},
    }


def _describe_root(dataset: ExportedDataset, names: list[str], tables: list[str]) -> dict[str, Any]:
    facts = dataset.plan.settings
    holds_nan = not all(has_nulls(pq.read_schema(dataset.layout.root / name)) for name in tables)
    absent = "The tables hold NaN where a value is not represented. " if holds_nan else ""
    return {
        "@id": "./",
        "@type": "Dataset",
        "name": f"muSync dataset {dataset.name}",
        "description": f"{len(dataset)} simulated drives on {describe_scenes(dataset.manifest)} with"
        f" {facts.vehicle}: telemetry and record."
        f" {absent}{warn_of_variant(facts.variant)}".rstrip(),
        "identifier": dataset.manifest["run_id"],
        "datePublished": datetime.now(UTC).date().isoformat(),
        "license": "not stated",
        "hasPart": [{"@id": name} for name in (*names, "prov.json")],
        "mentions": [{"@id": "#run"}],
    }


def _describe_file(folder: Path, name: str) -> dict[str, Any]:
    path = folder / name
    return {
        "@id": name,
        "@type": "File",
        "name": name,
        "encodingFormat": KINDS.get(path.suffix, "text/plain"),
        "contentSize": str(path.stat().st_size),
        "sha256": sha256_of_file(path),
    }


def _describe_run(dataset: ExportedDataset, inputs: list[str], tables: list[str]) -> list[dict[str, Any]]:
    code = dataset.manifest["made_with"]["code"]
    return [
        {
            "@id": "#run",
            "@type": "CreateAction",
            "name": f"musync generate, run {dataset.manifest['run_id']}",
            "instrument": {"@id": SOFTWARE},
            "object": [{"@id": name} for name in inputs],
            "result": [{"@id": name} for name in tables],
        },
        {
            "@id": SOFTWARE,
            "@type": "SoftwareApplication",
            "name": "muSync",
            "softwareVersion": " ".join(f"{key} {value}" for key, value in sorted(code.items())),
        },
    ]
