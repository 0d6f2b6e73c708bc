"""Laws of brake pressure and road height as the scenario commands them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tasks.eval.physics.constants import Constants, Floats, pressure_at, raised_cosine
from tasks.eval.physics.half_step import find_brake_onset, pressure_shape
from tasks.eval.physics.laws import Law, evaluate_law

AT_A_STEP = 1e-9
"""Time about a tick within which a command that jumps has either value [s]."""

LAST_PASS = 2e-6
"""Way between the last two passes over a road feature [m]."""

LITERAL_PASS = 1e-2
"""The same where the published steps are taken literally: they swing about a stop, and five passes are all [m]."""


def command_laws(ticks: Mapping[str, Floats], facts: Mapping[str, Any]) -> list[Law | None]:
    """Return the law of the brake pressure as the scenario commands it.

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    """
    time: Floats = 1e-3 * np.arange(len(ticks["speed"]), dtype=np.float64)
    onset = find_brake_onset(ticks, facts)
    peak, ramp, hold, lasting = pressure_shape(facts)
    pressure = ticks["brake_pressure_mpa"]
    around = [
        pressure_at(time - onset + late, peak, ramp, hold, lasting) for late in (-AT_A_STEP, 0.0, AT_A_STEP)
    ]
    wanted = np.clip(pressure, np.min(around, axis=0), np.max(around, axis=0))
    steepest = peak / max(ramp, 1e-3)
    by_place = facts["brake_onset_m"] is not None and np.isfinite(facts["brake_onset_m"])
    slack = 1e-9 + (steepest * 1e-5 if by_place else 0.0)
    release = "" if np.isinf(hold) else " clips.hold_s clips.release_s"
    columns = f"brake_pressure_mpa clips.peak_pressure_mpa clips.ramp_s clips.brake_onset_s{release}"
    if by_place:
        columns = columns.replace("brake_onset_s", "brake_onset_m")
    return [evaluate_law("brake pressure as commanded", columns, pressure - wanted, slack)]


def road_height_laws(
    ticks: Mapping[str, Floats], facts: Mapping[str, Any], constants: Constants
) -> list[Law | None]:
    """Return the laws of the road heights under both axles.

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    constants : car and pavement
    """
    s, v = ticks["station"], ticks["speed"]
    laws = []
    hump = facts["hazard_center_m"], facts["hazard_length_m"], facts["hazard_height_m"]
    moves = v > 0
    way = LITERAL_PASS if constants.steady_limit == 0 else LAST_PASS
    for axle, behind in (("f", 0.0), ("r", constants.wheelbase)):
        height, before, after = (raised_cosine(s - behind + shift, *hump)[0] for shift in (0.0, -way, way))
        apart = np.maximum(np.abs(before - height), np.abs(after - height))
        laws.append(
            evaluate_law(f"road height as commanded, {axle}", f"road_height_{axle} station clips.hazard_height_m"
                " clips.hazard_center_m clips.hazard_length_m",
                (ticks[f"road_height_{axle}"] - height)[moves], (apart + 1e-9)[moves])
        )  # fmt: skip
    return laws
