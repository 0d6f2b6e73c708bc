"""The grid's form as JSON Schema, for editors that complete and check YAML."""

from typing import Any

from catalogs.cameras import FOLDER as CAMERAS
from catalogs.grids import GridFile
from catalogs.scenario import SCENARIO_FIELDS
from catalogs.scenes import BUILT_IN
from catalogs.surfaces import surface_names
from catalogs.vehicles import vehicle_names
from tasks.conventions import CHANNELS_BY_NAME


def grid_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a grid file, from the model that reads it and the table that names columns."""
    schema = GridFile.model_json_schema()
    schema |= {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "muSync grid"}
    for name in SCENARIO_FIELDS:
        channel = CHANNELS_BY_NAME[name]
        unit = f" [{channel.unit}]" if channel.unit else ""
        schema["$defs"]["PartialScenario"]["properties"][name]["description"] = f"{channel.description}{unit}"
    entries = {
        "vehicle": vehicle_names(),
        "surface": surface_names(),
        "camera": sorted(path.stem for path in CAMERAS.glob("*.yaml")),
        "scene": BUILT_IN,
    }
    for name, known in entries.items():
        schema["properties"][name]["examples"] = list(known)
    return schema
