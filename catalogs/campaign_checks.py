"""The table of checks of measured data."""

from math import inf

from pydantic import Field

from catalogs.quantities import CatalogueEntry, Number, Scalar, Text
from tasks.campaign import run_checks, session_checks, signal_checks
from tasks.campaign.checks import Check, CheckTable, Fault

MEASURES = signal_checks.MEASURES | run_checks.MEASURES | session_checks.MEASURES
"""Functions by the name of their check."""


class SpanEntry(CatalogueEntry):
    """What a channel of a road car reads."""

    lowest: Number
    highest: Number
    unit: Text
    source: Text


class ConditionEntry(Scalar):
    """A number that a measurement needs, and what it is."""

    what: Text


class CheckEntry(CatalogueEntry):
    """A row of the table; the meanings are given by ``Check``."""

    fault: Fault
    channels: tuple[Text | tuple[Text, ...], ...] = ()
    lowest: Scalar | None = None
    highest: Scalar | None = None
    conditions: dict[str, ConditionEntry] = Field(default_factory=dict)
    sentence: Text
    unless: tuple[Text, ...] = ()

    def row(self, name: str) -> Check:
        """The same for the science floor."""
        return Check(
            name=name,
            fault=self.fault,
            channels=tuple((one,) if isinstance(one, str) else one for one in self.channels),
            measure=MEASURES[name],
            conditions={key: number.value for key, number in self.conditions.items()},
            lowest=-inf if self.lowest is None else self.lowest.value,
            highest=inf if self.highest is None else self.highest.value,
            sentence=self.sentence,
            unless=self.unless,
        )


class CheckTableEntry(CatalogueEntry):
    """Content of the file; the meanings are given by ``CheckTable``."""

    spans: dict[str, SpanEntry]
    clock: dict[str, CheckEntry]
    recording: dict[str, CheckEntry]
    times: dict[str, CheckEntry]
    signal: dict[str, CheckEntry]
    stretch: dict[str, CheckEntry]
    run: dict[str, CheckEntry]
    session: dict[str, CheckEntry]
    recordings: dict[str, CheckEntry]

    @property
    def groups(self) -> dict[str, dict[str, CheckEntry]]:
        """The rows by what they look at, in the order of the file."""
        return {name: rows for name, rows in self if name != "spans"}

    def build(self) -> CheckTable:
        """Return the checks for the science floor."""
        groups = {
            group: tuple(row.row(name) for name, row in rows.items()) for group, rows in self.groups.items()
        }
        spans = {name: (span.lowest, span.highest) for name, span in self.spans.items()}
        return CheckTable(spans=spans, **groups)
