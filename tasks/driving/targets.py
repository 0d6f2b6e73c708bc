"""What stands or moves ahead of the car, as a brake sees it: a rear end by its station, without a picture."""

from dataclasses import dataclass
from math import cos, inf, isfinite, sin

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError


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

    def trace(
        self, time: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return way along the heading [m], speed along it [m/s] and acceleration [m/s2] at times, any shape each.

        Parameters
        ----------
        time : since the start, 0 or more [s]
        """
        change = self.final_speed - self.speed
        lasts = change / self.acceleration if self.acceleration * change > 0 else 0.0
        since = np.maximum(time - self.change_at, 0.0)
        within = np.minimum(since, lasts)
        speed = self.speed + self.acceleration * within
        way = self.speed * np.minimum(time, self.change_at) + 0.5 * (self.speed + speed) * within
        rate = np.where((since > 0) & (since < lasts), self.acceleration, 0.0)
        return way + speed * (since - within), speed, rate

    def find(self, time: float) -> Target:
        """Return the target at a time since the start [s]."""
        way, speed, rate = (float(value) for value in self.trace(np.float64(time)))
        ahead, aside = cos(self.heading), sin(self.heading)
        return Target(
            station=self.station + ahead * way, speed=ahead * speed, acceleration=ahead * rate,
            lateral=self.lateral + aside * way, lateral_speed=aside * speed, width=self.width,
        )  # fmt: skip
