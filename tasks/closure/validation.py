"""What can be wrong in a measured run: each rule looks at plain arrays and answers with sentences."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.closure.campaign import CHANNEL_UNITS, CHANNELS

COLUMN_UNITS = {"time": "s", "brake_pressure": "MPa", **dict(zip(CHANNELS, CHANNEL_UNITS, strict=True))}
PLAUSIBLE = {
    "brake_pressure": 25.0, "speed": 90.0, "longitudinal_acceleration": 20.0, "wheel_speed_front": 400.0,
    "wheel_speed_rear": 400.0, "pitch": 15.0, "pitch_rate": 150.0, "vertical_acceleration": 60.0,
}  # fmt: skip
"""Magnitudes that no road car exceeds in the column's unit: beyond them the unit is taken to be wrong."""
FREEZE_SAMPLES = 50
BRAKING = 0.5
"""Mean deceleration from which pitch must be nose-down [m/s^2]."""


def run_problems(
    columns: Mapping[str, NDArray[np.float64]], units: Mapping[str, str], interval: float
) -> list[str]:
    """Every problem of one run, one sentence each; empty when it can be used.

    Parameters
    ----------
    columns : measured columns by name, each float64 [N]
    units : units from the file's metadata, by column; a column without one is taken on trust
    interval : declared time between samples [s]
    """
    absent = [name for name in COLUMN_UNITS if name not in columns]
    if absent:
        return [f"channel {name} is missing" for name in absent]
    if len(columns["time"]) < 100:
        return [f"a run needs at least 100 samples; it has {len(columns['time'])}"]
    problems = [
        f"channel {name} must be in {unit}; its metadata says {units[name]}"
        for name, unit in COLUMN_UNITS.items()
        if name in units and units[name] != unit
    ]
    for name in COLUMN_UNITS:
        bad = int(np.count_nonzero(~np.isfinite(columns[name])))
        if bad:
            problems.append(f"channel {name} has a gap: {bad} samples are not finite")
    if problems:
        return problems
    problems += _clock_problems(columns["time"], interval)
    problems += _magnitude_problems(columns)
    problems += _frozen_problems(columns)
    return problems + _sign_problems(columns)


def _clock_problems(time: NDArray[np.float64], interval: float) -> list[str]:
    steps = np.diff(time)
    wrong = np.flatnonzero(np.abs(steps - interval) > 0.1 * interval)
    if not wrong.size:
        return []
    at = wrong[0]
    return [
        f"channel time must advance by {interval:g} s; {wrong.size} steps do not, the first from {time[at]:.3f}"
        f" to {time[at + 1]:.3f} s: resample the run, or cut it there"
    ]


def _magnitude_problems(columns: Mapping[str, NDArray[np.float64]]) -> list[str]:
    problems = []
    for name, limit in PLAUSIBLE.items():
        peak = float(np.max(np.abs(columns[name])))
        if peak > limit:
            problems.append(
                f"channel {name} reaches {peak:.4g} {COLUMN_UNITS[name]}, beyond {limit:g}: is the unit right?"
            )
    speed, wheel = columns["speed"][:30].mean(), columns["wheel_speed_front"][:30].mean()
    if speed > 3.0 and not 0.2 < speed / max(wheel, 1e-6) < 0.6:
        problems.append(
            f"channels speed and wheel_speed_front give a rolling radius of {speed / max(wheel, 1e-6):.3g} m:"
            " is one of them in another unit?"
        )
    slope = np.gradient(columns["pitch"], columns["time"])
    rate = columns["pitch_rate"]
    moving = np.std(rate) > 0.5
    if moving:
        ratio = float(np.dot(_smooth(slope), _smooth(rate)) / np.dot(_smooth(rate), _smooth(rate)))
        if not 0.4 < ratio < 2.5:
            problems.append(
                f"the slope of pitch is {ratio:.3g} times pitch_rate: their units or signs differ"
            )
    return problems


def _frozen_problems(columns: Mapping[str, NDArray[np.float64]]) -> list[str]:
    moving = columns["speed"] > 2.0
    problems = []
    for name in CHANNELS:
        same = np.concatenate(([0], ((np.diff(columns[name]) == 0.0) & moving[1:]).astype(np.int64)))
        longest = 0
        length = 0
        for flag in same:
            length = length + 1 if flag else 0
            longest = max(longest, length)
        if longest >= FREEZE_SAMPLES:
            problems.append(
                f"channel {name} is frozen: {longest + 1} equal samples in a row while the car moves"
            )
    return problems


def _sign_problems(columns: Mapping[str, NDArray[np.float64]]) -> list[str]:
    pressed = (columns["brake_pressure"] > 0.3) & (columns["speed"] > 2.0)
    if np.count_nonzero(pressed) < 30:
        return []
    problems = []
    time, speed = columns["time"][pressed], columns["speed"][pressed]
    deceleration = -float(np.polyfit(time, speed, 1)[0])
    rest = columns["brake_pressure"] < 0.05
    before = rest & (np.cumsum(pressed) == 0)
    reference = float(np.mean(columns["pitch"][before])) if before.any() else 0.0
    pitch = float(np.mean(columns["pitch"][pressed])) - reference
    if deceleration > BRAKING and pitch < -0.1 * deceleration / 9.81:
        problems.append(
            f"channel pitch must be nose-down positive; under braking at {deceleration:.1f} m/s^2 it is {pitch:.2f} deg"
        )
    measured = float(np.mean(columns["longitudinal_acceleration"][pressed]))
    if deceleration > BRAKING and measured > 0.0:
        problems.append(
            f"channel longitudinal_acceleration must be negative under braking; its mean is {measured:.2f} m/s^2"
            f" while speed falls at {deceleration:.1f} m/s^2"
        )
    return problems


def _smooth(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.convolve(x - x.mean(), np.ones(10) / 10, mode="valid")
