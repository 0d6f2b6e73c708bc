"""Tables of the page on grids: every key of a grid file and every field of a scenario, from the grid's JSON Schema."""

import re
from typing import Any

from catalogs.entries import load
from catalogs.grids.schema import grid_schema
from reference_pages.markdown import format_table, format_value
from tasks.surface.weather import WEATHERS

UNIT = re.compile(r" \[([^]]+)\]$")
"""End of a description that names the unit."""
HEAD = ("key", "default", "unit", "range", "meaning")


def write_key_table() -> str:
    """Return the table of the keys of a grid file, those that must stand there first, as Markdown."""
    schema = grid_schema()
    required = schema["required"]
    keys = sorted(schema["properties"].items(), key=lambda key: key[0] not in required)
    return format_table(
        HEAD, [_describe(name, key, "required" if name in required else "") for name, key in keys]
    )


def write_field_table() -> str:
    """Return the table of the fields of a scenario, as Markdown."""
    fields = grid_schema()["$defs"]["PartialScenario"]["properties"]
    rows = []
    for field, form in fields.items():
        row = _describe(field, form)
        if field == "weather":
            row[3] = ", ".join(f"`{kind}`" for kind in WEATHERS)
        if field == "precipitation_mm_h":
            limits = load("table of physical limits")
            falling = [(kind.name, kind.rate_limit) for kind in WEATHERS.values() if kind.rate_limit]
            row[3] = ", ".join(f"{name}: 0 to {getattr(limits, limit).value:g}" for name, limit in falling)
        if field == "objects":
            row[3] = "[road users](#road-users)"
        rows.append(row)
    return format_table(HEAD, rows)


def _describe(name: str, key: dict[str, Any], default: str = "") -> list[str]:
    """Return the cells of a key: name, default, unit, range and meaning."""
    description = key.get("description", "")
    unit = UNIT.search(description)
    given = key.get("default")
    if isinstance(given, bool):
        default = f"`{str(given).lower()}`"
    elif isinstance(given, str):
        default = f"`{given}`"
    elif isinstance(given, int | float):
        default = format_value(given)
    return [f"`{name}`", default, unit[1] if unit else "", _format_range(key), UNIT.sub("", description)]


def _format_range(key: dict[str, Any]) -> str:
    """Return which values a key takes: choices, or the least and the largest number."""
    if "enum" in key:
        return ", ".join(f"`{value}`" for value in key["enum"])
    rules = {word: value for part in (key, *key.get("anyOf", ())) for word, value in part.items()}
    above = rules.get("exclusiveMinimum", rules.get("gt"))
    least = f"above {above:g}," if above is not None else format_value(rules.get("minimum"))
    most = format_value(rules.get("maximum"))
    return f"{least} to {most}".strip() if most else f"{least} and more" if least else ""


TABLES = {"grid keys": write_key_table, "scenario fields": write_field_table}
"""Function that writes each table, by the name under which a page asks for it."""
