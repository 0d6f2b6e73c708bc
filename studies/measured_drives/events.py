"""Braking events of a recording: windows about the onset of an episode, and the baselines before it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.segments import Episode, find_pressure_episodes
from tasks.surface.weather import DRY, Weather

Window = tuple[float, float]
DRY_ROAD = Weather(kind=DRY)
ROUNDING = 1e-6
"""Windows include a sample that misses their edge by less than this [s]."""


@dataclass(frozen=True, kw_only=True)
class Rule:
    """One criterion that every retained event satisfies.

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
        """Return whether a measured value satisfies the rule."""
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
class RecordedRun:
    """One recorded run with the drive that it belongs to.

    Parameters
    ----------
    name : of the run
    drive : name of the drive; cross-validation leaves out complete drives
    interval : time between samples [s]
    columns : channels by name, each float64 [N]
    weather : on the road
    """

    name: str
    drive: str
    interval: float
    columns: Mapping[str, NDArray[np.float64]]
    weather: Weather = DRY_ROAD


@dataclass(frozen=True, kw_only=True)
class Event:
    """One braking event with its analysis window cut out; time 0 is the brake onset.

    Parameters
    ----------
    run, drive : its run and drive
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
    weather: Weather = DRY_ROAD

    def mask_window(self, window: Window) -> NDArray[np.bool_]:
        """Return the mask of the samples in a window about the onset [s]."""
        inside: NDArray[np.bool_] = (self.time >= window[0] - ROUNDING) & (self.time <= window[1] + ROUNDING)
        return inside

    def subtract_baseline(self, channel: str) -> NDArray[np.float64]:
        """Return a channel less its median over the baseline window, float64 [N]."""
        values = self.columns[channel]
        return values - float(np.median(values[self.mask_window(self.protocol.baseline)]))

    @property
    def pitch_baseline(self) -> tuple[float, float]:
        """Slope [deg/s] and value at the onset [deg] of the line through the pitch before the event."""
        before = self.mask_window(self.protocol.baseline)
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


def find_events(drive: RecordedRun, protocol: Protocol) -> tuple[int, list[Event]]:
    """Return the number of pressure episodes of a run, and the events whose analysis window it covers.

    Parameters
    ----------
    drive : the run
    protocol : windows
    """
    pressure = drive.columns["brake_pressure"]
    time: NDArray[np.float64] = np.arange(len(pressure), dtype=np.float64) * drive.interval
    episodes = find_pressure_episodes(
        time, pressure, threshold=protocol.onset_pressure, merge_gap=protocol.merge_gap
    )
    cut = [_cut_event(drive, time, episode, protocol) for episode in episodes]
    return len(episodes), [event for event in cut if event is not None]


def _cut_event(
    drive: RecordedRun, time: NDArray[np.float64], episode: Episode, protocol: Protocol
) -> Event | None:
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
