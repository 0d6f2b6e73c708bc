"""Evaluation protocols as data: windows, thresholds and selection rules with their sources."""

from typing import Annotated

from pydantic import Field, model_validator

from catalogs.quantities import CatalogueEntry, Number, Scalar, Table, Text, require_quantity
from studies.measured_drives.events import Protocol, Rule
from studies.measured_drives.selection import QUANTITIES

Window = Annotated[Table, require_quantity("s")]
Count = Annotated[Scalar, require_quantity("1", minimum=0)]


class RuleEntry(CatalogueEntry):
    """One selection rule; the meanings are given by ``Rule``."""

    name: Text
    criterion: Text
    at_least: Number | None = None
    at_most: Number | None = None
    unit: Text
    paper_fails: Annotated[int, Field(strict=True, ge=0)] | None = None
    note: str = ""

    @model_validator(mode="after")
    def _is_one_rule(self) -> "RuleEntry":
        problems = []
        if (self.at_least is None) == (self.at_most is None):
            problems.append("needs exactly one of at_least and at_most")
        if self.name not in QUANTITIES:
            problems.append(f"measures {self.name}, which is unknown; there are: {', '.join(QUANTITIES)}")
        elif self.unit != QUANTITIES[self.name].unit:
            problems.append(f"must be in {QUANTITIES[self.name].unit}; it is in {self.unit}")
        if problems:
            raise ValueError("; ".join(f"rule {self.name} {problem}" for problem in problems))
        return self


class ProtocolEntry(CatalogueEntry):
    """Content of a protocol file; `Protocol` gives the meanings."""

    onset_pressure: Annotated[Scalar, require_quantity("MPa", above=0)]
    merge_gap: Annotated[Scalar, require_quantity("s", minimum=0)]
    analysis_window: Window
    baseline_window: Window
    evaluation_window: Window
    quality_window: Window
    fixed_damping_ratio: Annotated[Scalar, require_quantity("1", above=0)]
    paper_candidates: Count | None = None
    paper_retained: Count | None = None
    rules: Annotated[tuple[RuleEntry, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _windows_are_intervals(self) -> "ProtocolEntry":
        problems = []
        for name in ("analysis_window", "baseline_window", "evaluation_window", "quality_window"):
            window = getattr(self, name).value
            if len(window) != 2 or window[0] >= window[1]:
                problems.append(f"{name} must be its start and its later end; it is {list(window)}")
        if problems:
            raise ValueError("; ".join(problems))
        return self

    def build(self) -> Protocol:
        """The protocol itself."""

        def pair(window: Table) -> tuple[float, float]:
            return window.value[0], window.value[1]

        return Protocol(
            onset_pressure=self.onset_pressure.value,
            merge_gap=self.merge_gap.value,
            analysis=pair(self.analysis_window),
            baseline=pair(self.baseline_window),
            evaluation=pair(self.evaluation_window),
            quality=pair(self.quality_window),
            fixed_damping_ratio=self.fixed_damping_ratio.value,
            rules=tuple(
                Rule(
                    name=rule.name,
                    criterion=rule.criterion,
                    limit=rule.at_least if rule.at_least is not None else rule.at_most or 0.0,
                    is_minimum=rule.at_least is not None,
                    paper_fails=rule.paper_fails,
                )
                for rule in self.rules
            ),
        )
