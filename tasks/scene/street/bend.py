"""The course of the road: route coordinates to the world, and the route itself."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from tasks.scene.route import Route
from tasks.scene.street.layout import StreetLayout

_STEP = 0.05
_MARGIN = 150.0
_ROUTE_STEP = 0.5


@dataclass(frozen=True, kw_only=True)
class Course:
    """The route's line in the world.

    On a hill points are lifted by the road's rise, so that walls stand upright, and directions tilt with the road.

    Parameters
    ----------
    station : float64 [M] increasing stations, way on the road [m]
    x, y : float64 [M] position [m]
    heading : float64 [M] direction, counter-clockwise from x [rad]
    z : float64 [M] height [m]
    grade : float64 [M] rise per metre of way, the sine of the road's angle [1]
    """

    station: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    heading: NDArray[np.float64]
    z: NDArray[np.float64]
    grade: NDArray[np.float64]

    @property
    def is_level(self) -> bool:
        """Whether the road neither climbs nor falls."""
        return not self.grade.any()

    def heading_at(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return the direction of the road at a station [m], in [rad]."""
        return np.interp(np.asarray(station, dtype=np.float64), self.station, self.heading)

    def to_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the world position of points [N, 3] given as station, lateral, height [m]."""
        s, d, z = points.T
        heading = self.heading_at(s)
        x = np.interp(s, self.station, self.x) - d * np.sin(heading)
        y = np.interp(s, self.station, self.y) + d * np.cos(heading)
        if not self.is_level:
            z = z + np.interp(s, self.station, self.z)
        return np.stack([x, y, z], axis=1)

    def to_world_quaternions(
        self, station: NDArray[np.float64], axes: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return world quaternions wxyz [N, 4] of axes [N, 3, 3] (rows in route coordinates) at stations [N] [m]."""
        columns = [self.to_world_directions(station, axes[:, k]) for k in range(3)]
        return Rotation.from_matrix(np.stack(columns, axis=2)).as_quat(scalar_first=True)

    def to_world_directions(
        self, station: NDArray[np.float64], vectors: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return world directions [N, 3] of vectors [N, 3] in route coordinates at stations [N] [m]."""
        heading = self.heading_at(station)
        cos, sin = np.cos(heading), np.sin(heading)
        x, y, z = vectors.T
        if not self.is_level:
            rise = np.interp(np.asarray(station, dtype=np.float64), self.station, self.grade)
            flat = np.sqrt(1 - rise**2)
            x, z = x * flat - z * rise, x * rise + z * flat
        return np.stack([x * cos - y * sin, x * sin + y * cos, z], axis=1)


@lru_cache(maxsize=4)
def integrate_course(layout: StreetLayout) -> Course:
    """Integrate curvature and grade of the layout's course."""
    first, last = layout.station_range
    n = round((last - first + 2 * _MARGIN) / _STEP) + 1
    station = first - _MARGIN + _STEP * np.arange(n, dtype=np.float64)
    heading = _cumulative_integral(layout.course.curvature_at(station))
    grade = layout.course.grade_at(station)
    flat = np.sqrt(1 - grade**2)
    x, y = _cumulative_integral(flat * np.cos(heading)), _cumulative_integral(flat * np.sin(heading))
    z = _cumulative_integral(grade)
    start = [np.interp(0.0, station, values) for values in (x, y, z)]
    return Course(
        station=station, x=x - start[0], y=y - start[1], heading=heading, z=z - start[2], grade=grade
    )


def lay_route(layout: StreetLayout, line: Course) -> Route:
    """Return the route of rig poses every half metre along the lane's middle."""
    station = np.linspace(0.0, layout.route_length, round(layout.route_length / _ROUTE_STEP) + 1)
    pose = np.tile(np.eye(4), (len(station), 1, 1))
    heading = line.heading_at(station)
    pose[:, 0, 0] = pose[:, 1, 1] = np.cos(heading)
    pose[:, 1, 0] = np.sin(heading)
    pose[:, 0, 1] = -pose[:, 1, 0]
    if not line.is_level:
        for axis in (0, 2):
            unit = np.tile(np.eye(3)[axis], (len(station), 1))
            pose[:, :3, axis] = line.to_world_directions(station, unit)
    pose[:, :3, 3] = line.to_world(np.stack([station, 0 * station, 0 * station], axis=1))
    return Route(station=station, T_world_rig=pose)


def _cumulative_integral(rate: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2)]) * _STEP
