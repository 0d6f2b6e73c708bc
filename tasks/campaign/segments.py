"""Segments of a whole drive, one per brake application, and why some of them are no runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import MASKED_SPEED
from tasks.campaign.channels import BRAKE_SIGNALS
from tasks.campaign.checks import CheckTable, apply_checks
from tasks.campaign.measured import LoggedSignal
from tasks.campaign.signals import ChannelRule, Signal, average_sources, convert_to_channel
from tasks.campaign.slow_channels import take_samples

IDLING = 0.1
"""Share of the range of a brake signal, from its lowest, in which it is for a quarter of a drive if it idles [1]."""


@dataclass(frozen=True, kw_only=True)
class Episode:
    """One application of the brake.

    Parameters
    ----------
    onset : index of the first active sample
    onset_time, end_time : times of the first and the last active sample [s]
    """

    onset: int
    onset_time: float
    end_time: float

    @property
    def duration(self) -> float:
        """Time from the first to the last active sample [s]."""
        return self.end_time - self.onset_time


def find_pressure_episodes(
    time: NDArray[np.float64], pressure: NDArray[np.float64], *, threshold: float, merge_gap: float
) -> tuple[Episode, ...]:
    """Return the episodes of samples at or above a threshold, merged over short gaps (paper, Appendix C.5).

    Parameters
    ----------
    time : float64 [N] ascending [s]
    pressure : float64 [N] [MPa]
    threshold : smallest active pressure [MPa]
    merge_gap : active samples at most this far apart belong together [s]
    """
    active = np.flatnonzero(pressure >= threshold)
    if not active.size:
        return ()
    # the paper's gap is a time difference of samples, with the rounding of binary fractions
    breaks = np.flatnonzero(np.diff(time[active]) > merge_gap + 1e-9)
    firsts = active[np.concatenate(([0], breaks + 1))]
    lasts = active[np.concatenate((breaks, [active.size - 1]))]
    return tuple(
        Episode(onset=int(first), onset_time=float(time[first]), end_time=float(time[last]))
        for first, last in zip(firsts, lasts, strict=True)
    )


@dataclass(frozen=True, kw_only=True)
class SegmentRule:
    """How a drive is cut.

    Parameters
    ----------
    threshold : pressure from which the brake counts as applied, or what stands for it [MPa]
    merge_gap : applied samples at most this far apart are one application [s]
    minimum : duration of an application from which it is a segment [s]
    before, after : time of the segment before and after its application [s]
    """

    threshold: float
    merge_gap: float
    minimum: float
    before: float
    after: float


@dataclass(frozen=True, kw_only=True)
class Segment:
    """One brake application with the time about it.

    Parameters
    ----------
    start, end : in the logger's time, delays taken off [s]
    fault : why it is no run; empty where it is one
    """

    start: float
    end: float
    fault: str = ""


def find_brake_rule(rules: Sequence[ChannelRule]) -> ChannelRule | None:
    """Return the rule of the best brake signal that a map names; None if it names none.

    Parameters
    ----------
    rules : the channel map
    """
    by_channel = {rule.channel: rule for rule in rules}
    return next((by_channel[name] for name in BRAKE_SIGNALS if name in by_channel), None)


def cut_segments(
    signals: Mapping[str, Signal],
    rules: Sequence[ChannelRule],
    brake: ChannelRule,
    cut: SegmentRule,
    table: CheckTable,
) -> list[Segment]:
    """Return the segments of one recording, none of which begins before the end of the one before it.

    Parameters
    ----------
    signals : logged signals by name
    rules : the channel map
    brake : of the signal at which the drive is cut
    cut : how
    table : of checks
    """
    applied = average_sources(signals, brake)
    if not len(applied.time):
        return []
    pressure = BRAKE_SIGNALS[brake.channel] * applied.values
    lowest, low, highest = np.nanquantile(pressure, (0.0, 0.25, 1.0))
    if lowest >= cut.threshold and low <= lowest + IDLING * (highest - lowest):
        fault = (
            f"channel {brake.channel} never falls below {brake.describe_pressure(lowest)}: above_mpa must be more than"
            f" it idles at; it is {brake.describe_pressure(cut.threshold)}"
        )
        return [Segment(start=float(applied.time[0]), end=float(applied.time[-1]), fault=fault)]
    episodes = find_pressure_episodes(
        applied.time, pressure, threshold=cut.threshold, merge_gap=cut.merge_gap
    )
    parts = _convert_signals(signals, rules)
    speed = next((signal for channel, signal in parts if channel == "speed"), None)
    first, last = float(applied.time[0]), float(applied.time[-1])
    segments: list[Segment] = []
    long = [episode for episode in episodes if episode.duration >= cut.minimum]
    for episode, following in zip(long, [*long, None][1:], strict=True):
        start = max(episode.onset_time - cut.before, segments[-1].end if segments else first)
        end = min(episode.end_time + cut.after, last)
        if following is not None and end > following.onset_time:
            end = 0.5 * (episode.end_time + following.onset_time)
        segments.append(_judge_segment(Segment(start=start, end=end), episode, speed, parts, table))
    return segments


def _judge_segment(
    segment: Segment,
    episode: Episode,
    speed: Signal | None,
    parts: Sequence[tuple[str, Signal]],
    table: CheckTable,
) -> Segment:
    """Return a segment from where the car moves, or with its fault."""
    if speed is not None:
        lead = np.flatnonzero((speed.time >= segment.start) & (speed.time <= episode.onset_time))
        slow = lead[speed.values[lead] < MASKED_SPEED]
        if slow.size and slow[-1] == lead[-1]:
            return replace(
                segment,
                fault=f"the car stands, or is slower than {MASKED_SPEED:g} m/s, where the brake is applied",
            )
        if slow.size:
            segment = replace(segment, start=float(speed.time[slow[-1] + 1]))
    for channel, signal in parts:
        inside = signal.cut_window(segment.start, segment.end)
        if len(inside.time) < 2:
            return replace(segment, fault=f"channel {channel} has {len(inside.time)} samples in it")
        if violations := apply_checks(
            table.times, LoggedSignal(channel=channel, logged=inside, converted=inside)
        ):
            return replace(segment, fault=f"channel {channel} {violations[0].sentence}")
    return segment


def _convert_signals(signals: Mapping[str, Signal], rules: Sequence[ChannelRule]) -> list[tuple[str, Signal]]:
    """Return the signals that become channels, at their true times, with their channels."""
    return [
        (rule.channel, convert_to_channel(take_samples(rule.channel, signal), rule))
        for rule in rules
        for signal in (signals[name] for name in rule.sources)
    ]
