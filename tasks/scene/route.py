"""The reference route P_0(s): rig poses along arc length."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation, Slerp

from tasks.errors import InputError

SAMPLING = 0.25
"""Step of the samples from which a point's projection onto the route is found [m]."""


STANDSTILL = 0.01
"""A point closer than this to the last kept one is dropped [m]."""
LONGEST_ROUTE = 1e5
"""Greatest length of a route [m]: its samples take 50 MB, and no clip is a hundredth of it long."""
FARTHEST = 1e8
"""Greatest coordinate of a route [m]: more than ten times the radius of the Earth."""


@dataclass(frozen=True, kw_only=True)
class Route:
    """Rig poses on the road, sampled along the route.

    The rig frame is ISO 8855 (x forward, y left, z up) with its origin on the road surface under
    the middle of the front axle of the undisturbed vehicle.

    Parameters
    ----------
    station : float64 [M] strictly increasing arc length, starting at 0, M >= 2 [m]
    T_world_rig : float64 [M, 4, 4] rig-to-world poses

    Raises
    ------
    InputError
        Listing every rule the arrays break.
    """

    station: NDArray[np.float64]
    T_world_rig: NDArray[np.float64]

    def __post_init__(self) -> None:
        problems = []
        count = len(self.station)
        if count < 2 or self.T_world_rig.shape != (count, 4, 4):
            raise InputError(
                f"a route needs two poses or more, [M] stations and [M, 4, 4] poses;"
                f" it has {self.station.shape} and {self.T_world_rig.shape}"
            )
        if not (np.isfinite(self.station).all() and np.isfinite(self.T_world_rig).all()):
            raise InputError("a route's stations and poses must be finite; some are not")
        problems += _find_range_problems(self.T_world_rig[:, :3, 3])
        if not self.station[-1] <= LONGEST_ROUTE:
            problems.append(f"a route must be at most {LONGEST_ROUTE:g} m long; it is {self.station[-1]:g} m")
        steps = np.diff(self.station)
        if self.station[0] != 0 or (steps <= 0).any():
            problems.append(
                "a route's stations must start at 0 and increase;"
                f" they start at {self.station[0]:g} and the smallest step is {steps.min():g} m"
            )
        R = self.T_world_rig[:, :3, :3]
        # entries far above 1 would overflow in the product
        off = np.abs(R).max(axis=(1, 2)) - 1
        if off.max() <= 1e-6:
            off = np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)).max(axis=(1, 2))
        if off.max() > 1e-6 or (np.linalg.det(R) < 0).any():
            problems.append(
                f"a route's poses must be right-handed rotations; pose {int(off.argmax())} is off by"
                f" {off.max():.1e}"
            )
        if np.abs(self.T_world_rig[:, 3] - (0, 0, 0, 1)).max() > 1e-6:
            problems.append("a route's poses must end in the row 0 0 0 1; some do not")
        if problems:
            raise InputError(problems)

    @property
    def length(self) -> float:
        """Arc length [m]."""
        return float(self.station[-1])

    def pose(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return P_0(s): position by a cubic through the poses along their headings, attitude by quaternion slerp.

        Parameters
        ----------
        station : scalar or [N], within the route [m]

        Returns
        -------
        float64 [4, 4] or [N, 4, 4]

        Raises
        ------
        InputError
            If a station lies beyond the route.
        """
        s = np.asarray(station, dtype=np.float64)
        beyond = ~((s >= 0) & (s <= self.length))
        if beyond.any():
            raise InputError(
                f"the station must lie on the route, 0 to {self.length:.2f} m; it is {s[beyond][0]:.2f} m:"
                " end or brake the drive sooner, or take a longer route"
            )
        poses = np.zeros((s.size, 4, 4))
        poses[:, :3, 3] = self._position(s.ravel())
        poses[:, :3, :3] = self._attitude(s.ravel()).as_matrix()
        poses[:, 3, 3] = 1.0
        return poses.reshape(*s.shape, 4, 4)

    def project(
        self, points: NDArray[np.floating]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return route coordinates of points: station along the route, lateral leftward, height above the road.

        Points before the start or beyond the end get stations along the end poses' headings.

        Parameters
        ----------
        points : [N, 3] world frame [m]

        Returns
        -------
        station, lateral, height : float64 [N] [m]
        """
        points = np.asarray(points, dtype=np.float64)
        fine = self._fine
        _, nearest = self._tree.query(points[:, :2])
        pose = fine.pose[nearest]
        x, y, z = np.einsum("nji,nj->in", pose[:, :3, :3], points - pose[:, :3, 3])
        # From the nearest sample on, the frame moves by t and turns by w per metre of station; the projection of the
        # point is where its x vanishes. Beyond the ends the frame no longer turns.
        ends = ((nearest == 0) & (x < 0)) | ((nearest == len(fine.station) - 1) & (x > 0))
        wx, wy, wz = np.where(ends, 0.0, fine.turn[nearest].T)
        tx, ty, tz = np.where(ends, [[1.0], [0.0], [0.0]], fine.tangent[nearest].T)
        step = np.where(ends, x, np.clip(x / np.maximum(tx + wy * z - wz * y, 0.1), -SAMPLING, SAMPLING))
        lateral = y - step * (ty + wz * x / 2 - wx * z)
        height = z - step * (tz + wx * y - wy * x / 2)
        return fine.station[nearest] + step, lateral, height

    @cached_property
    def _position(self) -> CubicHermiteSpline:
        # unit-speed tangents from the knots themselves: the rig's x axis may differ by its mounting pitch
        edges: Literal[1, 2] = 2 if len(self.station) > 2 else 1
        tangents = np.gradient(self.T_world_rig[:, :3, 3], self.station, axis=0, edge_order=edges)
        return CubicHermiteSpline(self.station, self.T_world_rig[:, :3, 3], tangents, axis=0)

    @cached_property
    def _attitude(self) -> Slerp:
        return Slerp(self.station, Rotation.from_matrix(self.T_world_rig[:, :3, :3]))

    @cached_property
    def _fine(self) -> "_Samples":
        station = np.linspace(0, self.length, max(3, int(np.ceil(self.length / SAMPLING)) + 1))
        pose = self.pose(station)
        R = Rotation.from_matrix(pose[:, :3, :3])
        between = (R[:-1].inv() * R[1:]).as_rotvec() / station[1]
        turn = (between[np.r_[0, : len(between)]] + between[np.r_[: len(between), -1]]) / 2
        return _Samples(
            station=station, pose=pose, tangent=R.inv().apply(self._position(station, 1)), turn=turn
        )

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._fine.pose[:, :2, 3])


@dataclass(frozen=True, kw_only=True)
class _Samples:
    """The route at close, equal steps: stations, poses, and direction and turning per metre in the rig frame."""

    station: NDArray[np.float64]
    pose: NDArray[np.float64]
    tangent: NDArray[np.float64]
    turn: NDArray[np.float64]


def route_from_poses(T_world_rig: NDArray[np.float64]) -> Route:
    """Return a route through poses, with stations by chord length; poses at a standstill are dropped.

    Parameters
    ----------
    T_world_rig : float64 [M, 4, 4]

    Raises
    ------
    InputError
        If fewer than two poses remain.
    """
    if problems := _find_range_problems(T_world_rig[:, :3, 3]):
        raise InputError(problems)
    poses = T_world_rig[_drop_standstill(T_world_rig[:, :3, 3])]
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    return Route(station=np.concatenate([[0.0], np.cumsum(steps)]), T_world_rig=poses)


def route_from_positions(positions: NDArray[np.float64]) -> Route:
    """Return a route through points on the road, with x along its tangent and z up.

    Parameters
    ----------
    positions : float64 [M, 3] world frame, z up [m]

    Raises
    ------
    InputError
        If fewer than two points remain, or the route stands upright somewhere.
    """
    if problems := _find_range_problems(positions):
        raise InputError(problems)
    kept = positions[_drop_standstill(positions)]
    if len(kept) < 2:
        raise InputError(f"a route needs two points {STANDSTILL:g} m apart or more; it has {len(kept)}")
    steps = np.linalg.norm(np.diff(kept, axis=0), axis=1)
    station = np.concatenate([[0.0], np.cumsum(steps)])
    forward = np.gradient(kept, station, axis=0, edge_order=2 if len(kept) > 2 else 1)
    left = np.cross([0.0, 0.0, 1.0], forward)
    upright = np.linalg.norm(left, axis=1) < 1e-3
    if upright.any():
        raise InputError(f"a route must not stand upright or turn on the spot; point {upright.argmax()} does")
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    poses = np.tile(np.eye(4), (len(kept), 1, 1))
    poses[:, :3, :3] = np.stack([forward, left, np.cross(forward, left)], axis=2)
    poses[:, :3, 3] = kept
    return Route(station=station, T_world_rig=poses)


def _find_range_problems(positions: NDArray[np.float64]) -> list[str]:
    if (np.abs(positions) <= FARTHEST).all():
        return []
    bad = int(np.flatnonzero(~(np.abs(positions) <= FARTHEST).all(axis=1))[0])
    return [
        f"a route's points must be finite numbers of at most {FARTHEST:g} m; point {bad} is"
        f" {', '.join(f'{x:g}' for x in positions[bad])}"
    ]


def _drop_standstill(positions: NDArray[np.float64]) -> list[int]:
    """Return the numbers of the positions farther than `STANDSTILL` from the last one kept, NaN included."""
    kept: list[int] = []
    for i, position in enumerate(positions):
        if not kept or not np.linalg.norm(position - positions[kept[-1]]) <= STANDSTILL:
            kept.append(i)
    return kept


def extend_route(route: Route, ahead_m: float, spacing_m: float = 1.0) -> Route:
    """Return the route with a straight extension along its last pose.

    Parameters
    ----------
    route : the route
    ahead_m : length of the extension [m]
    spacing_m : distance of the added poses [m]
    """
    steps = np.linspace(0, ahead_m, int(np.ceil(ahead_m / spacing_m)) + 1)[1:]
    last = route.T_world_rig[-1]
    added = np.tile(last, (len(steps), 1, 1))
    added[:, :3, 3] = last[:3, 3] + steps[:, None] * last[:3, 0]
    return Route(
        station=np.concatenate([route.station, route.length + steps]),
        T_world_rig=np.concatenate([route.T_world_rig, added]),
    )
