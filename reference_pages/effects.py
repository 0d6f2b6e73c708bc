"""Tables of the page on effects: those that ``close-loop`` may name, and the numbers that any fit may give."""

import re

from catalogs.entries import load
from reference_pages.markdown import format_table
from tasks.vehicle.effects.table import EFFECT_TABLE, EFFECT_UNITS, EffectParameter

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


TABLES = {"effects": write_effect_table, "effect numbers": write_number_table}
"""Function that writes each table, by the name under which a page asks for it."""
