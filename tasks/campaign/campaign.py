"""A measurement campaign without its files: runs, split, tolerances."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

CHANNELS = (
    "speed", "longitudinal_acceleration", "wheel_speed_front", "wheel_speed_rear", "pitch", "pitch_rate",
    "vertical_acceleration",
)  # fmt: skip
"""Measured responses in the order of a run's matrix; angles in degrees as test benches log them."""
CHANNEL_UNITS = ("m/s", "m/s^2", "rad/s", "rad/s", "deg", "deg/s", "m/s^2")
SESSION = ("pressure_gain", "mass", "pitch_gain", "wheel_radius", "damping", "stiffness", "slope")
"""Session nuisances, by the name of the parameter that carries them."""
FILE_NUMBERS = (*SESSION, "friction")
"""Numbers of the vehicle file that every fit moves: those of the session, and the grip that all runs share."""


LEAST_SAMPLES = 20
"""A shorter run holds no stop: 20 samples are a second at 20 Hz."""
BRAKING_PRESSURE = 0.1
"""Brake pressure, or what stands for it, from which a car brakes [MPa]: it gives 0.2 m/s^2."""
MASKED_SPEED = 2.0
"""Speed below which a run is not used: the floor of the slip's denominator distorts slip there [m/s]."""


def find_motion(speed: NDArray[np.float64]) -> tuple[int, int]:
    """Return the first sample of the stretch of a run that is used, and the one behind its last.

    It ends where the speed falls below `MASKED_SPEED`. Where a run begins below it, from a standstill or with a dab of
    the brake at a red light, or is above it for fewer than `LEAST_SAMPLES`, it is the longest stretch above.

    Parameters
    ----------
    speed : float64 [N] [m/s]
    """
    moves = np.concatenate(([False], speed >= MASKED_SPEED, [False]))
    starts, ends = np.flatnonzero(~moves[:-1] & moves[1:]), np.flatnonzero(moves[:-1] & ~moves[1:])
    if not starts.size:
        return 0, 0
    used = 0 if starts[0] == 0 and ends[0] >= LEAST_SAMPLES else int(np.argmax(ends - starts))
    return int(starts[used]), int(ends[used])


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """One-sigma uncertainties of a session (relative, grade as slope) and of a single run.

    Parameters
    ----------
    session : seven sigmas in the order of `SESSION` [1]
    initial_speed : [m/s]
    friction : relative [1]
    acceleration_bias : [m/s^2]
    pitch_offset : [deg]
    grip : relative, of the grip that all runs share; no file is off there unless an effect says so [1]
    """

    session: tuple[float, ...]
    initial_speed: float
    friction: float
    acceleration_bias: float
    pitch_offset: float
    grip: float = 1e-6

    @property
    def file_numbers(self) -> tuple[float, ...]:
        """Return one sigma of each of `FILE_NUMBERS` [1]."""
        return (*self.session, self.grip)

    def with_session(self, known: Mapping[str, float]) -> "Tolerances":
        """Return the tolerances with some of the session's replaced.

        Parameters
        ----------
        known : by name of `SESSION` [1]
        """
        values = (known.get(name, sigma) for name, sigma in zip(SESSION, self.session, strict=True))
        return replace(self, session=tuple(values))


@dataclass(frozen=True, kw_only=True)
class Run:
    """One measured run at a fixed rate.

    Parameters
    ----------
    name : as in runs.csv
    held_out : belongs to the runs that no fit may read
    weather : name of the kind of weather
    precipitation_mm_h, snow_accumulation_h : rate [mm/h] and time of snowfall [h]
    direction : +1 along the route, -1 against it
    disc_rise : disc temperature above ambient at the start [K]
    hazard_center, hazard_length, hazard_height : road feature [m]; length 0 is a flat road
    interval : time between samples [s]
    pressure : float64 [N] measured brake pressure [MPa]
    response : float64 [N, 7] measured channels in the order of `CHANNELS`, linear between the samples of a slow one; 0
        where a channel was not measured
    drive_torque : float64 [N] of the engine at the wheels, driving positive [N m]; None where it was not measured
    road_slope : float64 [N] of the road, uphill positive [rad]; None where it was not measured
    throttle : float64 [N] share of the full throttle [1]; None where it was not measured
    speed_of_wheels : the speed was measured at the wheels, whose slip it has
    braking_heat : of the discs at the start, by the drive before it, per mass of the car [J/kg]
    felt_slope : of the road by what the accelerometer reads, uphill positive; counts where none was measured [rad]
    sampled : bool [N, 7] instants at which each channel has a sample; None where all have one at every instant
    speed_before : float64 [M] speed at the same rate before the first sample, which is no part of the run [m/s]
    """

    name: str
    held_out: bool
    weather: str
    precipitation_mm_h: float
    snow_accumulation_h: float
    direction: int
    disc_rise: float
    hazard_center: float
    hazard_length: float
    hazard_height: float
    interval: float
    pressure: NDArray[np.float64]
    response: NDArray[np.float64]
    drive_torque: NDArray[np.float64] | None = None
    road_slope: NDArray[np.float64] | None = None
    throttle: NDArray[np.float64] | None = None
    speed_of_wheels: bool = False
    braking_heat: float = 0.0
    felt_slope: float = 0.0
    sampled: NDArray[np.bool_] | None = None
    speed_before: NDArray[np.float64] | None = None

    @property
    def speed(self) -> NDArray[np.float64]:
        """Return the measured speed, float64 [N] [m/s]."""
        return np.asarray(self.response[:, CHANNELS.index("speed")])

    @property
    def slope(self) -> NDArray[np.float64] | None:
        """Return the slope of the road, measured or felt, float64 [N] [rad]; None on a flat road."""
        if self.road_slope is not None or not self.felt_slope:
            return self.road_slope
        return np.full(len(self.pressure), self.felt_slope)

    def find_samples(self, channel: int) -> NDArray[np.int64]:
        """Return the instants at which a channel has a sample, int64 [M].

        Parameters
        ----------
        channel : place in `CHANNELS`
        """
        return (
            np.arange(len(self.response))
            if self.sampled is None
            else np.flatnonzero(self.sampled[:, channel])
        )

    def lower_pressure(self, zero: float) -> "Run":
        """Return a run whose brake pressure is counted from what its signal says at rest.

        Parameters
        ----------
        zero : that pressure [MPa]
        """
        return replace(self, pressure=np.maximum(self.pressure - zero, 0.0))

    def lower_throttle(self, rest: float) -> "Run":
        """Return a run whose throttle is counted from what it reads at rest.

        Parameters
        ----------
        rest : that reading [1]
        """
        return (
            self if self.throttle is None else replace(self, throttle=np.maximum(self.throttle - rest, 0.0))
        )

    def begin_at(self, first: int, end: int | None = None) -> "Run":
        """Return a run on a flat road from a sample on.

        Parameters
        ----------
        first : sample that becomes the first
        end : sample behind the last; None for that of the run
        """
        drive, slope, throttle = (
            None if trace is None else trace[first:end]
            for trace in (self.drive_torque, self.road_slope, self.throttle)
        )
        sampled = None if self.sampled is None else self.sampled[first:end]
        return replace(
            self, pressure=self.pressure[first:end], response=self.response[first:end], drive_torque=drive,
            road_slope=slope, throttle=throttle, sampled=sampled,
        )  # fmt: skip

    def group_channels(self) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Return the channels that share their instants: places in `CHANNELS`, int64 [C], and instants, int64 [M]."""
        groups: dict[bytes, list[int]] = {}
        for channel in range(len(CHANNELS)):
            groups.setdefault(self.find_samples(channel).tobytes(), []).append(channel)
        return [(np.array(channels), self.find_samples(channels[0])) for channels in groups.values()]


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """All runs of one vehicle in one session, with the split fixed before anything is fitted.

    Parameters
    ----------
    name, vehicle : of the campaign and of the catalogue entry it is compared with
    runs : in the order of runs.csv
    tolerances : uncertainties of a session and of a run
    content_hash : SHA-256 over every file read
    split_hash : SHA-256 over the names of the training and held-out runs
    channels : of `CHANNELS`, those that were measured
    brake_signal : signal or unit that stands for the brake pressure
    brake_rest : what that signal says at rest in all runs alike, taken off it, as a pressure [MPa]
    throttle_rest : what the throttle reads while the brake is applied, taken off it [1]
    resting_gauge : sentence of the check of a brake pressure that rests above 0 and is not taken off; else empty
    """

    name: str
    vehicle: str
    runs: tuple[Run, ...]
    tolerances: Tolerances
    content_hash: str
    split_hash: str
    channels: tuple[str, ...] = CHANNELS
    brake_signal: str = "brake_pressure"
    brake_rest: float = 0.0
    throttle_rest: float = 0.0
    resting_gauge: str = ""

    @property
    def is_measured(self) -> NDArray[np.bool_]:
        """Whether each of `CHANNELS` was measured, bool [7]."""
        return np.array([name in self.channels for name in CHANNELS])

    @property
    def train(self) -> tuple[Run, ...]:
        """Runs that may be fitted."""
        return tuple(run for run in self.runs if not run.held_out)

    @property
    def held_out(self) -> tuple[Run, ...]:
        """Runs that only test a fit."""
        return tuple(run for run in self.runs if run.held_out)
