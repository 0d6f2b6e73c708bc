"""Validation of measured channels, imported or of a campaign: rules on arrays, problems in sentences."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.brake_validation import MOVING, find_brake_problems
from tasks.campaign.channels import CHANNELS_BY_NAME, UNITS
from tasks.campaign.pair_validation import (
    HALF_GRAVITY,
    find_axis_problems,
    find_pair_problems,
    find_pitch_problems,
)
from tasks.campaign.signals import Signal
from tasks.campaign.time_of_day import TIME_OF_DAY, looks_like_time_of_day
from tasks.campaign.torque_validation import find_torque_problems
from tasks.campaign.wheel_validation import find_radius_problems

DIGITS_OF_DAY = (
    "has a clock that jumps by 40 at each minute, because its numbers are the digits of hours, minutes and seconds:"
    f" give unit: {TIME_OF_DAY} under time in the map"
)
"""Problem of a time of day that is taken for seconds."""
FEW = 0.05
"""Share of samples beyond what a road car does up to which they are faults of their own, and not of the unit [1]."""
GAP_STEPS = 5.0
"""A step between samples longer than this many median steps is a gap."""
FROZEN_SECONDS = 0.5
FROZEN_DWELLS = 20.0
"""A frozen sensor holds a value this long, and this many times longer than usual."""
SHORT_FREEZE_SECONDS = 0.25
"""This long suffices for a sensor that hardly holds values: it must be as many times longer than 95 % of the holds."""
ROUNDING_STEP = 1e-6
"""Share of the largest value below which a step is rounding of a resampled value, and no step of the sensor [1]."""
SMOOTHING = 0.2
"""Width of the mean over which two channels are compared [s]."""
LARGEST_ACCELERATION, LARGEST_CORRECTION = 20.0, 0.5
"""Rate [m/s^2] and correction [m/s] by which speed changes at once at most, besides ten usual steps of its sensor."""


def find_signal_problems(signal: Signal) -> list[str]:
    """Return the problems of one signal on its own clock: empty, gaps, clock jumps, values that are not numbers.

    Parameters
    ----------
    signal : within the run's window
    """
    if len(signal.time) < 2:
        return [f"has {len(signal.time)} samples in the run; it needs at least 2: is the window right?"]
    problems = []
    bad = ~np.isfinite(signal.values)
    if bad.any():
        at = float(signal.time[np.argmax(bad)])
        problems.append(
            f"has {np.count_nonzero(bad)} samples that are not numbers, the first at {at:.3f} s: cut the run there"
        )
    return problems + find_clock_problems(signal)


def find_clock_problems(signal: Signal) -> list[str]:
    """Return the problems of a signal's clock: gaps, and times that do not advance.

    Parameters
    ----------
    signal : of at least 2 samples
    """
    if looks_like_time_of_day(signal.time):
        return [DIGITS_OF_DAY]
    problems = []
    steps = np.diff(signal.time)
    usual = float(np.median(steps))
    back = np.flatnonzero(steps <= 0)
    if back.size:
        at = back[0]
        problems.append(
            f"has a clock that does not advance at {back.size} samples, first from {signal.time[at]:.3f} to"
            f" {signal.time[at + 1]:.3f} s: {_say_what_to_do(steps[back])}"
        )
    gaps = np.flatnonzero(steps > GAP_STEPS * max(usual, 1e-9)) if usual > 0 else np.array([], dtype=np.int64)
    if gaps.size:
        at = gaps[np.argmax(steps[gaps])]
        problems.append(
            f"has {gaps.size} gaps or forward jumps of its clock, the largest from {signal.time[at]:.3f} to"
            f" {signal.time[at + 1]:.3f} s where samples come every {usual:.3g} s: cut the run there"
        )
    return problems


def _say_what_to_do(back: NDArray[np.float64]) -> str:
    """Return what to do about steps of a clock that does not advance; float64 [N] [s]."""
    if np.any(back < 0):
        return "cut the run there"
    return "give repeats: keep_first under time in the map if the logger stamps samples twice, else cut the run there"


def find_outliers(name: str, logged: Signal, converted: Signal) -> list[str]:
    """Return the problem of a few samples beyond what a road car does, as a logger's number for no value is.

    Parameters
    ----------
    name : channel
    logged : as the logger wrote it
    converted : the same in the channel's unit
    """
    channel = CHANNELS_BY_NAME[name]
    beyond = (converted.values > channel.limit) | (converted.values < min(channel.lowest, -channel.limit))
    beyond &= np.isfinite(converted.values)
    if not 0 < np.count_nonzero(beyond) <= FEW * len(beyond):
        return []
    at = int(np.argmax(beyond))
    return [
        f"has {np.count_nonzero(beyond)} samples beyond what a road car does (limit {channel.limit:g} {channel.unit}),"
        f" the first at {logged.time[at]:.3f} s of {logged.values[at]:.10g}: cut the run there; where the logger writes"
        f' it for no value, give values: {{"{logged.values[at]:.10g}": null}} of the channel'
    ]


def find_frozen_problem(name: str, signal: Signal, speed: Signal | None) -> str | None:
    """Return the problem of a sensor that held one value while the car moved; None if there is none.

    Parameters
    ----------
    name : channel
    signal : its samples
    speed : of the car [m/s]; None takes the car to move all the time
    """
    if not CHANNELS_BY_NAME[name].moves or len(signal.time) < 3:
        return None
    moving = np.ones(len(signal.time), dtype=bool)
    if speed is not None and len(speed.time) > 1:
        moving = np.interp(signal.time, speed.time, speed.values) > MOVING
    differences = np.abs(np.diff(signal.values))
    changes = np.flatnonzero(differences > ROUNDING_STEP * float(np.max(np.abs(signal.values))))
    edges = np.concatenate(([0], changes + 1, [len(signal.time) - 1]))
    dwells = np.diff(signal.time[edges])
    usual, most = np.quantile(dwells, (0.5, 0.95)) if len(changes) > 2 else (0.0, np.inf)
    jumps = differences[changes]
    beside = np.maximum(np.concatenate(([0.0], jumps)), np.concatenate((jumps, [0.0])))
    # a coarse sensor holds a value until its next step; after a freeze the next step is larger
    step = max(float(jumps.min()), _find_smallest_step(signal.values, changes)) if len(changes) > 2 else 0.0
    coarse = beside < 1.5 * step
    locked = signal.values[edges[:-1]] == 0.0  # a locked wheel reads 0 for a while
    held = (dwells >= FROZEN_SECONDS) & (dwells >= FROZEN_DWELLS * usual)
    held |= (dwells >= SHORT_FREEZE_SECONDS) & (dwells >= FROZEN_DWELLS * most) & ~locked
    long = np.flatnonzero(held & ~coarse & moving[edges[:-1]])
    if not long.size:
        return None
    at = long[np.argmax(dwells[long])]
    wheel = bool(locked[at]) and name.startswith("wheel_speed")
    said = "stands still, as a locked wheel or a dead sensor does" if wheel else "is frozen"
    return (
        f"{said}: it holds {signal.values[edges[at]]:.4g} for {dwells[at]:.2f} s from {signal.time[edges[at]]:.3f} s"
        " while the car moves: cut the run there, or leave the channel out"
    )


def _find_smallest_step(values: NDArray[np.float64], changes: NDArray[np.int64]) -> float:
    """Return the smallest change of a sensor, where one that a resampling split between two samples counts as one.

    Parameters
    ----------
    values : float64 [N]
    changes : samples after which the value is another one, int64 [M]
    """
    follows = np.diff(changes) == 1
    pairs = np.abs(values[changes[:-1] + 2 * follows] - values[changes[:-1]])[follows]
    alone = ~np.concatenate(([False], follows)) & ~np.concatenate((follows, [False]))
    whole = (changes > 0) & (changes < len(values) - 2)  # a run may begin or end within a split step
    single = np.abs(values[changes + 1] - values[changes])[alone & whole]
    return float(np.min(np.concatenate((pairs, single)), initial=np.inf))


def find_plausibility_problems(
    columns: Mapping[str, NDArray[np.float64]], interval: float, units: Mapping[str, str]
) -> list[str]:
    """Return wrong units and signs, by magnitude and by other channels; every sentence names its channel.

    Parameters
    ----------
    columns : channels on a common clock, each float64 [N], in campaign units
    interval : of the clock [s]
    units : the unit that each channel's values were taken to be in
    """
    stands_in = UNITS[units.get("brake_pressure", "MPa")][0] != "pressure"
    problems = _find_step_problems(columns, interval)
    for name, values in columns.items():
        channel = CHANNELS_BY_NAME[name]
        if name == "brake_pressure" and stands_in:
            continue  # a command or torque in its place has a scale that nobody knows
        unit = "" if channel.unit == "1" else f" {channel.unit}"
        peak = float(np.max(np.abs(values)))
        if peak > channel.limit:
            problems.append(
                f"channel {name} reaches {peak:.4g}{unit}, which no road car does (limit {channel.limit:g}):"
                " correct its unit or scale"
            )
        elif (low := float(np.min(values))) < channel.lowest:
            problems.append(
                f"channel {name} falls to {low:.4g}{unit}, which no road car does (limit {channel.lowest:g}):"
                " turn its sign over, or correct its offset"
            )
    smooth = {name: smooth_channel(values, interval) for name, values in columns.items()}
    problems += find_radius_problems(smooth, interval)
    problems += find_brake_problems(columns, smooth, interval, stands_in=stands_in)
    problems += find_torque_problems(smooth, interval, stands_in=stands_in)
    if "speed" in smooth:
        rate = np.gradient(smooth["speed"], interval)
        if "longitudinal_acceleration" in smooth:
            felt = smooth["longitudinal_acceleration"]
            taken = units["longitudinal_acceleration"], units.get("speed", "m/s")
            problems += find_pair_problems(
                "longitudinal_acceleration", felt, "the rate of speed", rate, 0.8, *taken
            ) or find_axis_problems(felt, rate)
        if "pitch" in smooth:
            problems += find_pitch_problems(smooth, rate, interval)
    if "pitch" in smooth and "pitch_rate" in smooth:
        slope = np.gradient(smooth["pitch"], interval)
        problems += find_pair_problems(
            "pitch_rate", smooth["pitch_rate"], "the slope of pitch", slope, 0.8, units["pitch_rate"]
        )
    if "vertical_acceleration" in smooth:
        mean = float(np.mean(smooth["vertical_acceleration"]))
        if abs(mean) > HALF_GRAVITY:
            problems.append(
                f"channel vertical_acceleration must exclude gravity; its mean is {mean:.2f} m/s^2:"
                f" take it out, by an offset of {-mean:.2f}"
            )
    return problems


def _find_step_problems(columns: Mapping[str, NDArray[np.float64]], interval: float) -> list[str]:
    """Return the problem of a speed that jumps while its clock does not: samples are lost."""
    if "speed" not in columns:
        return []
    steps = np.abs(np.diff(columns["speed"]))
    usual = float(np.median(steps[steps > 0])) if steps.any() else 0.0
    wrong = np.flatnonzero(steps > LARGEST_ACCELERATION * interval + LARGEST_CORRECTION + 10 * usual)
    if not wrong.size:
        return []
    at = wrong[np.argmax(steps[wrong])]
    return [
        f"channel speed must not jump; {wrong.size} steps do, the largest by {steps[at]:.3g} m/s at sample {at + 1}"
        f" ({(at + 1) * interval:.3f} s into the run): samples are lost or its clock jumps, cut the run there"
    ]


def smooth_channel(values: NDArray[np.float64], interval: float) -> NDArray[np.float64]:
    """Return the mean of a channel over `SMOOTHING`, or half of a shorter run, where the whole window lies within it.

    That is float64 [M], of which a run of two samples and more has two.

    Parameters
    ----------
    values : float64 [N]
    interval : of their clock [s]
    """
    width = max(min(round(SMOOTHING / interval), len(values) // 2), 1)
    return np.convolve(values, np.ones(width) / width, mode="valid")
