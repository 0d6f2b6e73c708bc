"""Tables of the page on checks of measured data: every check, its conditions, and the spans of the channels."""

import re
from collections.abc import Iterator

from catalogs.campaign_checks import CheckEntry, CheckTableEntry
from catalogs.entries import find_entry
from catalogs.quantities import read_entry
from reference_pages.markdown import format_table, format_value

KIND = "table of checks"
SEEN = {
    "clock": "clock of a recording",
    "recording": "recording",
    "times": "times of a signal",
    "signal": "signal",
    "stretch": "signals of a run",
    "run": "run",
    "session": "all runs",
    "recordings": "all recordings",
}
"""What the checks of each group look at."""
FIGURE = re.compile(r"(?<!\{)\{(?!\{)(\w+):?([^}]*)\}")
"""Place of a figure in a sentence."""


def write_check_table() -> str:
    """Return the table of the checks, as Markdown."""
    rows = [
        (
            f"`{name}`",
            SEEN[group],
            check.fault,
            ", ".join(one if isinstance(one, str) else " or ".join(one) for one in check.channels) or "any",
            _write_limits(check),
            next(limit.unit for limit in (check.lowest, check.highest) if limit is not None),
            _write_sentence(check),
            "; ".join(dict.fromkeys(limit.source for limit in (check.lowest, check.highest) if limit is not None)),
        )
        for group, name, check in _list_checks()
    ]  # fmt: skip
    return format_table(("check", "of", "fault", "channels", "limits", "unit", "sentence", "source"), rows)


def write_condition_table() -> str:
    """Return the table of the numbers that the checks need to measure, as Markdown."""
    rows = [
        (f"`{name}`", f"`{key}`", number.value, number.unit, number.what, number.source)
        for _, name, check in _list_checks()
        for key, number in check.conditions.items()
    ]
    return format_table(("check", "number", "value", "unit", "what it is", "source"), rows)


def write_span_table() -> str:
    """Return the table of what the channels of a road car read, as Markdown."""
    spans = _read_entry().spans
    rows = [(f"`{name}`", span.lowest, span.highest, span.unit, span.source) for name, span in spans.items()]
    return format_table(("channel", "lowest", "highest", "unit", "source"), rows)


def _read_entry() -> CheckTableEntry:
    return read_entry(CheckTableEntry, find_entry(KIND), KIND)


def _list_checks() -> Iterator[tuple[str, str, CheckEntry]]:
    """Yield group, name and row of each check, in the order in which they are reported."""
    for group, checks in _read_entry().groups.items():
        yield from ((group, name, check) for name, check in checks.items())


def _write_sentence(check: CheckEntry) -> str:
    """Return the sentence of a check with its limits, and dots for what it measures."""
    limits = {"lowest": check.lowest, "highest": check.highest}

    def fill(figure: re.Match[str]) -> str:
        limit = limits.get(figure[1])
        return "..." if limit is None else format(limit.value, figure[2])

    return FIGURE.sub(fill, check.sentence).replace("{{", "{").replace("}}", "}")


def _write_limits(check: CheckEntry) -> str:
    lowest, highest = (
        None if limit is None else format_value(limit.value) for limit in (check.lowest, check.highest)
    )
    if lowest is None or highest is None:
        return f"at least {lowest}" if highest is None else f"at most {highest}"
    return f"{lowest} to {highest}"


TABLES = {
    "campaign checks": write_check_table,
    "campaign conditions": write_condition_table,
    "campaign spans": write_span_table,
}
"""Function that writes each table, by the name under which a page asks for it."""
