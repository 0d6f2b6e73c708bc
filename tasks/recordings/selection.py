"""Braking events of a recording, the baselines before them, and conjunctive selection with its attrition."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan

import numpy as np
from numpy.typing import NDArray

from tasks.recordings.episodes import Episode, pressure_episodes
from tasks.surface.state import Weather

Window = tuple[float, float]
DRY = Weather(kind="dry", precipitation_mm_h=0.0, snow_accumulation_h=0.0)
ROUNDING = 1e-6
"""Windows include a sample that misses their edge by less than this [s]."""


@dataclass(frozen=True, kw_only=True)
class Rule:
    """One criterion that every retained event keeps.

    Parameters
    ----------
    name : quantity, of `QUANTITIES`
    criterion : for people
    limit : [the quantity's unit]
    is_minimum : the quantity must be at least the limit; else at most
    paper_fails : failures that the paper counts; None where it has no such rule
    """

    name: str
    criterion: str
    limit: float
    is_minimum: bool
    paper_fails: int | None

    def holds(self, value: float) -> bool:
        """Whether a measured value keeps the rule."""
        return value >= self.limit if self.is_minimum else value <= self.limit


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """Windows and rules of an evaluation of braking events (paper, Appendix C.5).

    Parameters
    ----------
    onset_pressure : smallest active pressure [MPa]
    merge_gap : active samples at most this far apart are one episode [s]
    analysis, baseline, evaluation, quality : windows about the onset [s]
    fixed_damping_ratio : of the pitch-only calibration [1]
    rules : all must hold
    """

    onset_pressure: float
    merge_gap: float
    analysis: Window
    baseline: Window
    evaluation: Window
    quality: Window
    fixed_damping_ratio: float
    rules: tuple[Rule, ...]


@dataclass(frozen=True, kw_only=True)
class Drive:
    """One run with the drive that it belongs to.

    Parameters
    ----------
    name : of the run
    drive : complete drives are what is left out
    interval : time between samples [s]
    columns : channels by name, each float64 [N]
    weather : on the road
    """

    name: str
    drive: str
    interval: float
    columns: Mapping[str, NDArray[np.float64]]
    weather: Weather = DRY


@dataclass(frozen=True, kw_only=True)
class Event:
    """One braking event with its analysis window cut out; time 0 is the brake onset.

    Parameters
    ----------
    run, drive : where it is from
    at : time of the onset in the run [s]
    duration : of the active pressure [s]
    time : float64 [N] about the onset [s]
    columns : channels in the window, each float64 [N]
    protocol : the windows
    weather : on the road
    """

    run: str
    drive: str
    at: float
    duration: float
    time: NDArray[np.float64]
    columns: Mapping[str, NDArray[np.float64]]
    protocol: Protocol
    weather: Weather = DRY

    def within(self, window: Window) -> NDArray[np.bool_]:
        """Mask of the samples in a window about the onset [s]."""
        inside: NDArray[np.bool_] = (self.time >= window[0] - ROUNDING) & (self.time <= window[1] + ROUNDING)
        return inside

    def change(self, channel: str) -> NDArray[np.float64]:
        """A channel less its median over the baseline window, float64 [N]."""
        values = self.columns[channel]
        return values - float(np.median(values[self.within(self.protocol.baseline)]))

    @property
    def pitch_baseline(self) -> tuple[float, float]:
        """Slope [deg/s] and value at the onset [deg] of the line through the pitch before the event."""
        before = self.within(self.protocol.baseline)
        slope, at_onset = np.polyfit(self.time[before], self.columns["pitch"][before], 1)
        return float(slope), float(at_onset)

    @property
    def dive(self) -> NDArray[np.float64]:
        """Nose-down change of pitch about the line before the event, float64 [N] [deg]."""
        slope, at_onset = self.pitch_baseline
        return self.columns["pitch"] - (at_onset + slope * self.time)

    @property
    def start_speed(self) -> float:
        """Speed at the onset [m/s]."""
        return float(self.columns["speed"][int(np.argmin(np.abs(self.time)))])


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """What a rule measures.

    Parameters
    ----------
    unit : of the result
    channels : that must have been measured
    measure : its function of an event
    """

    unit: str
    channels: tuple[str, ...]
    measure: Callable[[Event], float]


def _p95(event: Event, channel: str, window: Window) -> float:
    return float(np.percentile(np.abs(event.columns[channel][event.within(window)]), 95))


def _largest_rise(event: Event, channel: str, sign: float) -> float:
    inside = event.within(event.protocol.evaluation)
    return max(float(np.max(sign * event.change(channel)[inside])), 0.0)


def _onset_residual(event: Event) -> float:
    return float(abs(event.dive[int(np.argmin(np.abs(event.time)))]))


def _deviation(event: Event) -> float:
    return float(np.std(event.columns["pitch"][event.within(event.protocol.baseline)]))


def _quality(channel: str, unit: str) -> Quantity:
    return Quantity(
        unit=unit, channels=(channel,), measure=lambda event: _p95(event, channel, event.protocol.quality)
    )


QUANTITIES: dict[str, Quantity] = {
    "pressure_duration": Quantity(unit="s", channels=(), measure=lambda event: event.duration),
    "start_speed": Quantity(unit="m/s", channels=("speed",), measure=lambda event: event.start_speed),
    "pressure_increase": Quantity(
        unit="MPa", channels=(), measure=lambda event: _largest_rise(event, "brake_pressure", 1.0)
    ),
    "deceleration_increase": Quantity(
        unit="m/s^2",
        channels=("longitudinal_acceleration",),
        measure=lambda event: _largest_rise(event, "longitudinal_acceleration", -1.0),
    ),
    "steering_p95": _quality("steering_angle", "deg"),
    "yaw_rate_p95": _quality("yaw_rate", "deg/s"),
    "pitch_slope": Quantity(
        unit="deg/s", channels=("pitch",), measure=lambda event: abs(event.pitch_baseline[0])
    ),
    "pitch_deviation": Quantity(unit="deg", channels=("pitch",), measure=_deviation),
    "onset_residual": Quantity(unit="deg", channels=("pitch",), measure=_onset_residual),
    "vertical_acceleration_p95": _quality("vertical_acceleration", "m/s^2"),
    "roll_rate_p95": _quality("roll_rate", "deg/s"),
    "pressure_before_p95": Quantity(
        unit="MPa", channels=(), measure=lambda event: _p95(event, "brake_pressure", event.protocol.baseline)
    ),
}
"""What selection rules may measure (paper, Appendix C.5)."""


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One event held against every rule.

    Parameters
    ----------
    event : the event
    values : measured quantity by rule; NaN where its channel was not measured
    failed : names of the rules that it breaks
    """

    event: Event
    values: dict[str, float]
    failed: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Selection:
    """The events of a campaign and what became of them.

    Parameters
    ----------
    episodes : detected pressure episodes
    judged : those that support the analysis window, in order of drive and time
    unassessed : rules whose channel no run has
    """

    episodes: int
    judged: tuple[Judged, ...]
    unassessed: tuple[str, ...]

    @property
    def retained(self) -> tuple[Event, ...]:
        """Events that keep every rule that could be assessed."""
        return tuple(judged.event for judged in self.judged if not judged.failed)


def select_events(drives: Sequence[Drive], protocol: Protocol) -> Selection:
    """Detect, cut and judge the braking events of all drives.

    Parameters
    ----------
    drives : with at least brake_pressure, speed and pitch
    protocol : windows and rules
    """
    episodes, events = 0, []
    for drive in drives:
        found = drive_events(drive, protocol)
        episodes += found[0]
        events += found[1]
    judged = tuple(judge(event, protocol.rules) for event in events)
    unassessed = tuple(
        rule.name for rule in protocol.rules if judged and all(isnan(one.values[rule.name]) for one in judged)
    )
    return Selection(episodes=episodes, judged=judged, unassessed=unassessed)


def drive_events(drive: Drive, protocol: Protocol) -> tuple[int, list[Event]]:
    """Number of pressure episodes of a run, and those whose analysis window it covers.

    Parameters
    ----------
    drive : the run
    protocol : windows
    """
    pressure = drive.columns["brake_pressure"]
    time: NDArray[np.float64] = np.arange(len(pressure), dtype=np.float64) * drive.interval
    episodes = pressure_episodes(
        time, pressure, threshold=protocol.onset_pressure, merge_gap=protocol.merge_gap
    )
    cut = [_cut(drive, time, episode, protocol) for episode in episodes]
    return len(episodes), [event for event in cut if event is not None]


def judge(event: Event, rules: Sequence[Rule]) -> Judged:
    """Hold one event against every rule; a rule whose channel is missing is neither kept nor broken.

    Parameters
    ----------
    event : the event
    rules : all are tried, none ends the trial
    """
    values = {
        rule.name: QUANTITIES[rule.name].measure(event)
        if all(channel in event.columns for channel in QUANTITIES[rule.name].channels)
        else nan
        for rule in rules
    }
    failed = tuple(
        rule.name for rule in rules if not isnan(values[rule.name]) and not rule.holds(values[rule.name])
    )
    return Judged(event=event, values=values, failed=failed)


def _cut(drive: Drive, time: NDArray[np.float64], episode: Episode, protocol: Protocol) -> Event | None:
    about = time - episode.onset_time
    start, end = protocol.analysis
    if about[0] > start + ROUNDING or about[-1] < end - ROUNDING:
        return None
    inside = (about >= start - ROUNDING) & (about <= end + ROUNDING)
    return Event(
        run=drive.name,
        drive=drive.drive,
        at=episode.onset_time,
        duration=episode.duration,
        time=about[inside],
        columns={name: values[inside] for name, values in drive.columns.items()},
        protocol=protocol,
        weather=drive.weather,
    )
