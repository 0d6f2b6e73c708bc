"""Tracks of road users: a straight line of the road's coordinates, or of the world, driven with one change of speed."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import GRAVITY

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Track:
    """Motion of a road user's middle along a line.

    Parameters
    ----------
    start : station and lateral position at time 0, left positive; in the world x and y [m]
    heading : of the motion and of the body, counter-clockwise from the road's direction; in the world from x [rad]
    in_world : whether start and heading are the world's
    speed : at time 0, along the heading [m/s]
    change_at : time from which the speed changes; never by default [s]
    acceleration : from then on, negative to brake [m/s2]
    final_speed : at which the change ends [m/s]
    """

    start: tuple[float, float]
    heading: float = 0.0
    in_world: bool = False
    speed: float = 0.0
    change_at: float = inf
    acceleration: float = 0.0
    final_speed: float = 0.0


def limit_acceleration(demanded: float, friction: float) -> float:
    """Return the rate of change of speed that the surface allows: at most mu g either way.

    Parameters
    ----------
    demanded : asked for [m/s2]
    friction : mu of the surface [1]
    """
    return float(np.clip(demanded, -friction * GRAVITY, friction * GRAVITY))


def drive_track(track: Track, time: Floats, friction: float) -> tuple[Floats, Floats, Floats]:
    """Return the way since time 0 [N] [m], the speed [N] [m/s] and its rate of change [N] [m/s2].

    Parameters
    ----------
    track : with the speeds
    time : float64 [N], 0 or more [s]
    friction : mu of the surface, which bounds the rate [1]
    """
    rate = limit_acceleration(track.acceleration, friction)
    change = track.final_speed - track.speed
    lasts = change / rate if rate * change > 0 else 0.0
    since = np.maximum(time - track.change_at, 0.0)
    within = np.minimum(since, lasts)
    speed = track.speed + rate * within
    way = track.speed * np.minimum(time, track.change_at) + (track.speed + rate * within / 2) * within
    return way + speed * (since - within), speed, np.where((since > 0) & (since < lasts), rate, 0.0)
