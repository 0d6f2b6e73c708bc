"""The paper's studies: the conditions it drives, its sampling, and the figures it prints."""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from catalogs.grids.blocks import PartialScenario
from catalogs.quantities import (
    CatalogueEntry,
    CatalogueList,
    Number,
    Scalar,
    Table,
    Text,
    require_quantity,
)
from catalogs.scenario import Scenario
from tasks.studies.sensitivity import PrintedFigure, StudyProtocol, WeatherStudy

Count = Annotated[Scalar, require_quantity("1", minimum=0)]


class ProtocolEntry(CatalogueEntry):
    """Braking protocol; the meanings are given by ``StudyProtocol``."""

    initial_speed: Annotated[Scalar, require_quantity("km h-1", above=0)]
    peak_pressure_mpa: Annotated[Scalar, require_quantity("MPa", above=0)]
    ramp_s: Annotated[Scalar, require_quantity("s", minimum=0)]
    coast_deceleration: Annotated[Scalar, require_quantity("m s-2", minimum=0)]
    step_s: Annotated[Scalar, require_quantity("s", above=0)]
    snow_accumulation_h: Annotated[Scalar, require_quantity("h", minimum=0)]
    samples: Count
    percentiles: Annotated[Table, require_quantity("%", minimum=0, maximum=100)]


class WeatherStudyEntry(CatalogueEntry):
    """Values that are varied; `WeatherStudy` gives the meanings."""

    seed: Count
    parameters: tuple[Text, ...]
    highest_rate: Annotated[Scalar, require_quantity("mm h-1", above=0)]
    sampled_rates: Count
    nominal_rates: Count


class PrintedEntry(CatalogueEntry):
    """One published figure."""

    figure: Text
    value: Number
    digits: Annotated[int, Field(strict=True, ge=0)]
    unit: Text


class SensitivityEntry(CatalogueEntry):
    """The whole study."""

    protocol: ProtocolEntry
    rain: WeatherStudyEntry
    snow: WeatherStudyEntry
    printed: tuple[PrintedEntry, ...]

    def build(self) -> tuple[StudyProtocol, tuple[PrintedFigure, ...]]:
        """Protocol and printed figures of the paper's Appendix E."""
        values = self.protocol.numbers()
        values["initial_speed"] /= 3.6
        values["samples"] = int(values["samples"])
        protocol = StudyProtocol(
            **values,
            weathers={
                kind: WeatherStudy(kind=kind, **_make_study(varied))
                for kind, varied in (("rain", self.rain), ("snow", self.snow))
            },
        )
        return protocol, tuple(PrintedFigure(**figure.model_dump()) for figure in self.printed)


class ConditionEntry(PartialScenario):
    """One condition of the paper's Appendix C as the file gives it."""

    name: Text
    split: Text


@dataclass(frozen=True, kw_only=True)
class Condition:
    """One condition of the paper's Appendix C.

    Parameters
    ----------
    name : of the condition
    split : development or held-out
    scenario : its controls
    """

    name: str
    split: str
    scenario: Scenario


class ConditionList(CatalogueList[list[ConditionEntry]]):
    """Content of the file."""

    def build(self) -> tuple[Condition, ...]:
        """The 19 development and 12 held-out conditions of the paper's Appendix C, in its order."""
        return tuple(
            Condition(
                name=row.name,
                split=row.split,
                scenario=Scenario(**row.model_dump(exclude={"name", "split"}, exclude_none=True)),
            )
            for row in self.root
        )


def _make_study(entry: WeatherStudyEntry) -> dict[str, Any]:
    return {
        "seed": int(entry.seed.value),
        "parameters": entry.parameters,
        "highest_rate": entry.highest_rate.value,
        "sampled_rates": int(entry.sampled_rates.value),
        "nominal_rates": int(entry.nominal_rates.value),
    }
