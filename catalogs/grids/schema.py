"""The grid's form as JSON Schema, for editors that complete and check YAML."""

from typing import Any

from catalogs.entries import entry_names, load
from catalogs.grids import GridFile
from catalogs.scenario import SCENARIO_FIELDS, Scenario, list_ranges
from catalogs.scenes import BUILT_IN
from tasks.conventions import CHANNELS_BY_NAME


def grid_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a grid file, from the model that reads it and the table that names columns."""
    schema = GridFile.model_json_schema()
    schema |= {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "muSync grid"}
    fields, ranges = schema["$defs"]["PartialScenario"]["properties"], list_ranges()
    for name in (*SCENARIO_FIELDS, "scene"):
        channel = CHANNELS_BY_NAME[name]
        unit = f" [{channel.unit}]" if channel.unit else ""
        bounds = zip(("minimum", "maximum"), ranges.get(name, (None, None)), strict=True)
        fields[name] |= {"description": f"{channel.description}{unit}", "default": getattr(Scenario(), name)}
        fields[name] |= {bound: value for bound, value in bounds if value is not None}
    schema["properties"]["duration_s"]["maximum"] = load("table of physical limits").duration.value
    entries = {
        "vehicle": entry_names("vehicle"),
        "surface": entry_names("surface"),
        "camera": entry_names("camera"),
        "scene": BUILT_IN,
    }
    for name, known in entries.items():
        schema["properties"][name]["examples"] = list(known)
    return schema
