"""Where a scenario lies among the conditions that the calibration was fitted on."""

from typing import Annotated, Literal, get_args

from pydantic import Field, model_validator

from catalogs.names import WeatherName
from catalogs.quantities import CatalogueEntry, Number, Text
from catalogs.scenario import Scenario
from tasks.surface.weather import WEATHERS

CalibrationTag = Literal["in-grid", "interpolated", "off-grid", "beyond-calibration"]
CALIBRATION_TAGS: tuple[CalibrationTag, ...] = get_args(CalibrationTag)


class DrivenLevels(CatalogueEntry):
    """Levels of one control that were driven, and the range that they span with the paper's checks, if they do."""

    levels: Annotated[tuple[Number, ...], Field(min_length=1)]
    range: tuple[Number, Number] | None = None
    unit: Text
    source: Text

    @model_validator(mode="after")
    def _levels_lie_in_the_range(self) -> "DrivenLevels":
        outside = [level for level in self.levels if self.leaves_range(level)]
        if outside:
            raise ValueError(f"levels must lie in the range; these do not: {outside}")
        return self

    def leaves_range(self, value: float) -> bool:
        """Whether the value lies outside every driven value."""
        return self.range is not None and not self.range[0] <= value <= self.range[1]


class CalibratedRange(CatalogueEntry):
    """Ranges of the data on which the calibration was fitted."""

    rate: dict[WeatherName, DrivenLevels]
    snow_accumulation: DrivenLevels
    speed_on_flat_road: DrivenLevels
    speed_on_road_feature: DrivenLevels
    peak_pressure: DrivenLevels
    ramp: DrivenLevels
    brake_onset: DrivenLevels
    hump_height: DrivenLevels
    hump_length: DrivenLevels
    depression_height: DrivenLevels
    depression_length: DrivenLevels


def calibration_tag(scenario: Scenario, driven: CalibratedRange) -> CalibrationTag:
    """Where the scenario lies, by the words of the paper's Appendix C.

    Parameters
    ----------
    scenario : its controls
    driven : what the calibration was fitted on

    Returns
    -------
    ``beyond-calibration`` where a control leaves the range of what was driven, or no run was driven in its kind of
    weather; else ``off-grid`` where one other than
    the weather's rate is at no driven level; else ``interpolated`` where the rate lies between levels of its own
    weather; else ``in-grid``
    """
    s = scenario
    others = [(s.peak_pressure_mpa, driven.peak_pressure)]
    others.append(
        (
            s.initial_speed_km_h,
            driven.speed_on_road_feature if s.hazard_height_m else driven.speed_on_flat_road,
        )
    )
    unlike = False
    if s.peak_pressure_mpa > 0:
        unlike = s.brake_onset_s is None or s.hold_s is not None
        others.append((s.ramp_s, driven.ramp))
        if s.brake_onset_s is not None:
            others.append((s.brake_onset_s, driven.brake_onset))
    if s.hazard_height_m > 0:
        others += [(s.hazard_height_m, driven.hump_height), (s.hazard_length_m, driven.hump_length)]
    if s.hazard_height_m < 0:
        others += [
            (s.hazard_height_m, driven.depression_height),
            (s.hazard_length_m, driven.depression_length),
        ]
    kind = WEATHERS.get(s.weather)
    if kind and kind.name not in driven.rate:
        return "beyond-calibration"
    rate = [(s.precipitation_mm_h, driven.rate[kind.name])] if kind else []
    if kind and kind.accumulates:
        others.append((s.snow_accumulation_h, driven.snow_accumulation))
    if any(control.leaves_range(value) for value, control in (*others, *rate)):
        return "beyond-calibration"
    if unlike or any(value not in control.levels for value, control in others):
        return "off-grid"
    return "interpolated" if any(value not in control.levels for value, control in rate) else "in-grid"
