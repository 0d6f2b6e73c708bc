"""Assembly of one run's columns from a file's signals, with every problem of the run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import LEAST_SAMPLES
from tasks.campaign.channel_validation import (
    DIGITS_OF_DAY,
    find_frozen_problem,
    find_outliers,
    find_plausibility_problems,
    find_signal_problems,
)
from tasks.campaign.dead_sources import find_dead_sources
from tasks.campaign.derived_acceleration import is_rate_of_speed
from tasks.campaign.held_inputs import take_samples
from tasks.campaign.signals import (
    ChannelRule,
    Signal,
    convert_to_channel,
    make_common_clock,
    resample_on_clock,
)
from tasks.campaign.slow_channels import clear_between_samples

LEAST_COVERED = 0.9
"""Share of a run that each of its channels covers at least, where its own last step at either end counts [1]."""
HIGHEST_RATIO = 1.25
"""Of a campaign's rate over that of the fastest signal, whose samples need not be even [1]: a log of 20 Hz that was put
on 80 Hz gave another verdict, with a fiftieth of the interval."""


@dataclass(frozen=True, kw_only=True)
class Assembled:
    """One run on a common clock, or its problems.

    Parameters
    ----------
    start : the logger's time of the first sample, delays taken off [s]
    columns : channels by name, each float64 [N], in campaign units, NaN between the samples of a slow channel; empty
        if there are problems
    readable : channels that can be read, each float64 [N], in campaign units, with values between the
        samples of a slow channel too: for the checks that need all runs
    problems : one sentence each
    of_map : one of them is told by the channels together, so that the map may be wrong for every run
    computed : the logger computed the acceleration from the speed
    """

    start: float
    columns: dict[str, NDArray[np.float64]]
    readable: dict[str, NDArray[np.float64]]
    problems: tuple[str, ...]
    of_map: bool = False
    computed: bool = False


def assemble_run(
    signals: Mapping[str, Signal], rules: Sequence[ChannelRule], start: float, end: float, rate: float
) -> Assembled:
    """Bring one stretch of a recording onto a common clock.

    Parameters
    ----------
    signals : logged signals by name
    rules : the channel map
    start, end : limits of the run in the logger's time, delays taken off; infinite for the whole recording [s]
    rate : of the run [Hz]
    """
    found: list[tuple[str, str]] = []
    parts: dict[str, list[Signal]] = {}
    for rule in rules:
        first, last = start + rule.delay, end + rule.delay
        logged = [take_samples(rule.channel, signals[name]).cut_window(first, last) for name in rule.sources]
        for signal in logged:
            found += [(rule.channel, problem) for problem in find_signal_problems(signal)]
        parts[rule.channel] = [convert_to_channel(signal, rule) for signal in logged]
        if rule.gain is None:
            pairs = zip(logged, parts[rule.channel], strict=True)
            found += [(rule.channel, told) for pair in pairs for told in find_outliers(rule.channel, *pair)]
        found += [(rule.channel, problem) for problem in find_dead_sources(rule, parts[rule.channel])]
    if not any(problem == DIGITS_OF_DAY for _, problem in found):
        found += _find_frozen_channels(parts)
    problems = _write_sentences(found)
    usable = {channel: signals for channel, signals in parts.items() if not _is_unreadable(signals)}
    if not usable:
        return Assembled(start=start, columns={}, readable={}, problems=tuple(problems))
    problems += _find_short_channels(usable)
    problems += _find_high_rate(usable, rate)
    clock = make_common_clock([signal for signals in usable.values() for signal in signals], rate)
    if len(clock) < LEAST_SAMPLES:
        problems.append(
            f"has {len(clock)} samples at {rate:g} Hz that all channels share; a run needs {LEAST_SAMPLES}, which take"
            f" {LEAST_SAMPLES / rate:.3g} s: widen its window, log faster, or correct the unit of time"
        )
        return Assembled(start=start, columns={}, readable={}, problems=tuple(problems))
    columns = {
        channel: np.mean([resample_on_clock(signal, clock) for signal in signals], axis=0)
        for channel, signals in usable.items()
    }
    broken = {channel for channel, _ in found}
    whole = {channel: values for channel, values in columns.items() if channel not in broken}
    units = {rule.channel: rule.unit for rule in rules}
    if any(rule.channel == "brake_pressure" and rule.gain is not None for rule in rules):
        units["brake_pressure"] = "1"  # what stands for it has a scale that nobody knows
    of_map = find_plausibility_problems(whole, 1.0 / rate, units)
    if problems or of_map:
        return Assembled(
            start=float(clock[0]),
            columns={},
            readable=whole,
            problems=(*problems, *of_map),
            of_map=bool(of_map),
        )
    cleared = {
        name: clear_between_samples(name, values, usable[name], clock) for name, values in columns.items()
    }
    computed = _is_acceleration_computed(parts, rules)
    return Assembled(start=float(clock[0]), columns=cleared, readable=whole, problems=(), computed=computed)


def _write_sentences(found: list[tuple[str, str]]) -> list[str]:
    """Write one sentence per problem; channels of one clock share its faults, so they share the sentence."""
    channels: dict[str, list[str]] = {}
    for channel, problem in found:
        if channel not in channels.setdefault(problem, []):
            channels[problem].append(channel)
    return [
        f"channel{'s' if len(names) > 1 else ''} {', '.join(names)}: {problem}"
        for problem, names in channels.items()
    ]


def _find_frozen_channels(parts: Mapping[str, list[Signal]]) -> list[tuple[str, str]]:
    speed = parts["speed"][0] if "speed" in parts else None
    return [
        (channel, problem)
        for channel, signals in parts.items()
        for signal in signals
        if len(signal.time) > 2 and (problem := find_frozen_problem(channel, signal, speed)) is not None
    ]


def _is_acceleration_computed(parts: Mapping[str, list[Signal]], rules: Sequence[ChannelRule]) -> bool:
    """Return whether the acceleration is the rate of the speed, on the logger's time of both."""
    name = "longitudinal_acceleration"
    delays = {rule.channel: rule.delay for rule in rules}
    if not {name, "speed"} <= parts.keys():
        return False
    acceleration, speed = (
        Signal(time=parts[channel][0].time + delays[channel], values=parts[channel][0].values)
        for channel in (name, "speed")
    )
    return is_rate_of_speed(acceleration, speed)


def _find_short_channels(parts: Mapping[str, list[Signal]]) -> list[str]:
    """Return a sentence for each channel without which the run would be longer: a sensor that fell silent.

    A receiver of 1 Hz has its first and its last sample up to a second within the run.
    """
    spans = {
        channel: (
            max(float(s.time[0]) for s in signals),
            min(float(s.time[-1]) for s in signals),
            max(float(np.median(np.diff(s.time))) for s in signals),
        )
        for channel, signals in parts.items()
    }
    first, last = min(start for start, _, _ in spans.values()), max(end for _, end, _ in spans.values())
    return [
        f"channel {channel}: has samples from {start:.3f} to {end:.3f} s of a run from {first:.3f} to {last:.3f} s: cut"
        " the run there, or leave the channel out"
        for channel, (start, end, step) in spans.items()
        if min(end + step, last) - max(start - step, first) < LEAST_COVERED * (last - first)
    ]


def _find_high_rate(parts: Mapping[str, list[Signal]], rate: float) -> list[str]:
    """Return the problem of a rate at which most samples of every channel would lie between measured ones."""
    fastest = min(float(np.median(np.diff(s.time))) for signals in parts.values() for s in signals)
    if rate * fastest <= HIGHEST_RATIO:
        return []
    return [
        f"sample_rate_hz must not be above the rate of the fastest signal, {1.0 / fastest:.4g} Hz; it is {rate:g}:"
        " lower it, because samples between samples would count as measurements"
    ]


def _is_unreadable(signals: list[Signal]) -> bool:
    return any(
        len(s.time) < 2 or not np.isfinite(s.values).all() or bool((np.diff(s.time) <= 0).any())
        for s in signals
    )
