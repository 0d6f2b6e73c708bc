"""What became of an approach: whether the car met its target, how fast, and how close it came."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.driving.targets import TargetPath, TargetTrack

TICK_S = 0.001
UNBRAKED_S, UNBRAKED_STEP_S = 60.0, 0.01
"""Time for which a car that nobody brakes is followed, and its step [s]."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Figures of one approach.

    Parameters
    ----------
    collided : whether the front met the target
    impact_speed : speed over that of the target where it did, else 0 [m/s]
    min_ttc : smallest time to collision of the drive, while the gap closed; 0 where it collided, infinite where the
        gap never closed [s]
    clearance : smallest gap to a target in the path; 0 where it collided, NaN where none was in the path [m]
    avoided_speed : impact speed without a brake, less the impact speed; NaN where nobody knows the former [m/s]
    brake_time : when the pressure first rose; NaN where it never did [s]
    impact_time : when the front met the target; infinite where it did not [s]
    """

    collided: bool
    impact_speed: float
    min_ttc: float
    clearance: float
    avoided_speed: float
    brake_time: float
    impact_time: float


def judge_approach(
    station: NDArray[np.float64],
    speed: NDArray[np.float64],
    pressure: NDArray[np.float64],
    path: TargetPath,
    *,
    overhang: float,
    width: float,
    unbraked_impact: float,
) -> Outcome:
    """Return the outcome of a drive towards one target.

    Only the front counts: who walks into the side of a car that has passed is not met by it.

    Parameters
    ----------
    station, speed, pressure : of the car at every millisecond, float64 [N] [m, m/s, MPa]
    path : of the target at the same times
    overhang : of the front bumper before the front axle [m]
    width : of the car [m]
    unbraked_impact : of `find_unbraked_impact`; NaN where nobody knows it [m/s]
    """
    time: NDArray[np.float64] = TICK_S * np.arange(len(station), dtype=np.float64)
    gap, closing = path.station - station - overhang, speed - path.speed
    in_path = np.abs(path.lateral) < 0.5 * (width + path.width)
    pressed = np.flatnonzero(pressure > 0)
    passed = np.flatnonzero(gap <= 0)
    first = int(passed[0]) if passed.size else len(gap)
    collided = first < len(gap) and bool(in_path[first])
    impact = 0.0
    if collided:
        before = max(first - 1, 0)
        share = gap[before] / (gap[before] - gap[first]) if first > before else 0.0
        impact = float(max(closing[before] + share * (closing[first] - closing[before]), 0.0))
    ahead = in_path[:first] & (gap[:first] > 0)
    closes = ahead & (closing[:first] > 0)
    ttc = float((gap[:first][closes] / closing[:first][closes]).min()) if closes.any() else inf
    return Outcome(
        collided=collided,
        impact_speed=impact,
        min_ttc=0.0 if collided else ttc,
        clearance=0.0 if collided else float(gap[:first][ahead].min()) if ahead.any() else nan,
        avoided_speed=float(np.maximum(unbraked_impact - impact, 0.0)),
        brake_time=float(time[max(int(pressed[0]) - 1, 0)]) if pressed.size else nan,
        impact_time=float(time[first]) if collided else inf,
    )


def find_unbraked_impact(speed: float, bumper: float, track: TargetTrack, width: float) -> float:
    """Return the speed at which a car of constant speed meets a target; 0 where it does not [m/s].

    Parameters
    ----------
    speed : of the car [m/s]
    bumper : station of its front at 0 s [m]
    track : of the target
    width : of the car [m]
    """
    time = np.arange(0.0, UNBRAKED_S, UNBRAKED_STEP_S)
    path = track.locate(time)
    passed = np.flatnonzero(path.station <= bumper + speed * time)
    if not passed.size or abs(path.lateral[passed[0]]) >= 0.5 * (width + track.width):
        return 0.0
    return max(speed - float(path.speed[passed[0]]), 0.0)


def join_outcomes(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the outcome of a drive towards several targets: the first that is met decides, else the nearest.

    Parameters
    ----------
    outcomes : of each, at least one
    """
    first = min(outcomes, key=lambda outcome: outcome.impact_time)
    if first.collided:
        return first
    clearances, avoided = (
        np.array([getattr(outcome, name) for outcome in outcomes]) for name in ("clearance", "avoided_speed")
    )
    return Outcome(
        collided=False,
        impact_speed=0.0,
        min_ttc=min(outcome.min_ttc for outcome in outcomes),
        clearance=float(np.fmin.reduce(clearances)),
        avoided_speed=float(np.fmax.reduce(avoided)),
        brake_time=first.brake_time,
        impact_time=inf,
    )


def describe_outcome(outcome: Outcome) -> dict[str, Any]:
    """Return an outcome in the units that people read; None for what there is not.

    Parameters
    ----------
    outcome : of an approach
    """
    return {
        "collided": outcome.collided,
        "impact_speed_km_h": round(outcome.impact_speed * 3.6, 2),
        "min_ttc_s": _finite(outcome.min_ttc),
        "clearance_m": _finite(outcome.clearance),
        "avoided_km_h": _finite(outcome.avoided_speed * 3.6, 2),
        "brake_time_s": _finite(outcome.brake_time),
    }


def _finite(value: float, digits: int = 3) -> float | None:
    return round(value, digits) if np.isfinite(value) else None
