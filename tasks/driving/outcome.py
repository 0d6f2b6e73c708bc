"""What became of an approach: whether the car met its target, how fast, and how close it came."""

from dataclasses import dataclass
from math import cos, inf, nan, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.driving.targets import TargetTrack

TICK_S = 0.001


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Figures of one approach.

    Parameters
    ----------
    collided : whether the front met the target
    impact_speed : speed over that of the target where it did, else 0 [m/s]
    min_ttc : smallest time to collision of the drive, while the gap closed; 0 where it collided [s]
    clearance : smallest gap to a target in the path; 0 where it collided, NaN where none was in the path [m]
    avoided_speed : impact speed without a brake, less the impact speed [m/s]
    brake_time : when the pressure first rose; NaN where it never did [s]
    """

    collided: bool
    impact_speed: float
    min_ttc: float
    clearance: float
    avoided_speed: float
    brake_time: float


def judge_approach(
    station: NDArray[np.float64],
    speed: NDArray[np.float64],
    pressure: NDArray[np.float64],
    track: TargetTrack,
    *,
    overhang: float,
    width: float,
) -> Outcome:
    """Return the outcome of a drive towards one target.

    Only the front counts: who walks into the side of a car that has passed is not met by it.

    Parameters
    ----------
    station, speed, pressure : of the car at every millisecond, float64 [N] [m, m/s, MPa]
    track : of the target
    overhang : of the front bumper before the front axle [m]
    width : of the car [m]
    """
    time: NDArray[np.float64] = TICK_S * np.arange(len(station), dtype=np.float64)
    there, pace, aside = _place(track, time)
    gap, closing = there - station - overhang, speed - pace
    in_path = np.abs(aside) < 0.5 * (width + track.width)
    pressed = np.flatnonzero(pressure > 0)
    passed = np.flatnonzero(gap <= 0)
    first = int(passed[0]) if passed.size else len(gap)
    collided = first < len(gap) and bool(in_path[first])
    unbraked = _find_unbraked_impact(float(speed[0]), station[0] + overhang, track, width, time[-1] + 30.0)
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
        avoided_speed=max(unbraked - impact, 0.0),
        brake_time=float(time[max(int(pressed[0]) - 1, 0)]) if pressed.size else nan,
    )


def _place(track: TargetTrack, time: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Station [m], speed along the route [m/s] and lateral position [m] at times."""
    way, speed, _ = track.trace(time)
    ahead, aside = cos(track.heading), sin(track.heading)
    return track.station + ahead * way, ahead * speed, track.lateral + aside * way


def _find_unbraked_impact(speed: float, bumper: float, track: TargetTrack, width: float, end: float) -> float:
    """Speed at which a car of constant speed meets the target; 0 where it does not [m/s]."""
    time = np.arange(0.0, end, 0.01)
    there, pace, aside = _place(track, time)
    passed = np.flatnonzero(there <= bumper + speed * time)
    if not passed.size or abs(aside[passed[0]]) >= 0.5 * (width + track.width):
        return 0.0
    return max(speed - float(pace[passed[0]]), 0.0)


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
        "avoided_km_h": round(outcome.avoided_speed * 3.6, 2),
        "brake_time_s": _finite(outcome.brake_time),
    }


def _finite(value: float) -> float | None:
    return round(value, 3) if np.isfinite(value) else None
