"""Validation of a channel by another that must follow it: sign, and the unit by the ratio of both."""

from collections.abc import Mapping
from math import log

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING
from tasks.campaign.channels import SPEED_UNITS, UNITS, guess_unit

DIVE_PER_DECELERATION = (0.02, 2.0)
"""Pitch that a road car's body gives per deceleration; the paper's vehicle has 0.4 [deg per m/s^2]."""
SAME_UNIT, NEARER = 1.15, 2.0
"""Ratio within which an acceleration and the rate of a speed agree in a unit: gain of the one and dive of the car; and
how much nearer they are in another unit than in their own, where that is the true one [1]."""
CHANGING = 1.0
"""Standard deviation of an acceleration from which its ratio to the rate of a speed is sharp [m/s^2]."""
HALF_GRAVITY = 4.9
"""Mean from which an acceleration holds gravity: no road is so steep, and no offset so large [m/s^2]."""


def find_pair_problems(
    name: str,
    values: NDArray[np.float64],
    other_name: str,
    other: NDArray[np.float64],
    correlation: float,
    mapped_unit: str | None,
    speed_unit: str | None = None,
) -> list[str]:
    """Return the problem of one channel's sign by another, and of its size where both must be equal.

    Where the other is the rate of a speed, its ratio is held against that of every other unit of the speed.

    Parameters
    ----------
    name, values : of the channel, float64 [N]
    other_name, other : what it is compared with, float64 [N] in the same unit
    correlation : from which both tell of each other [1]
    mapped_unit : of the channel in the map; None where both need not be equal
    speed_unit : of the speed in the map; None where the other is not its rate
    """
    x, y = other - other.mean(), values - values.mean()
    spread = float(np.sqrt((x @ x) * (y @ y)))
    if spread <= 0 or abs(float(x @ y)) < correlation * spread:
        return []
    slope = float(x @ y) / float(x @ x)
    if slope < 0:
        return [
            f"channel {name} runs against {other_name} (correlation {float(x @ y) / spread:.2f}): turn its sign over"
        ]
    if mapped_unit is None:
        return []
    sharp = speed_unit is not None and float(np.std(y)) > CHANGING
    of_speed = _guess_speed_unit(speed_unit, slope) if sharp and speed_unit is not None else None
    if 0.4 < slope < 2.5 and of_speed is None:
        return []
    guess = None if of_speed else guess_unit(mapped_unit, slope)
    hint = f"; taken as {mapped_unit}, it looks like {guess}" if guess else ""
    hint = f"; the speed taken as {speed_unit}, it looks like {of_speed}" if of_speed else hint
    return [
        f"channel {name} is {slope:.3g} times {other_name}: the unit or scale of one of them is wrong{hint}"
    ]


def _guess_speed_unit(taken: str, ratio: float) -> str | None:
    """Return the unit of a speed in which its rate agrees with an acceleration; None where its own may be right.

    Parameters
    ----------
    taken : the assumed unit
    ratio : of the acceleration over the rate of the speed [1]
    """
    apart = {unit: abs(log(ratio * UNITS[taken][1] / UNITS[unit][1])) for unit in SPEED_UNITS}
    near = min(apart, key=apart.__getitem__)
    return near if apart[near] < min(log(SAME_UNIT), apart[taken] / NEARER) else None


def find_axis_problems(felt: NDArray[np.float64], rate: NDArray[np.float64]) -> list[str]:
    """Return the problem of a forward acceleration that holds gravity, as that of an axis which points down does.

    Parameters
    ----------
    felt, rate : acceleration and rate of the speed, float64 [N] [m/s^2]
    """
    apart = float(np.mean(felt - rate))
    if abs(apart) <= HALF_GRAVITY:
        return []
    return [
        f"channel longitudinal_acceleration must follow the rate of speed; it is {apart:.2f} m/s^2 off on average,"
        " which no road's slope explains: map the axis that points forward, or correct its offset"
    ]


def find_pitch_problems(
    columns: Mapping[str, NDArray[np.float64]], rate: NDArray[np.float64], interval: float
) -> list[str]:
    """Return the problem of the sign or the size of the pitch of a car that brakes.

    Parameters
    ----------
    columns : moving means of the channels by name, each float64 [N], in campaign units
    rate : of the speed, float64 [N] [m/s^2]
    interval : of their clock [s]
    """
    moving = columns["speed"] > MOVING
    braking = moving & (rate < -1.0)
    if "brake_pressure" in columns:
        braking &= columns["brake_pressure"] > 0.1 * float(np.max(columns["brake_pressure"]))
    if np.count_nonzero(braking) < 20:
        return []
    # changes over half a second: the body's response to the brake, without the slow slope of the road
    lag = max(round(0.5 / interval), 1)
    dive, less = columns["pitch"][lag:] - columns["pitch"][:-lag], rate[:-lag] - rate[lag:]
    return find_pair_problems("pitch", dive, "the deceleration", less, 0.5, None) or _find_dive_problems(
        dive, less
    )


def _find_dive_problems(dive: NDArray[np.float64], less: NDArray[np.float64]) -> list[str]:
    """Check the size of the body's pitch response to the brake, where there is one."""
    x, y = less - less.mean(), dive - dive.mean()
    if float(x @ y) < 0.5 * float(np.sqrt((x @ x) * (y @ y))) or not x.any():
        return []
    slope = float(x @ y) / float(x @ x)
    low, high = DIVE_PER_DECELERATION
    if low < slope < high:
        return []
    return [
        f"channel pitch gives {slope:.3g} deg per m/s^2 of deceleration, which must lie in {low:g} to {high:g}: correct"
        f" the unit or scale of it{' (it looks like rad)' if slope < low else ''} and of pitch_rate"
    ]
