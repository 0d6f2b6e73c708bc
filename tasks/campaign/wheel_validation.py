"""Validation of wheel speeds beside the speed: sign, unit, and what both axles say of the rolling radius."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING
from tasks.campaign.channels import UNITS

WHEELS = ("wheel_speed_front", "wheel_speed_rear")
ROLLING_RADIUS = (0.2, 0.6)
"""Rolling radius of a road car [m]."""
AXLES_APART = 0.07
"""Share by which the rolling radii of a road car's axles differ at most [1]."""
LIKE_KM_H = 0.03
"""Share by which a wheel speed in km/h differs from the speed over ground: wear, pressure and load of a tyre [1]."""
FEWEST_SAMPLES = 10
"""Samples of a rolling wheel from which its radius is told [1]."""
FREE = 1.0
"""Deceleration up to which a wheel rolls without slip that counts [m/s^2]."""


def find_radius_problems(columns: Mapping[str, NDArray[np.float64]], interval: float) -> list[str]:
    """Return the problems of wheel speeds whose rolling radius is none of a road car's.

    Parameters
    ----------
    columns : moving means of the channels by name, each float64 [N], in campaign units
    interval : of their clock [s]
    """
    problems = []
    radii = {}
    for name in WHEELS:
        if (measured := _measure_radius(columns, name, interval)) is None:
            continue
        radius, is_free = measured
        low, high = ROLLING_RADIUS
        if radius < 0:
            problems.append(f"channel {name} is negative while the car drives forward: turn its sign over")
        elif not low < radius < high:
            problems.append(
                f"channels speed and {name} give a rolling radius of {radius:.3g} m, which must lie in {low:g} to"
                f" {high:g}: correct the unit of one of them"
            )
        elif is_free:
            radii[name] = radius
    if len(radii) == 2 and abs(np.log(radii["wheel_speed_front"] / radii["wheel_speed_rear"])) > AXLES_APART:
        front, rear = radii.values()
        problems.append(
            f"channels wheel_speed_front and wheel_speed_rear give rolling radii of {front:.3g} and {rear:.3g} m, which"
            f" must agree within {AXLES_APART:.0%}: correct the unit of one of them"
            + (" (one looks like km/h)" if min(abs(3.6 * front - 1), abs(3.6 * rear - 1)) < 0.01 else "")
        )
    return problems


def describe_km_h(
    runs: Mapping[str, Mapping[str, NDArray[np.float64]]], interval: float, units: Mapping[str, str]
) -> list[str]:
    """Return warnings of wheel speeds in km/h that a map takes for rad/s: 1/3.6 m is a small tyre's radius too.

    Parameters
    ----------
    runs : channels of each run by name, each float64 [N], in campaign units
    interval : of their clock [s]
    units : the unit that the map gives each channel
    """
    warnings = []
    for name in WHEELS:
        measured = [_measure_radius(columns, name, interval) for columns in runs.values()]
        radii = [found[0] for found in measured if found is not None]
        if units.get(name) == "rad/s" and radii and abs(3.6 * np.median(radii) - 1.0) < LIKE_KM_H:
            warnings.append(
                f"channel {name} looks like km/h: speed over it is {np.median(radii):.3g} m, which is 1/3.6: give"
                " unit: km/h and gain: {value: 1/(3.6 x rolling radius in m), unit: rad/s}, unless the tyres are as"
                " small"
            )
    return warnings


def describe_wheel_gain(channel: str, unit: str) -> str:
    """Return the end of a sentence with the gain of a wheel that is logged as a speed of the car; empty for others.

    Parameters
    ----------
    channel : name
    unit : of the logged signal
    """
    dimension, size = UNITS.get(unit, ("", 0.0))
    if channel not in WHEELS or dimension != "speed":
        return ""
    over = "1/(3.6 x radius)" if unit == "km/h" else f"{size:.3g}/radius"
    return f", here of the value {over}, the tyre's rolling radius in m, and the unit rad/s"


def _measure_radius(
    columns: Mapping[str, NDArray[np.float64]], name: str, interval: float
) -> tuple[float, bool] | None:
    """Return the rolling radius [m] and whether the wheel rolled without slip; None where it hardly rolls."""
    if name not in columns or "speed" not in columns:
        return None
    rolling = (columns["speed"] > MOVING) & (np.abs(columns[name]) > 1e-3)
    if np.count_nonzero(rolling) < FEWEST_SAMPLES:
        return None
    free = rolling & (np.gradient(columns["speed"], interval) > -FREE)
    is_free = bool(np.count_nonzero(free) >= FEWEST_SAMPLES)
    taken = free if is_free else rolling
    return float(np.median(columns["speed"][taken] / columns[name][taken])), is_free
