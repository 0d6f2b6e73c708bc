"""Laws of the rig on its route: of its pose, which heave and pitch move (paper, Eq. camera_pose), and of the grade."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.physics_judge.laws.constants import Constants, Floats, read_grade
from studies.physics_judge.laws.law import Law, evaluate_law
from tasks.eval.body_agreement import pose_body
from tasks.eval.poses.rigid import invert_pose

PLACE = 2e-3
"""Distance within which two ways of interpolating a smooth route agree [m]."""
TURN = 5e-4
"""The same for its directions [rad]."""
AMBIGUITY = 0.5
"""Share of a curve's distance from the chord that interpolations may differ by [1]."""
SMOOTHING_M = 10.0
"""Length of road over which a grade is taken [m]."""
RISE_M = 1e-3
"""Rise of a pose that the sampling of a grade leaves open [m]."""


@dataclass(frozen=True, kw_only=True)
class RouteLine:
    """The reference route as it was recorded.

    Parameters
    ----------
    station : float64 [M] increasing [m]
    T_world_rig : float64 [M, 4, 4] poses of the undisturbed rig [m]
    """

    station: Floats
    T_world_rig: Floats


def route_laws(
    frames: Mapping[str, NDArray[Any]], route: RouteLine | None, constants: Constants
) -> list[Law | None]:
    """Return the laws of the rig's place and direction; none where the route is not at hand.

    Parameters
    ----------
    frames : columns of the frame table
    route : the reference route
    constants : car and pavement
    """
    if route is None:
        return []
    rest, unsure, turned = interpolate_route(route, frames["station"])
    body = pose_body(
        frames["heave"], frames["pitch"], constants.car["cg_to_front_axle"], constants.car["cg_height"]
    )
    meant = rest @ body
    error = invert_pose(meant) @ frames["T_world_rig"].reshape(-1, 4, 4)
    R = error[:, :3, :3]
    axis = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1) / 2
    angle = np.arctan2(np.linalg.norm(axis, axis=1), (np.trace(R, axis1=1, axis2=2) - 1) / 2)
    columns = "T_world_rig station heave pitch ticks.station ticks.heave ticks.pitch"
    return [
        evaluate_law("rig stands where route, heave and pitch put it", columns,
            np.linalg.norm(error[:, :3, 3], axis=1), PLACE + AMBIGUITY * unsure, "frames"),
        evaluate_law("rig is turned as route and pitch turn it", columns, angle, TURN + AMBIGUITY * turned, "frames"),
    ]  # fmt: skip


def interpolate_route(route: RouteLine, station: Floats) -> tuple[Floats, Floats, Floats]:
    """Return poses [N, 4, 4] of the route, and how far curve and chord differ there in place [m] and direction [rad].

    Positions follow the cubic polynomial through the four nearest poses, directions the normalised mean of the two.

    Parameters
    ----------
    route : the reference route
    station : float64 [N] [m]
    """
    s, T = route.station, route.T_world_rig
    k = np.clip(np.searchsorted(s, station, side="right") - 1, 0, len(s) - 2)
    share = np.clip((station - s[k]) / (s[k + 1] - s[k]), 0.0, 1.0)[:, None]
    chord = (1 - share) * T[k, :3, 3] + share * T[k + 1, :3, 3]
    count = min(4, len(s))
    first = np.clip(k - 1, 0, len(s) - count)
    near = first[:, None] + np.arange(count)
    weights = np.ones((len(station), count))
    for i in range(count):
        for j in range(count):
            if i != j:
                weights[:, i] *= (station - s[near[:, j]]) / (s[near[:, i]] - s[near[:, j]])
    place = np.einsum("ni,nij->nj", weights, T[near, :3, 3])
    R0, R1 = T[k, :3, :3], T[k + 1, :3, :3]
    U, _, Vt = np.linalg.svd((1 - share[:, :, None]) * R0 + share[:, :, None] * R1)
    between = np.swapaxes(R0, 1, 2) @ R1
    angle = np.arccos(np.clip((np.trace(between, axis1=1, axis2=2) - 1) / 2, -1.0, 1.0))
    poses = np.tile(np.eye(4), (len(station), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = U @ Vt, place
    inside = (share > 0) & (share < 1)
    return poses, np.linalg.norm(place - chord, axis=1) * inside[:, 0], 0.1 * angle**2


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
