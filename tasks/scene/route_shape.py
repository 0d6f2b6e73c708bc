"""The shape of a route as a car feels it: its grade and its curvature along the station.

Both are read off P_0 over a window longer than a car, so that a dent of the road or the noise of a survey, which belong
to the road's surface, is no hill and no bend. A hump of the scene's own, such as 0.1 m over 3.7 m, leaves 1 %.
"""

import numpy as np
from numpy.typing import NDArray

from tasks.scene.route import Route
from tasks.surface.road_profile import RoadGrade

SPACING_M = 2.0
"""Distance of the samples [m]."""
WINDOW_M = 10.0
"""Length of road over which each is taken; near an end of the route it is the first or last that long [m]."""
DIGITS = 9
"""Decimals of a grade: a millionth of a millimetre per metre, below which processors may differ [1]."""


def sample_grade(route: Route) -> RoadGrade:
    """Return the grade along a route: the rise of P_0 over the window, per metre of way.

    Parameters
    ----------
    route : P_0, z up
    """
    before, after = _window_ends(route)
    rise = (route.pose(after)[:, 2, 3] - route.pose(before)[:, 2, 3]) / (after - before)
    rounded = np.round(rise, DIGITS) + 0.0  # no -0
    return RoadGrade(rise=tuple(rounded.tolist()), spacing_m=SPACING_M)


def sample_curvature(route: Route) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return stations [N] [m] and the curvature there, to the left positive [N] [1/m].

    It is the change of P_0's heading over the window, per metre of way: a camera that is mounted askew turns as the
    road does.

    Parameters
    ----------
    route : P_0, z up
    """
    before, after = _window_ends(route)
    known = np.unique(np.concatenate([before, after]))
    x_axis = route.pose(known)[:, :2, 0]
    heading = np.unwrap(np.arctan2(x_axis[:, 1], x_axis[:, 0]))
    turned = np.interp(after, known, heading) - np.interp(before, known, heading)
    return _list_stations(route), turned / (after - before)


def find_lateral_demand(
    route: Route, station: NDArray[np.float64], speed: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the lateral acceleration that the bends ask of a car that follows the route, v^2 |curvature| [N] [m/s2].

    Beyond the end of the route there is no bend.

    Parameters
    ----------
    route : P_0
    station, speed : of the car [N] [m, m/s]
    """
    known, curvature = sample_curvature(route)
    bend = np.interp(station, known, np.abs(curvature))
    return np.where(station <= route.length, speed**2 * bend, 0.0)


def _list_stations(route: Route) -> NDArray[np.float64]:
    return SPACING_M * np.arange(int(route.length / SPACING_M) + 1, dtype=np.float64)


def _window_ends(route: Route) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the stations between which each sample is taken, two arrays [N] [m]."""
    before = np.clip(_list_stations(route) - WINDOW_M / 2, 0.0, max(route.length - WINDOW_M, 0.0))
    return before, np.minimum(before + WINDOW_M, route.length)
