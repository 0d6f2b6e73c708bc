"""Readings of the car's instruments: seven channels at 100 Hz, with faults, offsets and noise."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.double_track.draws import draw_coloured, keyed_generator
from studies.double_track.motion import HEAVE_RATE, PITCH, PITCH_RATE, SPEED, TURN

Channels = dict[str, NDArray[np.float64]]


def read_instruments(
    states: NDArray[np.float64],
    rates: NDArray[np.float64],
    record: NDArray[np.void],
    faults: Mapping[str, float],
    interval: float,
) -> Channels:
    """Channels of a run before any noise, by name [m/s, m/s^2, rad/s, deg, deg/s].

    The accelerometer is on a level platform and feels gravity along the grade. With a leak it feels gravity through
    pitch too, and with a tilted mount it mixes forward and up.

    Parameters
    ----------
    states, rates : float64 [N, 39] of the run
    record : the car
    faults : of the instruments, by name
    interval : between the samples [s]
    """
    car = record[0]
    gravity = float(car["gravity"])
    forward = rates[:, SPEED] + gravity * float(car["grade"] * car["direction"])
    forward = forward - faults.get("gravity_leak", 0.0) * gravity * np.sin(states[:, PITCH])
    up = rates[:, HEAVE_RATE]
    tilt = faults.get("mount_tilt", 0.0)
    wheel = 1.0 + faults.get("wheel_speed_scale", 0.0)
    channels = {
        "speed": states[:, SPEED] * (1.0 + faults.get("speed_scale", 0.0)),
        "longitudinal_acceleration": forward * np.cos(tilt) + (up + gravity) * np.sin(tilt),
        "wheel_speed_front": states[:, TURN : TURN + 2].mean(axis=1) * wheel,
        "wheel_speed_rear": states[:, TURN + 2 : TURN + 4].mean(axis=1) * wheel,
        "pitch": np.degrees(states[:, PITCH]),
        "pitch_rate": np.degrees(states[:, PITCH_RATE]),
        "vertical_acceleration": (up + gravity) * np.cos(tilt) - forward * np.sin(tilt) - gravity,
    }
    for fault, names in (
        ("speed_delay", ("speed",)),
        ("acceleration_delay", ("longitudinal_acceleration",)),
        ("pitch_delay", ("pitch", "pitch_rate")),
    ):
        for name in names if faults.get(fault) else ():
            clock = np.arange(len(states)) * interval
            channels[name] = np.interp(clock - faults[fault], clock, channels[name])
    return channels


def add_noise(
    channels: Channels, offsets: Mapping[str, float], noise: Mapping[str, Any], *key: str | int
) -> Channels:
    """Channels with their offsets and coloured noise, each of a stream of its own.

    Parameters
    ----------
    channels : by name
    offsets : of a run, by channel
    noise : sigma and AR(1) coefficient by channel
    key : of the run
    """
    noisy = {}
    for name, values in channels.items():
        rng = keyed_generator(*key, "noise", name)
        own = noise[name]
        noisy[name] = (
            values + offsets.get(name, 0.0) + own["sigma"] * draw_coloured(rng, len(values), own["ar1"])
        )
    return noisy
