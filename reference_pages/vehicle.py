"""Tables of the vehicle model: effects, numbers that a fit may give it, and inputs of its FMU."""

import re

from catalogs.entries import load
from reference_pages.markdown import format_table
from tasks.surface.weather import list_by_code
from tasks.vehicle.effects.table import EFFECT_TABLE, EFFECT_UNITS, EffectParameter
from tasks.vehicle.model.embedded_variables import INPUTS, EmbeddedVariable

NUMBER = re.compile(r"\{[^}]*\}")
"""Place of a number in a sentence of the library."""
CHANGES = {"added": "", "scaled": "{}, by a share of it", "shifted": "{}, by a sum"}
"""What a number does to fields of a vehicle, by its kind."""


def write_effect_table() -> str:
    """Return the table of the library's effects, as Markdown."""
    rows = [
        (
            f"`{effect.name}`",
            effect.effect_class,
            effect.variable,
            effect.enters,
            NUMBER.sub("...", effect.says),
            ", ".join(f"`{parameter.name}`" for parameter in effect.parameters),
        )
        for effect in load("library of effects")
    ]
    return format_table(("effect", "class", "depends on", "what it adds", "in words", "numbers"), rows)


def write_number_table() -> str:
    """Return the table of the numbers that a fit may give a vehicle, its road or its instruments, as Markdown."""
    rows = [
        (
            f"`{row.name}`",
            row.effect,
            row.unit,
            f"{row.lower:g} to {row.upper:g}",
            row.port.replace("_", " "),
            _describe_change(row),
            row.source,
        )
        for row in EFFECT_TABLE
    ]
    return format_table(("number", "effect", "unit", "bounds", "port", "in a vehicle file", "source"), rows)


def _describe_change(row: EffectParameter) -> str:
    if row.name in EFFECT_UNITS:
        return "under `effects`"
    return CHANGES[row.kind].format(", ".join(f"`{field}`" for field in row.fields))


def write_input_table() -> str:
    """Return the table of inputs and of parameters, which are fixed after the start, as Markdown."""
    rows = [
        (f"`{row.name}`", row.unit, f"{row.start:g}", _write_range(row), row.role, row.description)
        for row in INPUTS
    ]
    return format_table(("name", "unit", "start", "range", "role", "meaning"), rows)


def _write_range(row: EmbeddedVariable) -> str:
    if row.kind == "choice":
        return ", ".join(f"{code} {name}" for code, name in enumerate(list_by_code(), 1) if name)
    ends = [f"{end:g}" if abs(end) < float("inf") else "" for end in (row.minimum, row.maximum)]
    return " to ".join(ends) if all(ends) else f"{ends[0]} and more" if ends[0] else ""


TABLES = {
    "effects": write_effect_table,
    "effect numbers": write_number_table,
    "FMU inputs": write_input_table,
}
"""Function that writes each table, by the name under which a page asks for it."""
