"""Implicit steps of a wheel at low speed, worked out again for all rows at once (``low_speed: steady``)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tasks.eval.physics.constants import Constants, Floats
from tasks.eval.physics.tyres import find_curve

MOST_ITERATIONS = 40
"""Newton steps of the rows that need most [1]."""
NEAR = 1e-13
"""Change of slip at which all rows are solved [1]."""


def find_slowest_explicit_speed(facts: Mapping[str, Any], constants: Constants, step: float) -> float:
    """Return the speed below which a wheel's step is implicit, 0 where none is [m/s].

    Parameters
    ----------
    facts : the clip's row
    constants : car and pavement
    step : inner step [s]
    """
    if constants.steady_limit == 0.0:
        return 0.0
    car, curve = constants.car, find_curve(facts, constants)
    weight = constants.mass * car["gravity"] / constants.wheelbase
    moved = curve.peak * weight * car["cg_height"]
    found = [car["slip_speed_floor"]]
    for axle, lever, load in (("f", "cg_to_rear_axle", moved), ("r", "cg_to_front_axle", 0.0)):
        most = weight * car[lever] + load
        grip = car["wheel_radius"] * float(curve.slope(np.array(0.0), np.array(most))) * most
        release = constants.brake_share(axle) * car["brake_gain"] * facts["peak_pressure_mpa"]
        release /= car["abs_release_width"] * curve.target_slip
        inertia = car[f"wheel_inertia_{axle}"] * constants.steady_limit
        found.append(step * car["wheel_radius"] * max(grip, release) / inertia)
    return max(found)


def compute_wheel_rate(
    slip: Floats, load: Floats, pressure: Floats, axle: str, facts: Mapping[str, Any], constants: Constants
) -> tuple[Floats, Floats]:
    """Return a wheel's acceleration [rad/s2] at a slip, and its derivative by slip (paper, Appendix B).

    Parameters
    ----------
    slip : kappa before it is clipped [N] [1]
    load, pressure : of the step [N] [N, MPa]
    axle : f or r
    facts : the clip's row
    constants : car and pavement
    """
    car, curve = constants.car, find_curve(facts, constants)
    target, width, radius = curve.target_slip, car["abs_release_width"], car["wheel_radius"]
    felt = np.clip(slip, 0.0, 1.0)
    grip = curve.friction(felt, load)
    share = (target * (1 + width) - felt) / (width * target)
    torque = constants.brake_share(axle) * car["brake_gain"] * pressure
    steeper = radius * load * curve.slope(felt, load)
    steeper = steeper + np.where((share > 0) & (share < 1), torque / (width * target), 0.0)
    rate = radius * grip * load - np.clip(share, 0.0, 1.0) * torque
    inertia = car[f"wheel_inertia_{axle}"]
    return rate / inertia, np.where((slip >= 0) & (slip < 1), steeper, 0.0) / inertia


def solve_wheel_speed(
    omega: Floats, speed: Floats, load: Floats, pressure: Floats, step: float, axle: str, facts: Mapping[str, Any],
    constants: Constants,
) -> Floats:  # fmt: skip
    """Return wheel speeds after one implicit step each [N] [rad/s].

    Parameters
    ----------
    omega : wheel speed before the step [N] [rad/s]
    speed : after the step [N] [m/s]
    load, pressure : of the step [N] [N, MPa]
    step : inner step [s]
    axle : f or r
    facts : the clip's row
    constants : car and pavement
    """
    radius = constants.car["wheel_radius"]
    per_slip = np.maximum(speed, constants.car["slip_speed_floor"]) / radius
    free = speed / radius - omega
    low, high = np.full(len(omega), -1e3), np.full(len(omega), 1e3)
    slip = np.clip(free / per_slip, 0.0, 1.0)
    for _ in range(MOST_ITERATIONS):
        rate, slope = compute_wheel_rate(slip, load, pressure, axle, facts, constants)
        residual = free - slip * per_slip - step * rate
        low, high = np.where(residual > 0, slip, low), np.where(residual > 0, high, slip)
        following = slip + residual / np.maximum(per_slip + step * slope, 1e-9)
        following = np.where((following < low) | (following > high), 0.5 * (low + high), following)
        if not np.abs(following - slip).max(initial=0.0) > NEAR:
            break
        slip = following
    return speed / radius - following * per_slip
