"""The paper's ablation: which coupling each variant cuts."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

from catalogs.entries import load
from catalogs.names import WeatherName
from catalogs.quantities import CatalogueEntry, Scalar, Text, require_quantity
from catalogs.scenario import Scenario
from catalogs.variants import Variant
from tasks.studies.sensitivity import StudyProtocol
from tasks.surface.weather import DRY, find_weather

ABLATION = "ablation.yaml"
"""Name among the kept inputs of a dataset of ``fixed-mu``."""

Rate = Annotated[Scalar, require_quantity("mm h-1", above=0)]


class AblationEntry(CatalogueEntry):
    """Content of the file; each of ``family_rates`` represents all rates of a kind of weather."""

    family_rates: dict[WeatherName, Rate]
    stop_condition: Text
    pitch_condition: Text
    reference_pitch_rmse: Annotated[Scalar, require_quantity("deg", above=0)]


@dataclass(frozen=True, kw_only=True)
class FamilyWeather:
    """The one weather that stands for all of a kind in ``fixed-mu``.

    Parameters
    ----------
    rates_mm_h : rate by kind of weather [mm/h]
    accumulation_h : time over which snow has fallen [h]
    """

    rates_mm_h: Mapping[str, float]
    accumulation_h: float


def find_families(entry: AblationEntry, study: StudyProtocol) -> FamilyWeather:
    """Return what stands for each kind of weather in ``fixed-mu``.

    Parameters
    ----------
    entry : of the ablation
    study : whose snow has fallen for so long
    """
    rates = {kind: rate.value for kind, rate in entry.family_rates.items()}
    return FamilyWeather(rates_mm_h=rates, accumulation_h=study.snow_accumulation_h)


def cut_coupling(scenario: Scenario, variant: Variant, families: FamilyWeather | None = None) -> Scenario:
    """Return the scenario that a variant drives; the appearance stays that of the original scenario.

    Parameters
    ----------
    scenario : as it is seen
    variant : which coupling is cut
    families : of ``fixed-mu``; None takes the catalogue's
    """
    dry = replace(
        scenario, weather=DRY, precipitation_mm_h=0.0, snow_accumulation_h=0.0, falling=True, visual_range_m=None
    )  # fmt: skip
    if variant == "appearance-only":
        return dry
    if variant == "vertical-only":
        return replace(dry, peak_pressure_mpa=0.0, brake_onset_s=None, brake_onset_m=None)
    if variant in ("full", "no-low-speed-rule"):
        return scenario
    families = families or find_families(load("ablation"), load("sensitivity study")[0])
    if (rate := families.rates_mm_h.get(scenario.weather)) is None:
        return scenario
    hours = families.accumulation_h if find_weather(scenario.weather).accumulates else 0.0
    return replace(scenario, precipitation_mm_h=rate, snow_accumulation_h=hours)
