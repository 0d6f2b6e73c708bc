"""The reference case whose conditions are those of a scenario."""

from collections.abc import Sequence
from typing import Any

from catalogs.references import ReferenceCase
from catalogs.scenario import Scenario
from tasks.errors import InputError

SAME_FRICTION, SAME_ONSET = 1e-3, 2e-3
"""Up to where two surface coefficients [1], and two brake onsets [s] or [m], count as equal: both are rounded."""
SAME_NUMBER = 1e-6


def list_differences(case: ReferenceCase, scenario: Scenario, friction: float) -> list[str]:
    """Return the conditions in which a reference case differs from a scenario, each with the case's value first.

    A reference case that brakes holds its speed until then and its pressure to the end; one that does not brake coasts.

    Parameters
    ----------
    case : its conditions
    scenario : controls of a clip
    friction : surface coefficient of the scenario [1]
    """
    both_brake = case.braked and scenario.peak_pressure_mpa > 0
    pairs: dict[str, tuple[Any, Any, float]] = {
        "weather": (case.weather, scenario.weather, 0.0),
        "surface_coefficient": (case.surface_coefficient, friction, SAME_FRICTION),
        "initial_speed_km_h": (case.initial_speed_km_h, scenario.initial_speed_km_h, SAME_NUMBER),
        "peak_pressure_mpa": (
            (case.peak_pressure_mpa or 0.0) if case.braked else 0.0,
            scenario.peak_pressure_mpa,
            SAME_NUMBER,
        ),
        "hold_speed": (case.braked, scenario.hold_speed, 0.0),
        "hazard_height_m": (case.hazard_height_m, scenario.hazard_height_m, SAME_NUMBER),
    }
    if both_brake:
        pairs |= {
            "ramp_s": (case.ramp_s, scenario.ramp_s, SAME_NUMBER),
            "hold_s": (None, scenario.hold_s, 0.0),
            "brake_onset_s": (case.brake_onset_s, scenario.brake_onset_s, SAME_ONSET),
            "brake_onset_m": (
                None if case.brake_onset_s is not None else case.brake_onset_m,
                scenario.brake_onset_m,
                SAME_ONSET,
            ),
        }
    if case.hazard_height_m != 0 or scenario.hazard_height_m != 0:
        pairs |= {
            "hazard_center_m": (case.hazard_center_m, scenario.hazard_center_m, SAME_NUMBER),
            "hazard_length_m": (case.hazard_length_m, scenario.hazard_length_m, SAME_NUMBER),
        }
    return [
        f"{name} ({_write(theirs)} there, {_write(ours)} here)"
        for name, (theirs, ours, room) in pairs.items()
        if not _are_equal(theirs, ours, room)
    ]


def find_case(cases: Sequence[ReferenceCase], scenario: Scenario, friction: float) -> ReferenceCase:
    """Return the only case that has all conditions of a scenario.

    Parameters
    ----------
    cases : of a folder of traces
    scenario : controls of a clip
    friction : surface coefficient of the scenario [1]

    Raises
    ------
    InputError
        If no case has them all, with the nearest one and where it differs; or if several have.
    """
    differing = {case.case: list_differences(case, scenario, friction) for case in cases}
    equal = [case for case in cases if not differing[case.case]]
    # a covered road is as slippery at any rate: of equal drives the one of this rate is meant
    same_rate = [case for case in equal if case.precipitation_mm_h == scenario.precipitation_mm_h]
    equal = same_rate if len(same_rate) == 1 else equal
    if len(equal) == 1:
        return equal[0]
    if equal:
        raise InputError(
            f"several reference cases have these conditions: {', '.join(case.case for case in equal)}; keep one of them"
        )
    nearest = min(differing, key=lambda name: len(differing[name]))
    raise InputError(
        f"no reference case has these conditions; the nearest, {nearest}, differs in {', '.join(differing[nearest])}"
    )


def _are_equal(a: Any, b: Any, room: float) -> bool:
    numbers = all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in (a, b))
    return abs(a - b) <= room if numbers else bool(a == b)


def _write(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
