"""Emergency brakes: when each demands full pressure, and what the brake's line makes of a demand."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tasks.driving.targets import Target

SPEED_STEP = 0.5
SPEEDS = np.arange(0.0, 80.1, SPEED_STEP)
"""Speeds between which a brake that knows friction looks up ways [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Approach:
    """The car and its targets at one instant.

    Parameters
    ----------
    time : since the start [s]
    bumper : station of the front bumper [m]
    speed : [m/s]
    width : of the car [m]
    targets : road users ahead
    """

    time: float
    bumper: float
    speed: float
    width: float
    targets: tuple[Target, ...]


@dataclass(frozen=True, kw_only=True)
class Threat:
    """A target that the car meets where nobody brakes.

    Parameters
    ----------
    gap : to it [m]
    closing : speed at which the gap closes [m/s]
    target : itself
    """

    gap: float
    closing: float
    target: Target

    @property
    def time_to_collision(self) -> float:
        """Gap over closing speed; infinite while it does not close [s]."""
        return self.gap / self.closing if self.closing > 0 else inf


def find_threat(approach: Approach) -> Threat | None:
    """Return the first target that the car meets at constant speeds, or follows in its path; None without one.

    Parameters
    ----------
    approach : car and targets
    """
    threats = []
    for target in approach.targets:
        threat = Threat(
            gap=target.station - approach.bumper, closing=approach.speed - target.speed, target=target
        )
        if threat.gap < 0:
            continue
        meets = target.lateral_speed == 0.0 or threat.closing > 0
        when = threat.time_to_collision if target.lateral_speed else 0.0
        aside = abs(target.lateral + target.lateral_speed * when) if meets else inf
        if aside < 0.5 * (target.width + approach.width):
            threats.append(threat)
    return min(threats, key=lambda threat: threat.gap, default=None)


class Trigger(Protocol):
    """Decides from instant to instant; it may remember."""

    def demands(self, approach: Approach) -> bool:
        """Return whether the brake is to be put on at this instant; once put on, it stays on until the car stands."""


@dataclass(frozen=True, kw_only=True)
class BlindTrigger:
    """Demands the brake at a time to collision, whatever the road.

    Parameters
    ----------
    time_to_collision : at which it brakes [s]
    """

    time_to_collision: float

    def demands(self, approach: Approach) -> bool:
        """As of `Trigger`."""
        threat = find_threat(approach)
        return threat is not None and threat.time_to_collision <= self.time_to_collision


class FrictionTrigger:
    """Demands the brake when the way that the road's friction needs is all that is left.

    Parameters
    ----------
    friction_at : speed [m/s] to the tyres' friction on this road [1]
    gravity : [m/s2]
    share : of that friction that it counts on [1]
    margin : that is left before the target [m]
    lost : time between the demand and full deceleration that brakes nothing [s]
    """

    def __init__(
        self,
        friction_at: Callable[[float], float],
        *,
        gravity: float,
        share: float,
        margin: float,
        lost: float,
    ) -> None:
        self._margin, self._lost = margin, lost
        deceleration = np.array([gravity * share * friction_at(float(speed)) for speed in SPEEDS])
        middle = 0.5 * (1.0 / deceleration[1:] + 1.0 / deceleration[:-1])
        self._times = np.concatenate([[0.0], np.cumsum(middle) * SPEED_STEP])
        mean = 0.5 * (SPEEDS[1:] + SPEEDS[:-1])
        self._ways = np.concatenate([[0.0], np.cumsum(middle * mean) * SPEED_STEP])

    def demands(self, approach: Approach) -> bool:
        """As of `Trigger`."""
        threat = find_threat(approach)
        return (
            threat is not None and threat.gap <= self.find_needed_gap(approach.speed, threat) + self._margin
        )

    def find_needed_gap(self, speed: float, threat: Threat) -> float:
        """Return the gap from which the car, braking now, just does not meet the target [m].

        Parameters
        ----------
        speed : of the car [m/s]
        threat : target, whose deceleration is taken to last until it stands
        """
        target, slows = threat.target.speed, -threat.target.acceleration
        if slows > 0 and target > 0:
            return self._find_gap_to_braking(speed, target, slows)
        if threat.closing <= 0:
            return 0.0
        ways, times = (
            self._look(table, speed) - self._look(table, target) for table in (self._ways, self._times)
        )
        return threat.closing * self._lost + ways - target * times

    def _find_gap_to_braking(self, speed: float, target: float, slows: float) -> float:
        """Return the needed gap to a target that brakes: where both are equally fast, or where both stand [m]."""
        way = self._look(self._ways, speed)
        at_rest = speed * self._lost + way - target * target / (2.0 * slows)
        own = speed * speed / (2.0 * way) if way > 0 else inf
        # while the car's own brake still rises, the target slows
        closing = speed - target + slows * self._lost
        when = closing / (own - slows) if own > slows else inf
        moving = closing > 0 and own * when <= speed and slows * (when + self._lost) <= target
        if not moving:
            return max(at_rest, 0.0)
        lost = (speed - target) * self._lost + 0.5 * slows * self._lost**2
        return max(lost + 0.5 * closing * when, 0.0)

    def _look(self, table: NDArray[np.float64], speed: float) -> float:
        return float(np.interp(speed, SPEEDS, table))


@dataclass(kw_only=True)
class DriverTrigger:
    """Demands the brake a reaction after the gap is seen to close.

    Parameters
    ----------
    looming : rate of the target's visual angle at which its closing is seen [rad/s]
    reaction : from there to the brake [s]
    """

    looming: float
    reaction: float
    _seen_at: float = inf

    def demands(self, approach: Approach) -> bool:
        """As of `Trigger`."""
        threat = find_threat(approach)
        if self._seen_at == inf and threat is not None and threat.gap > 0:
            rate = threat.target.width * threat.closing / (threat.gap * threat.gap)
            if rate >= self.looming:
                self._seen_at = approach.time
        return approach.time >= self._seen_at + self.reaction


@dataclass(kw_only=True)
class BrakeLine:
    """Pressure behind a demand: none for a delay, then a straight rise to the full one.

    Parameters
    ----------
    full_mpa : full pressure [MPa]
    delay : [s]
    build_up : [s]
    """

    full_mpa: float
    delay: float
    build_up: float
    _demanded_at: float = inf

    def demand(self, time: float) -> None:
        """Put the brake on, for good [s]."""
        self._demanded_at = min(self._demanded_at, time)

    def pressure_at(self, time: float) -> float:
        """Return the pressure at a time [s] [MPa]."""
        since = time - self._demanded_at - self.delay
        if since <= 0.0:
            return 0.0
        return self.full_mpa * (min(since / self.build_up, 1.0) if self.build_up > 0 else 1.0)
