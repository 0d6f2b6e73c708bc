"""Tables of the page on a verdict's rules: numbers of the decision, and sizes that matter."""

import re
from inspect import getdoc

import yaml

from catalogs.entries import find_entry
from reference_pages.markdown import format_table
from tasks.identification.decision.forms import PORT_STEP, SCANNED
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.ports import PORT_UNITS
from tasks.vehicle.effects.table import PARAMETERS

ENTRY = re.compile(r"^(\w+) : (.+(?:\n    .+)*)", flags=re.M)
"""A number in a docstring, with its meaning."""
UNIT = re.compile(r" \[[^]]*\]$")


def read_meanings(rules: type) -> dict[str, str]:
    """Return what each number of a class means, as its docstring says, without the unit.

    Parameters
    ----------
    rules : class whose docstring has a line a number
    """
    described = {name: " ".join(text.split()) for name, text in ENTRY.findall(getdoc(rules) or "")}
    return {name: UNIT.sub("", text) for name, text in described.items()}


def write_decision_table() -> str:
    """Return the table of the numbers by which odds become a verdict, as Markdown."""
    meanings = read_meanings(DecisionRules)
    numbers = yaml.safe_load(find_entry("set of decision rules").read_text(encoding="utf-8"))
    rows = [(f"`{n}`", e["value"], e["unit"], meanings[n], e["source"]) for n, e in numbers.items()]
    return format_table(("number", "value", "unit", "what it is", "reason"), rows)


def write_size_table() -> str:
    """Return the table of the smallest size that matters of every effect, as Markdown."""
    rows = []
    for effect in yaml.safe_load(find_entry("library of effects").read_text(encoding="utf-8")):
        first = effect["parameters"][0]
        cells = (f"`{effect['name']}`", f"`{first}`", effect["matters"], PARAMETERS[first].unit)
        rows.append((*cells, effect["because"]))
    return format_table(("effect", "number", "size that matters", "unit", "reason"), rows)


def write_form_table() -> str:
    """Return the table of the forms that may be named, with the size that matters at their port, as Markdown."""
    rows = [
        (f"`{port}`", ", ".join(f"`{name}`" for name in variables), PORT_STEP[port], PORT_UNITS[port])
        for port, variables in SCANNED.items()
    ]
    return format_table(("port", "variables", "size that matters", "unit"), rows)


TABLES = {
    "decision rules": write_decision_table,
    "sizes that matter": write_size_table,
    "sizes of forms": write_form_table,
}
"""Function that writes each table, by the name under which a page asks for it."""
