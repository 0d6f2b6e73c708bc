"""Croissant: the dataset's tables with metadata that machine-learning tools and dataset search read.

``croissant.json`` (JSON-LD, Croissant 1.0) describes the Parquet files of ``telemetry/``, copied as they are (those of
an older dataset with NULL for NaN): SHA-256 of each, and each column with its meaning and unit as our schema has them.
Names, units and signs are ours (ISO 8855,
pitch positive nose-down). A record set is one file: ``clips``, ``pairs``, ``ticks-WEATHER-0000``,
``frames-WEATHER-0000``. Columns that hold lists (``T_world_rig``) are in the files and not in the record sets. Pictures
are not exported.

Format: http://mlcommons.org/croissant/1.0
"""

from pathlib import Path, PurePosixPath
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from catalogs.variants import warn_of_variant
from flows.exporting.dataset import ExportedDataset
from flows.store.layout import write_json
from flows.store.telemetry import copy_table
from manifests.canonical import sha256_of_file
from manifests.manifest import describe_scenes
from tasks.conventions import CHANNELS_BY_NAME

CONFORMS_TO = "http://mlcommons.org/croissant/1.0"
PARQUET = "application/x-parquet"
CONTEXT: dict[str, Any] = {
    "@language": "en", "@vocab": "https://schema.org/", "sc": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/", "rai": "http://mlcommons.org/croissant/RAI/",
    "dct": "http://purl.org/dc/terms/", "citeAs": "cr:citeAs", "column": "cr:column", "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"}, "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "examples": {"@id": "cr:examples", "@type": "@json"}, "extract": "cr:extract", "field": "cr:field",
    "fileProperty": "cr:fileProperty", "fileObject": "cr:fileObject", "fileSet": "cr:fileSet", "format": "cr:format",
    "includes": "cr:includes", "isLiveDataset": "cr:isLiveDataset", "jsonPath": "cr:jsonPath", "key": "cr:key",
    "md5": "cr:md5", "parentField": "cr:parentField", "path": "cr:path", "recordSet": "cr:recordSet",
    "references": "cr:references", "regex": "cr:regex", "repeated": "cr:repeated", "replace": "cr:replace",
    "equivalentProperty": "cr:equivalentProperty", "samplingRate": "cr:samplingRate",
    "separator": "cr:separator", "source": "cr:source", "subField": "cr:subField", "transform": "cr:transform",
}  # fmt: skip
"""Prefixes and terms of the specification's own context, which the format asks to be written out."""


def write_croissant(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``croissant.json`` and ``telemetry/``.

    Parameters
    ----------
    dataset : with frames or without, all of its clips: the files are copied whole
    folder : empty
    """
    tables = sorted(name for name in dataset.manifest["artifacts"] if name.endswith(".parquet"))
    files, records = [], []
    for name in tables:
        source, target = dataset.layout.root / name, folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        copy_table(source, target)
        files.append(_describe_file(name, target))
        records.append(_describe_records(name, pq.read_schema(target)))
    for _ in dataset:  # their rows are in the tables already
        pass
    write_json(
        folder / "croissant.json", _describe_dataset(dataset) | {"distribution": files, "recordSet": records}
    )


def _describe_dataset(dataset: ExportedDataset) -> dict[str, Any]:
    facts = dataset.plan.settings
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "name": dataset.name,
        "description": f"Telemetry of {len(dataset)} simulated drives on {describe_scenes(dataset.manifest)} with"
        f" {facts.vehicle}, in step with rendered video; made by muSync. {warn_of_variant(facts.variant)}".rstrip(),
        "conformsTo": CONFORMS_TO,
        "identifier": dataset.manifest["run_id"],
        "version": "1.0.0",
        "isLiveDataset": False,
    }


def _describe_file(name: str, path: Path) -> dict[str, Any]:
    return {
        "@type": "cr:FileObject",
        "@id": name,
        "name": name,
        "contentUrl": name,
        "contentSize": f"{path.stat().st_size} B",
        "encodingFormat": PARQUET,
        "sha256": sha256_of_file(path),
    }


def _describe_records(name: str, schema: pa.Schema) -> dict[str, Any]:
    parts = PurePosixPath(name).relative_to("telemetry").with_suffix("").parts
    own = "-".join(part.removeprefix("family=").removeprefix("part-") for part in parts)
    fields = [
        {
            "@type": "cr:Field",
            "@id": f"{own}/{column.name}",
            "name": f"{own}/{column.name}",
            "description": _describe_column(column.name),
            "dataType": kind,
            "source": {"fileObject": {"@id": name}, "extract": {"column": column.name}},
        }
        for column in schema
        if (kind := _data_type(column.type)) is not None
    ]
    return {"@type": "cr:RecordSet", "@id": own, "name": own, "field": fields}


def _describe_column(name: str) -> str:
    channel = CHANNELS_BY_NAME.get(name)
    return name if channel is None else f"{channel.description} [{channel.unit or 'no unit'}]"


def _data_type(kind: pa.DataType) -> str | None:
    """Croissant's name of a type; None for lists."""
    if pa.types.is_dictionary(kind) or pa.types.is_string(kind):
        return "sc:Text"
    if pa.types.is_boolean(kind):
        return "sc:Boolean"
    if pa.types.is_integer(kind):
        return "sc:Integer"
    return "sc:Float" if pa.types.is_floating(kind) else None
