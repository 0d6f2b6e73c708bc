"""The grid's form as JSON Schema, for editors that complete and check YAML."""

from typing import Any

from catalogs.entries import entry_names, load
from catalogs.grids import GridFile
from catalogs.scenario import OPTIONAL_FIELDS, SCENARIO_FIELDS, Scenario, list_ranges
from catalogs.scenes import BUILT_IN
from catalogs.street_names import HIGHEST_SEED, KINDS
from tasks.conventions import CHANNELS_BY_NAME


def _describe_streets(schema: dict[str, Any]) -> None:
    """Add the forms in which a grid names streets by kind and seed, one and an axis of them."""
    kind, seed = {"enum": list(KINDS)}, {"type": "integer", "minimum": 0, "maximum": HIGHEST_SEED}
    ends = {"type": "object", "properties": {"min": seed, "max": seed}, "required": ["min", "max"]}
    several = {
        "kind": {"anyOf": [kind, {"type": "array", "items": kind}]},
        "seed": {"anyOf": [seed, {"type": "array", "items": seed}, ends]},
    }
    one, axis = (
        {"type": "object", "required": [key], "additionalProperties": False, "properties": {
            key: {"type": "object", "required": ["kind", "seed"], "additionalProperties": False, "properties": parts}}}
        for key, parts in (("street", {"kind": kind, "seed": seed}), ("streets", several))
    )  # fmt: skip
    for fields in (schema["properties"], schema["$defs"]["PartialScenario"]["properties"]):
        known = {name: fields["scene"].pop(name) for name in ("type", "anyOf", "minLength", "maxLength")
                 if name in fields["scene"]}  # fmt: skip
        fields["scene"]["anyOf"] = [*known.pop("anyOf", [known]), one]
    for block in ("axes", "zip"):
        levels = schema["properties"][block]["additionalProperties"]
        schema["properties"][block]["additionalProperties"] = {"anyOf": [axis, levels]}


def grid_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a grid file, from the model that reads it and the table that names columns."""
    schema = GridFile.model_json_schema()
    schema |= {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "muSync grid"}
    fields, ranges = schema["$defs"]["PartialScenario"]["properties"], list_ranges()
    for name in (*SCENARIO_FIELDS, *OPTIONAL_FIELDS):
        channel = CHANNELS_BY_NAME[name]
        unit = f" [{channel.unit}]" if channel.unit else ""
        bounds = zip(("minimum", "maximum"), ranges.get(name, (None, None)), strict=True)
        fields[name] |= {"description": f"{channel.description}{unit}", "default": getattr(Scenario(), name)}
        fields[name] |= {bound: value for bound, value in bounds if value is not None}
    schema["properties"]["duration_s"]["maximum"] = load("table of physical limits").duration.value
    _describe_streets(schema)
    entries = {
        "vehicle": entry_names("vehicle"),
        "surface": entry_names("surface"),
        "camera": entry_names("camera"),
        "scene": BUILT_IN,
    }
    for name, known in entries.items():
        schema["properties"][name]["examples"] = list(known)
    return schema
