"""Table of the page on FMUs: what goes into the model that another simulator drives."""

from reference_pages.markdown import format_table
from tasks.surface.weather import list_by_code
from tasks.vehicle.model.embedded_variables import INPUTS, EmbeddedVariable


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


TABLES = {"FMU inputs": write_input_table}
"""Function that writes the table, by the name under which a page asks for it."""
