"""The law that the grade of the road is that of the route's poses."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.eval.body_agreement import pose_body
from tasks.eval.physics.constants import Constants, Floats, read_grade
from tasks.eval.physics.laws import Law, evaluate_law
from tasks.eval.poses.rigid import invert_pose

SMOOTHING_M = 10.0
"""Length of road over which a grade is taken [m]."""
RISE_M = 1e-3
"""Rise of a pose that the sampling of a grade leaves open [m]."""


def grade_laws(
    ticks: Mapping[str, Floats], frames: Mapping[str, NDArray[Any]], constants: Constants
) -> list[Law | None]:
    """Return the law that the road rises between two frames by the integral of its grade; none without grades.

    The route's height is that of the rig poses without heave and pitch. A grade is a mean over `SMOOTHING_M`, near an
    end of the route one whose middle lies half that length away: where the road bends nearby, that much is left open.

    Parameters
    ----------
    ticks : columns of the tick table
    frames : columns of the frame table
    constants : car and pavement
    """
    if np.isnan(ticks.get("road_grade", np.nan)).all():
        return []
    T = frames["T_world_rig"].reshape(-1, 4, 4)
    body = pose_body(
        frames["heave"], frames["pitch"], constants.car["cg_to_front_axle"], constants.car["cg_height"]
    )
    height = (T @ invert_pose(body))[:, 2, 3]
    station, grade = ticks["station"], read_grade(ticks)
    climbed = np.concatenate([[0.0], np.cumsum(np.diff(station) * (grade[1:] + grade[:-1]) / 2)])
    rows = np.clip(frames["tick"], 0, len(station) - 1)
    gone = np.diff(station)
    bend = np.where(gone > 1e-6, np.abs(np.diff(grade)) / np.maximum(gone, 1e-6), 0.0)
    at, way = station[rows], np.diff(station[rows])
    near = np.searchsorted(station, at[:-1] - SMOOTHING_M), np.searchsorted(station, at[1:] + SMOOTHING_M)
    sharpest = np.array([bend[a:b].max(initial=0.0) for a, b in zip(*near, strict=True)])
    open_rise = sharpest * SMOOTHING_M * (SMOOTHING_M / 12 + way / 2)
    return [
        evaluate_law(
            "road rises by its grade", "frames.T_world_rig ticks.road_grade ticks.station",
            np.diff(height) - np.diff(climbed[rows]), RISE_M + 1e-3 * way + open_rise,
        )
    ]  # fmt: skip
