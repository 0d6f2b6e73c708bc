"""Validation of a campaign's run: its columns, their declared clock, and the rules for measured channels."""

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import LEAST_SAMPLES, MASKED_SPEED, find_motion
from tasks.campaign.channel_validation import (
    find_frozen_problem,
    find_plausibility_problems,
    find_signal_problems,
)
from tasks.campaign.channels import CHANNELS_BY_NAME
from tasks.campaign.signals import Signal
from tasks.campaign.slow_channels import fill_between_samples, mark_samples

COLUMN_UNITS = {"time": "s", **{name: channel.unit for name, channel in CHANNELS_BY_NAME.items()}}
CLOCK_STEP, CLOCK_DRIFT = 0.1, 0.001
"""Share by which a step, and a run, may be longer or shorter than declared [1]."""


def find_recording_problems(
    columns: Mapping[str, NDArray[np.float64]],
    units: Mapping[str, str],
    interval: float,
    needed: Collection[str],
    *,
    brake_stands_in: bool = False,
) -> list[str]:
    """Return every problem of one run, one sentence each; empty when it can be used.

    Parameters
    ----------
    columns : measured columns by name, each float64 [N]; NaN between the samples of a slow channel
    units : units from the file's metadata, by column; a column without one counts as correct
    interval : declared time between samples [s]
    needed : columns that there must be
    brake_stands_in : the brake pressure is another signal in its place, whose scale nobody knows
    """
    problems = [
        f"channel {name} is missing: if nobody measured it, list it under not_measured in campaign.yaml"
        for name in needed
        if name not in columns
    ]
    count = max((len(values) for values in columns.values()), default=0)
    if count < LEAST_SAMPLES:
        return [*problems, f"a run needs at least {LEAST_SAMPLES} samples; it has {count}"]
    misread = {name for name in columns if units.get(name, COLUMN_UNITS[name]) != COLUMN_UNITS[name]}
    problems += [
        f"channel {name} must be in {COLUMN_UNITS[name]}; its metadata says {units[name]}"
        for name in COLUMN_UNITS
        if name in misread
    ]
    if "time" in columns and "time" not in misread:
        problems += _find_clock_problems(columns["time"], interval)
    clock = interval * np.arange(count, dtype=np.float64)
    usable, signals = dict[str, NDArray[np.float64]](), dict[str, Signal]()
    for name in COLUMN_UNITS:
        if name == "time" or name not in columns:
            continue
        own = mark_samples(name, columns[name])
        signal = Signal(time=clock[own], values=columns[name][own])
        gaps = find_signal_problems(signal)
        problems += [f"channel {name} has a gap: it {problem}" for problem in gaps]
        if not gaps and name not in misread:
            usable[name], signals[name] = fill_between_samples(name, columns[name]), signal
    for name, signal in signals.items():
        frozen = find_frozen_problem(name, signal, signals.get("speed"))
        problems += [] if frozen is None else [f"channel {name} {frozen}"]
    taken = COLUMN_UNITS | ({"brake_pressure": "1"} if brake_stands_in else {})
    return problems + find_plausibility_problems(usable, interval, taken)


def find_motion_problem(speed: NDArray[np.float64], interval: float, has_feature: bool) -> str | None:
    """Return the problem of a run of which too little is used; None if there is enough.

    Parameters
    ----------
    speed : float64 [N] [m/s]
    interval : time between samples [s]
    has_feature : the road has a feature, whose place counts from the first sample
    """
    first, end = find_motion(speed)
    if end - first < LEAST_SAMPLES:
        return (
            f"channel speed must stay at or above {MASKED_SPEED:g} m/s for {LEAST_SAMPLES} samples, which take"
            f" {LEAST_SAMPLES * interval:.3g} s at {1.0 / interval:.3g} Hz; it does for {end - first}: leave the run"
            " out where the car stands or crawls; where it drives, log faster or take a longer run"
        )
    if first and has_feature:
        return (
            f"channel speed must begin at or above {MASKED_SPEED:g} m/s in a run with a road feature, whose place"
            f" counts from the first sample; it is slower for {first * interval:g} s: cut the run there"
        )
    return None


def _find_clock_problems(time: NDArray[np.float64], interval: float) -> list[str]:
    bad = ~np.isfinite(time)
    if bad.any():
        return [
            f"channel time has {np.count_nonzero(bad)} samples that are not numbers, the first at sample"
            f" {np.argmax(bad)}: cut the run there"
        ]
    wrong = np.flatnonzero(np.abs(np.diff(time) - interval) > CLOCK_STEP * interval)
    if wrong.size:
        at = wrong[0]
        return [
            f"channel time must advance by {interval:g} s; {wrong.size} steps do not, the first from {time[at]:.3f}"
            f" to {time[at + 1]:.3f} s: resample the run, or cut it there"
        ]
    declared, taken = (len(time) - 1) * interval, float(time[-1] - time[0])
    if abs(taken - declared) > max(CLOCK_DRIFT * declared, interval):
        return [
            f"channel time must advance by {interval:g} s; {len(time)} samples take {taken:.3f} s instead of"
            f" {declared:.3f} s: correct sample_rate_hz, or resample the run"
        ]
    return []
