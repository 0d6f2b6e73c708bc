"""Speeds that fall faster than the tyres of a road car allow: their unit is another one than the map says."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.channels import SPEED_UNITS, UNITS
from tasks.campaign.clocks import measure_fall
from tasks.campaign.run_names import list_names


def find_deceleration_problems(
    runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float, limit: float, unit: str = "m/s"
) -> list[str]:
    """Return the problem of a speed that falls faster than a road car's in some runs.

    Parameters
    ----------
    runs : channels of each run by name, each float64 [N], in campaign units
    interval : of their clock [s]
    limit : deceleration that no road car exceeds [m/s^2]
    unit : in which the speed was taken to be
    """
    falls = {
        run: measure_fall(interval * np.arange(len(columns["speed"]), dtype=np.float64), columns["speed"])
        for run, columns in runs.items()
        if "speed" in columns
    }
    wrong = {run: fall for run, fall in falls.items() if fall is not None and fall > limit}
    if not wrong:
        return []
    likely = [other for other in SPEED_UNITS if UNITS[other][1] < UNITS[unit][1]]
    hint = f"; taken as {unit}, it looks like {likely[0]}" if likely else ""
    return [
        f"channel speed falls by {max(wrong.values()):.3g} m/s^2 in {list_names(list(wrong))}, which the tyres of no"
        f" road car give (limit {limit:g}): correct its unit or scale{hint}"
    ]
