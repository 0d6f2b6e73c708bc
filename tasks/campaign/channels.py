"""The channels a measured run may have, and the units a logger may give them in."""

from dataclasses import dataclass
from math import log, pi
from typing import Literal

from tasks.conventions import GRAVITY
from tasks.errors import InputError

SpeedSource = Literal["ground", "wheels"]
"""Where the channel ``speed`` was measured: over ground, or at the wheels, whose slip it then has."""
UNITS: dict[str, tuple[str, float]] = {
    "s": ("time", 1.0), "ms": ("time", 1e-3), "us": ("time", 1e-6), "ns": ("time", 1e-9),
    "ks": ("time", 1e3), "min": ("time", 60.0), "h": ("time", 3600.0), "d": ("time", 86400.0),
    "m/s": ("speed", 1.0), "km/h": ("speed", 1 / 3.6), "mph": ("speed", 0.44704), "kn": ("speed", 1852 / 3600),
    "m/s^2": ("acceleration", 1.0), "g": ("acceleration", GRAVITY),
    "rad": ("angle", 1.0), "deg": ("angle", pi / 180),
    "rad/s": ("angular speed", 1.0), "deg/s": ("angular speed", pi / 180), "rpm": ("angular speed", pi / 30),
    "MPa": ("pressure", 1e6), "bar": ("pressure", 1e5), "kPa": ("pressure", 1e3), "Pa": ("pressure", 1.0),
    "psi": ("pressure", 6894.757293168), "mbar": ("pressure", 1e2),
    "N": ("force", 1.0), "kN": ("force", 1e3),
    "N m": ("torque", 1.0), "kN m": ("torque", 1e3),
    "1": ("ratio", 1.0), "%": ("ratio", 1e-2),
}  # fmt: skip
"""Unit to its dimension and its size in the dimension's SI unit."""
SPEED_UNITS = ("km/h", "mph", "kn", "m/s")
"""Units in which loggers write the speed of a car, the most usual first."""
ALIASES = {
    "kmh": "km/h", "kph": "km/h", "kmph": "km/h", "km/hr": "km/h", "kilometers/hour": "km/h",
    "mps": "m/s", "m/sec": "m/s",
    "mi/h": "mph", "miles/h": "mph", "miles/hour": "mph", "knot": "kn", "knots": "kn", "kt": "kn", "kts": "kn",
    "m/s/s": "m/s^2", "m/s**2": "m/s^2", "mps2": "m/s^2", "m/sec2": "m/s^2", "m/s-2": "m/s^2",
    "G's": "g", "gs": "g", "g-force": "g",
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "millis": "ms", "milliseconds": "ms",
    "usec": "us", "µs": "us", "μs": "us", "microseconds": "us", "nsec": "ns", "nanoseconds": "ns",
    "minutes": "min", "hours": "h", "days": "d",
    "°": "deg", "degree": "deg", "degrees": "deg", "radians": "rad",
    "°/s": "deg/s", "dps": "deg/s", "deg/sec": "deg/s", "degrees/s": "deg/s", "degrees/second": "deg/s",
    "rad/sec": "rad/s", "1/min": "rpm", "rev/min": "rpm", "r/min": "rpm",
    "bars": "bar", "megapascal": "MPa", "newton": "N", "newtons": "N", "pct": "%", "percent": "%", "-": "1",
    "Unit_Bar": "bar", "Unit_KiloMeterPerHour": "km/h", "Unit_DegreOfArc": "deg", "Unit_DegreOfArcPerSecon": "deg/s",
    "Unit_MeterPerSeconSquar": "m/s^2",
}  # fmt: skip
"""Spellings of the units that this project knows, as files have them."""


@dataclass(frozen=True)
class MeasuredChannel:
    """One column of a campaign's runs.

    Parameters
    ----------
    name, unit : as in the run's file
    description : for people
    """

    name: str
    unit: str
    description: str


MAIN_CHANNELS = (
    MeasuredChannel("brake_pressure", "MPa", "brake pressure at the caliper line"),
    MeasuredChannel("speed", "m/s", "speed over ground"),
    MeasuredChannel("longitudinal_acceleration", "m/s^2", "accelerometer, forward positive"),
    MeasuredChannel("wheel_speed_front", "rad/s", "mean of the front wheels"),
    MeasuredChannel("wheel_speed_rear", "rad/s", "mean of the rear wheels"),
    MeasuredChannel("pitch", "deg", "nose-down positive"),
    MeasuredChannel("pitch_rate", "deg/s", "nose-down positive"),
    MeasuredChannel("vertical_acceleration", "m/s^2", "of the body, up positive, without gravity"),
)
"""Channels that closing the loop compares; a map must give the source of each or state that it was not measured."""

SIDE_CHANNELS = (
    MeasuredChannel("steering_angle", "deg", "at the steering wheel, left positive"),
    MeasuredChannel("yaw_rate", "deg/s", "left positive"),
    MeasuredChannel("roll_rate", "deg/s", "right side down positive"),
    MeasuredChannel("lateral_acceleration", "m/s^2", "left positive"),
    MeasuredChannel("brake_torque", "N m", "all wheels together, braking positive"),
    MeasuredChannel("brake_command", "1", "share of the full brake: pedal travel or a controller's command"),
    MeasuredChannel("pedal_force", "N", "of the foot on the brake pedal"),
    MeasuredChannel("engine_torque", "N m", "at the wheels, driving positive"),
    MeasuredChannel("road_slope", "deg", "of the road, uphill positive"),
    MeasuredChannel("throttle", "1", "share of the full throttle"),
)
"""Channels that selection rules, residual plots and the closing of the loop use where they were measured."""

WHEELS = ("wheel_speed_front", "wheel_speed_rear")
BRAKE_SIGNALS = {"brake_pressure": 1.0, "brake_command": 10.0, "brake_torque": 0.001, "pedal_force": 0.02}
"""Signals that say how hard the driver brakes, the best first, and the pressure that a unit of each stands for [MPa].

Only for a pressure is this a measurement; for the others the brake's gain is unknown, and a fit finds it."""
CHANNELS_BY_NAME = {channel.name: channel for channel in (*MAIN_CHANNELS, *SIDE_CHANNELS)}
COLUMN_UNITS = {"time": "s", **{name: channel.unit for name, channel in CHANNELS_BY_NAME.items()}}
"""Units of the columns of a run's file."""


def describe_brake(pressure: float, signal: str) -> str:
    """Return how hard a brake is applied, by the signal that was logged: "2.4 MPa", or "0.24 of the brake command".

    Parameters
    ----------
    pressure : that the signal stands for [MPa]
    signal : a channel of `BRAKE_SIGNALS`, or the unit of another signal
    """
    if BRAKE_SIGNALS.get(signal, 1.0) == 1.0:
        return f"{pressure:.3g} MPa"
    unit = "" if CHANNELS_BY_NAME[signal].unit == "1" else f" {CHANNELS_BY_NAME[signal].unit}"
    return f"{pressure / BRAKE_SIGNALS[signal]:.3g}{unit} of the {signal.replace('_', ' ')}"


def unit_factor(unit: str, target: str) -> float:
    """Return the factor that converts a value in ``unit`` to ``target``.

    Raises
    ------
    InputError
        If a unit is unknown, or the two measure different things.
    """
    for name in (unit, target):
        if name not in UNITS:
            raise InputError(f"unit {name}: no such unit; there are: {', '.join(UNITS)}")
    (dimension, size), (wanted, wanted_size) = UNITS[unit], UNITS[target]
    if dimension != wanted:
        raise InputError(
            f"unit {unit} is of {dimension}, {target} of {wanted}: give the source's true unit, or a gain"
        )
    return size / wanted_size


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


def guess_unit(taken: str, ratio: float, within: float = 1.25) -> str | None:
    """Return the likely unit of values that are ``ratio`` times too large in the assumed unit; None if none fits.

    Parameters
    ----------
    taken : the assumed unit
    ratio : size found over size expected [1]
    within : ratio to the expected size up to which a unit fits [1]
    """
    dimension, size = UNITS[taken]
    apart = {
        unit: abs(log(ratio * other / size))
        for unit, (kind, other) in UNITS.items()
        if kind == dimension and unit != taken
    }
    near = min(apart, key=apart.__getitem__, default=None)
    return near if near is not None and apart[near] < log(within) else None
