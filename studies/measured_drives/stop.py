"""One measured stop: cut out of its run, and how far a prediction is from it."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from studies.measured_drives.events import RecordedRun
from tasks.campaign.segments import find_pressure_episodes

ACTIVE = 0.12
"""Pressure from which the brake is on, as in the paper's Appendix C.5 [MPa]."""
MASKED_SPEED = 2.0
"""Below it wheel speeds and inertial speed of a real car no longer agree [m/s]."""
STANDING_SPEED = 0.5
REBOUND_S = 0.8
"""How long the body is watched after the stop [s]."""


@dataclass(frozen=True, kw_only=True)
class Stop:
    """One measured stop, from a lead before the brake to the end of its run.

    Parameters
    ----------
    name : of the run
    interval : [s]
    columns : channels, each float64 [N]; pitch is about its median in the lead
    onset : sample of the brake onset
    """

    name: str
    interval: float
    columns: Mapping[str, NDArray[np.float64]]
    onset: int

    @property
    def slow(self) -> int:
        """First sample below the masked speed."""
        return int(np.argmax(self.columns["speed"] < MASKED_SPEED))


@dataclass(frozen=True, kw_only=True)
class StopErrors:
    """How far a prediction is from a measured stop; figures of motion end at 2 m/s.

    Parameters
    ----------
    speed_rmse : [m/s]
    acceleration_rmse : [m/s^2]
    wheel_speed_rmse : front axle [rad/s]
    pitch_rmse : [deg]
    distance_error : stopping distance, predicted less measured [m]
    peak_pitch_error : predicted less measured [deg]
    rebound_rmse : pitch from 2 m/s to 0.8 s later [deg]
    rebound_acceleration_rmse : acceleration in the same time [m/s^2]
    """

    speed_rmse: float
    acceleration_rmse: float
    wheel_speed_rmse: float
    pitch_rmse: float
    distance_error: float
    peak_pitch_error: float
    rebound_rmse: float
    rebound_acceleration_rmse: float


def stop_of(drive: RecordedRun, lead: float) -> Stop | None:
    """The longest brake application of a run that ends at rest; None if there is none.

    Parameters
    ----------
    drive : the run
    lead : rolling time kept before the onset [s]
    """
    pressure, speed = drive.columns["brake_pressure"], drive.columns["speed"]
    time = np.arange(len(pressure), dtype=np.float64) * drive.interval
    lead_samples = round(lead / drive.interval)
    episodes = [
        episode
        for episode in find_pressure_episodes(time, pressure, threshold=ACTIVE, merge_gap=0.08)
        if speed[episode.onset] > MASKED_SPEED
        and episode.onset >= lead_samples
        and bool((speed[episode.onset :] < STANDING_SPEED).any())
    ]
    if not episodes:
        return None
    onset = max(episodes, key=lambda episode: episode.duration).onset
    columns = {name: values[onset - lead_samples :].copy() for name, values in drive.columns.items()}
    columns["pitch"] -= float(np.median(columns["pitch"][:lead_samples]))
    return Stop(name=drive.name, interval=drive.interval, columns=columns, onset=lead_samples)


def stop_errors(stop: Stop, predicted: Mapping[str, NDArray[np.float64]]) -> StopErrors:
    """Compare a prediction with its stop.

    Parameters
    ----------
    stop : measured
    predicted : channels, each float64 [N]
    """
    slow, measured = stop.slow, stop.columns
    moving, after = slice(0, slow), slice(slow, slow + round(REBOUND_S / stop.interval))

    def rmse(name: str, where: slice) -> float:
        return float(np.sqrt(np.mean((predicted[name][where] - measured[name][where]) ** 2)))

    return StopErrors(
        speed_rmse=rmse("speed", moving),
        acceleration_rmse=rmse("longitudinal_acceleration", moving),
        wheel_speed_rmse=rmse("wheel_speed_front", moving),
        pitch_rmse=rmse("pitch", moving),
        distance_error=stopping_distance(stop, predicted["speed"])
        - stopping_distance(stop, measured["speed"]),
        peak_pitch_error=float(np.max(predicted["pitch"]) - np.max(measured["pitch"])),
        rebound_rmse=rmse("pitch", after),
        rebound_acceleration_rmse=rmse("longitudinal_acceleration", after),
    )


def stopping_distance(stop: Stop, speed: NDArray[np.float64]) -> float:
    """Distance from the measured brake onset to standstill; NaN if it does not come [m].

    Parameters
    ----------
    stop : gives the onset
    speed : float64 [N] [m/s]
    """
    braking = speed[stop.onset :]
    standing = braking < STANDING_SPEED
    if not standing.any():
        return nan
    return float(np.trapezoid(braking[: int(np.argmax(standing)) + 1], dx=stop.interval))


def rolling_radius(stop: Stop) -> float:
    """Radius at which the front wheels roll before the brake [m].

    Parameters
    ----------
    stop : with a lead at speed
    """
    lead = slice(0, stop.onset)
    return float(np.mean(stop.columns["speed"][lead] / stop.columns["wheel_speed_front"][lead]))
