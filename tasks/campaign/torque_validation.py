"""Validation of the torque of an engine or a motor: its sign, by Newton's law while the brake is released."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING
from tasks.campaign.channels import BRAKE_SIGNALS, GRAVITY

RELEASED_PRESSURE = 0.1
"""Brake pressure, or what stands for it, up to which the brake is released [MPa]: it gives 0.2 m/s^2."""
AROUND_BRAKING = 0.5
"""Time before and after a brake application that is left out, in which a motor takes over from the brake [s]."""
SHORTEST = 1.0
"""Time with released brake from which a torque is judged [s]."""
LEAST_CHANGE = 0.5
"""Standard deviation of the rate of speed from which a torque is judged [m/s^2]; slopes that are driven up with more
torque, and down with less, change it by less."""
AGAINST = -0.8
"""Correlation of a torque with the rate of speed below which its sign is turned over [1]."""
MASS_TIMES_RADIUS = (50.0, 25000.0)
"""Torque per rate of speed of a vehicle, from a small car to a truck [kg m]; outside it something else moves it."""


def find_torque_problems(
    smooth: Mapping[str, NDArray[np.float64]], interval: float, *, stands_in: bool
) -> list[str]:
    """Return the problem of an ``engine_torque`` that runs against the motion; none where too little changes to tell.

    Parameters
    ----------
    smooth : moving means of the channels, each float64 [M], in campaign units
    interval : of their clock [s]
    stands_in : the brake pressure is another signal in its place, whose scale nobody knows
    """
    scaled = [name for name in BRAKE_SIGNALS if not (stands_in and name == "brake_pressure")]
    brake = next((name for name in scaled if name in smooth), None)
    if brake is None or not {"engine_torque", "speed"} <= smooth.keys():
        return []
    pressed = BRAKE_SIGNALS[brake] * smooth[brake] > RELEASED_PRESSURE
    width = 2 * round(AROUND_BRAKING / interval) + 1
    near = np.convolve(np.pad(pressed, width // 2), np.ones(width), mode="valid") > 0.5
    chosen = ~near & (smooth["speed"] > MOVING)
    if np.count_nonzero(chosen) * interval < SHORTEST:
        return []
    driven = np.gradient(smooth["speed"], interval)
    if "road_slope" in smooth:
        driven = driven + GRAVITY * np.sin(np.radians(smooth["road_slope"]))
    driven, torque = driven[chosen], smooth["engine_torque"][chosen]
    if float(np.std(driven)) < LEAST_CHANGE or float(np.std(torque)) == 0.0:
        return []
    correlation = float(np.corrcoef(torque, driven)[0, 1])
    lightest, heaviest = MASS_TIMES_RADIUS
    if correlation > AGAINST or not lightest < float(np.std(torque) / np.std(driven)) < heaviest:
        return []
    return [
        "channel engine_torque runs against the rate of speed while the brake is released (correlation"
        f" {correlation:.2f}), and must drive the car where it is positive: turn its sign over"
    ]
