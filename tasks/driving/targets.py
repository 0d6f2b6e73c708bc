"""What stands or moves ahead of the car, as a brake sees it: a rear end by its station, without a picture."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import cos, inf, isfinite, sin

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.scene.road_users.motion import Motion
from tasks.scene.road_users.track import Track, drive_track, limit_acceleration
from tasks.scene.route import Route

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Target:
    """A road user at one instant, in the stations of the car, whose own is its front axle's.

    Parameters
    ----------
    station : of the end that the car meets [m]
    speed, acceleration : along the route [m/s, m/s2]
    lateral : of its middle, left of the car's path positive [m]
    lateral_speed : to the left [m/s]
    width : across the route [m]
    """

    station: float
    speed: float = 0.0
    acceleration: float = 0.0
    lateral: float = 0.0
    lateral_speed: float = 0.0
    width: float = 1.8


def see_targets(targets: Iterable[Target], bumper: float, visual_range_m: float) -> tuple[Target, ...]:
    """Return the targets that a sensor on the front sees: the air hides those beyond its visual range.

    Parameters
    ----------
    targets : of the road
    bumper : station of the front bumper [m]
    visual_range_m : meteorological optical range: beyond it the contrast is below 5 % (WMO-No. 8) [m]
    """
    return tuple(target for target in targets if target.station - bumper <= visual_range_m)


@dataclass(frozen=True, kw_only=True)
class TargetPath:
    """Where a target is at some times, as `Target` has it.

    Parameters
    ----------
    station, speed, lateral : float64 [N] [m, m/s, m]
    width : across the route, or float64 [N] [m]
    """

    station: Floats
    speed: Floats
    lateral: Floats
    width: Floats | float


@dataclass(frozen=True, kw_only=True)
class TargetTrack:
    """Way of a target on a straight line, with one change of speed.

    Parameters
    ----------
    station, lateral : at 0 s, as of `Target` [m]
    heading : of the motion, counter-clockwise from the route's direction [rad]
    speed : at 0 s, along the heading [m/s]
    change_at : time from which the speed changes; never by default [s]
    acceleration : from then on, negative to brake [m/s2]
    final_speed : at which the change ends [m/s]
    width : across the route [m]

    Raises
    ------
    InputError
        For a number that is not finite, a speed below 0, or a width that is not above 0.
    """

    station: float
    lateral: float = 0.0
    heading: float = 0.0
    speed: float = 0.0
    change_at: float = inf
    acceleration: float = 0.0
    final_speed: float = 0.0
    width: float = 1.8

    def __post_init__(self) -> None:
        problems = [
            f"target: {name} must be a finite number; it is {value}"
            for name, value in vars(self).items()
            if name != "change_at" and not isfinite(value)
        ]
        problems += [
            f"target: {name} must not be negative; it is {value:g}"
            for name in ("speed", "final_speed", "change_at")
            if (value := getattr(self, name)) < 0
        ]
        if not self.width > 0:
            problems.append(f"target: width must be above 0; it is {self.width:g}")
        if problems:
            raise InputError(problems)

    @property
    def settles_at(self) -> float:
        """Time from which the speed no longer changes; 0 where it never does [s]."""
        if self.change_at == inf:
            return 0.0
        change = self.final_speed - self.speed
        return self.change_at + (change / self.acceleration if self.acceleration * change > 0 else 0.0)

    def trace(self, time: Floats) -> tuple[Floats, Floats, Floats]:
        """Return way along the heading [m], speed along it [m/s] and its rate [m/s2] at times, any shape each.

        Parameters
        ----------
        time : since the start, 0 or more [s]
        """
        track = Track(
            start=(self.station, self.lateral), heading=self.heading, speed=self.speed, change_at=self.change_at,
            acceleration=self.acceleration, final_speed=self.final_speed,
        )  # fmt: skip
        return drive_track(track, time, friction=inf)

    def locate(self, time: Floats) -> TargetPath:
        """Return the path of the target at times since the start, float64 [N] [s]."""
        way, speed, _ = self.trace(time)
        ahead, aside = cos(self.heading), sin(self.heading)
        return TargetPath(
            station=self.station + ahead * way, speed=ahead * speed, lateral=self.lateral + aside * way,
            width=self.width,
        )  # fmt: skip

    def find(self, time: float) -> Target:
        """Return the target at a time since the start [s]."""
        return next(self.follow(np.array([time])))

    def follow(self, time: Floats) -> Iterator[Target]:
        """Yield the target at times since the start, float64 [N] [s]."""
        ahead, aside = cos(self.heading), sin(self.heading)
        for way, speed, rate in zip(*(column.tolist() for column in self.trace(time)), strict=True):
            yield Target(
                station=self.station + ahead * way, speed=ahead * speed, acceleration=ahead * rate,
                lateral=self.lateral + aside * way, lateral_speed=aside * speed, width=self.width,
            )  # fmt: skip


def follow_track(track: Track, size: tuple[float, ...], friction: float) -> TargetTrack:
    """Return the way of a road user as a brake sees it: that of the end that the car meets.

    Parameters
    ----------
    track : of its middle, by stations
    size : length, width and height of its body [m]
    friction : mu of the surface, which bounds every change of speed [1]

    Raises
    ------
    InputError
        For a track in the world, whose stations nobody knows without its scene.
    """
    if track.in_world:
        raise InputError(
            "objects: a policy sees tracks by station_m or gap_m; one is given by world_m: write it so"
        )
    length, width = size[0], size[1]
    ahead, aside = abs(cos(track.heading)), abs(sin(track.heading))
    return TargetTrack(
        station=track.start[0] - 0.5 * (ahead * length + aside * width), lateral=track.start[1], heading=track.heading,
        speed=track.speed, change_at=track.change_at, acceleration=limit_acceleration(track.acceleration, friction),
        final_speed=track.final_speed, width=aside * length + ahead * width,
    )  # fmt: skip


def locate_body(motion: Motion, size: tuple[float, ...], route: Route, time: Floats) -> TargetPath:
    """Return the path of a road user's body along a route, bends included: that of the end that the car meets.

    Parameters
    ----------
    motion : of the middle of its footprint
    size : length, width and height of its body [m]
    route : of the car
    time : of the motion, float64 [N], at least two [s]
    """
    corners = 0.5 * np.array([(a * size[0], b * size[1], 0.0) for a in (-1, 1) for b in (-1, 1)])
    places = motion.T_world_body[:, None, :3, 3] + corners @ motion.T_world_body[:, :3, :3].swapaxes(1, 2)
    station, lateral, _ = (one.reshape(-1, 4) for one in route.project(places.reshape(-1, 3)))
    nearest, right, left = station.min(axis=1), lateral.min(axis=1), lateral.max(axis=1)
    return TargetPath(
        station=nearest, speed=np.gradient(nearest, time), lateral=0.5 * (left + right), width=left - right
    )
