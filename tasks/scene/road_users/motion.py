"""Motion of a body along its track, on a route."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.scene.road_users.track import Track, drive_track
from tasks.scene.route import Route

STEP_M = 0.1
"""Distance of the points of a line between which its length is summed up [m]."""
Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Motion of a body at some times.

    Parameters
    ----------
    T_world_body : float64 [N, 4, 4] body axes (x forward, y left, z up, from the middle of the footprint) to world [m]
    velocity : float64 [N, 3] of the origin, world frame [m/s]
    speed : float64 [N] along the body's x [m/s]
    acceleration : float64 [N] rate of change of the speed [m/s2]
    """

    T_world_body: Floats
    velocity: Floats
    speed: Floats
    acceleration: Floats


def move_on_track(track: Track, route: Route, time: Floats, friction: float) -> Motion:
    """Return the motion of a body on its track; it stands on the plane of the route.

    Parameters
    ----------
    track : of the body
    route : whose stations and lateral positions the track is in
    time : float64 [N] since the start of the clip [s]
    friction : mu of the surface [1]

    Raises
    ------
    InputError
        If the track leads beyond an end of the route.
    """
    way, speed, rate = drive_track(track, np.asarray(time, np.float64), friction)
    # a line beside a bend is shorter or longer than its stations say
    along = np.linspace(0.0, 1.0, max(2, int(np.ceil(2 * way.max(initial=0.0) / STEP_M)) + 1))
    along *= 2 * way.max(initial=0.0) + STEP_M
    line = _trace_line(track, route, along)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line[:, :3, 3], axis=0), axis=1))])
    if length[-1] < way.max(initial=0.0):
        raise InputError(
            f"must stay on the route, 0 to {route.length:.1f} m; it reaches the end"
            f" {length[-1]:.1f} m after its start: begin elsewhere, or be slower"
        )
    poses = _trace_line(track, route, np.interp(way, length, along[: len(length)]))
    return Motion(
        T_world_body=poses, velocity=poses[:, :3, 0] * speed[:, None], speed=speed, acceleration=rate
    )


def _trace_line(track: Track, route: Route, along: Floats) -> Floats:
    """Return the poses [M, 4, 4] at ways along the line, in stations, as far as it lies on the route."""
    cos, sin = np.cos(track.heading), np.sin(track.heading)
    turn = np.eye(4)
    turn[:2, :2] = (cos, -sin), (sin, cos)
    if track.in_world:
        ground = np.stack((track.start[0] + cos * along, track.start[1] + sin * along, 0 * along), axis=1)
        station, _, height = route.project(ground)
        inside = _count_inside(station, route)
        poses = np.tile(turn, (inside, 1, 1))
        poses[:, :3, 3] = ground[:inside]
        poses[:, 2, 3] -= height[:inside]
        return poses
    station = track.start[0] + cos * along
    inside = _count_inside(station, route)
    poses = route.pose(station[:inside])
    poses[:, :3, 3] += poses[:, :3, 1] * (track.start[1] + sin * along[:inside])[:, None]
    return poses @ turn


def _count_inside(station: Floats, route: Route) -> int:
    """Return how many of the stations lie on the route before the first that does not."""
    outside = (station < 0) | (station > route.length)
    if len(outside) and outside[0]:
        raise InputError(
            f"must begin on the route, at station 0 to {route.length:.1f} m; it begins at {station[0]:.1f} m"
        )
    return int(outside.argmax()) if outside.any() else len(station)
