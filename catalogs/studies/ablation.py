"""The paper's ablation: which coupling each variant cuts, and where the variants are compared."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from catalogs.names import WeatherName
from catalogs.quantities import CatalogueEntry, Scalar, Text, read_entry, require_quantity
from catalogs.scenario import Scenario
from catalogs.studies import Condition, load_conditions, load_sensitivity_study
from tasks.surface.weather import DRY, find_weather

Variant = Literal["appearance-only", "vertical-only", "fixed-mu", "full"]
VARIANTS: dict[Variant, str] = {
    "appearance-only": "the weather is seen and not felt: dry friction",
    "vertical-only": "the road moves the body, nobody brakes",
    "fixed-mu": "one friction for all rain, one for all snow",
    "full": "nothing is cut",
}
"""Effect of each variant (paper, Section 4.4)."""

Rate = Annotated[Scalar, require_quantity("mm h-1", above=0)]


class AblationEntry(CatalogueEntry):
    """Content of the file; each of ``family_rates`` represents all rates of a kind of weather."""

    family_rates: dict[WeatherName, Rate]
    stop_condition: Text
    pitch_condition: Text
    reference_pitch_rmse: Annotated[Scalar, require_quantity("deg", above=0)]


@dataclass(frozen=True, kw_only=True)
class Ablation:
    """Where the variants are compared.

    Parameters
    ----------
    stops : the braking condition at every rate, dry first, by kind of weather
    pitch : the condition whose pitch is compared
    reference_pitch_rmse_deg : printed distance of the full model from its reference [deg]
    """

    stops: dict[str, tuple[Scenario, ...]]
    pitch: Condition
    reference_pitch_rmse_deg: float


def load_ablation() -> Ablation:
    """The study of the paper's Section 4.4."""
    entry, protocol = _load_entry(), load_sensitivity_study()[0]
    conditions = {condition.name: condition for condition in load_conditions()}
    dry = conditions[entry.stop_condition].scenario
    stops: dict[str, tuple[Scenario, ...]] = {}
    for study in protocol.weathers.values():
        hours = protocol.snow_accumulation_h if find_weather(study.kind).accumulates else 0.0
        rates = np.linspace(0.0, study.highest_rate, study.nominal_rates)[1:]
        stops[study.kind] = (
            dry,
            *(replace(dry, weather=study.kind, precipitation_mm_h=float(rate), snow_accumulation_h=hours)
              for rate in rates),
        )  # fmt: skip
    return Ablation(
        stops=stops,
        pitch=conditions[entry.pitch_condition],
        reference_pitch_rmse_deg=entry.reference_pitch_rmse.value,
    )


def cut_coupling(scenario: Scenario, variant: Variant) -> Scenario:
    """Return the scenario that a variant drives; the appearance stays that of the original scenario.

    Parameters
    ----------
    scenario : as it is seen
    variant : which coupling is cut
    """
    dry = replace(scenario, weather=DRY, precipitation_mm_h=0.0, snow_accumulation_h=0.0)
    if variant == "appearance-only":
        return dry
    if variant == "vertical-only":
        return replace(dry, peak_pressure_mpa=0.0, brake_onset_s=None, brake_onset_m=None)
    rate = _load_entry().family_rates.get(scenario.weather) if variant == "fixed-mu" else None
    if rate is not None:
        accumulates = find_weather(scenario.weather).accumulates
        hours = load_sensitivity_study()[0].snow_accumulation_h if accumulates else 0.0
        return replace(scenario, precipitation_mm_h=rate.value, snow_accumulation_h=hours)
    return scenario


def _load_entry() -> AblationEntry:
    return read_entry(AblationEntry, Path(__file__).with_name("ablation.yaml"), "study")
