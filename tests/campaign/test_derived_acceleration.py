"""An acceleration that a logger computed from the speed is no accelerometer; a true one is never taken for it."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.campaign.derived_acceleration import is_rate_of_speed
from tasks.campaign.signals import Signal

INTERVAL = 0.05
TIME = 1000.0 + np.arange(200) * INTERVAL
TRUE = -4.0 * np.clip((TIME - 1003.0) / 0.5, 0.0, 1.0) - 0.2
SPEED = 40.0 + np.cumsum(TRUE) * INTERVAL
Values = NDArray[np.float64]
RESOLUTION = 0.01 / 3.6
"""Of a receiver that logs hundredths of km/h [m/s]."""


def log_speed(seed: int = 1) -> Values:
    noisy = SPEED + 0.02 * np.random.default_rng(seed).standard_normal(len(SPEED))
    return np.round(noisy / RESOLUTION) * RESOLUTION


def take_centred(speed: Values) -> Values:
    return np.gradient(speed, INTERVAL)


def take_backward(speed: Values) -> Values:
    return np.diff(speed, prepend=speed[0]) / INTERVAL


@pytest.mark.parametrize(
    "differentiate", [take_centred, take_backward, lambda v: np.roll(take_backward(v), -1)]
)
@pytest.mark.parametrize("resolution", [1e-9, 0.001 * 9.80665, 0.01 * 9.80665])
def test_a_difference_of_the_speed_is_no_accelerometer(
    differentiate: Callable[[Values], Values], resolution: float
) -> None:
    speed = log_speed()
    logged = np.round(differentiate(speed) / resolution) * resolution
    assert is_rate_of_speed(Signal(time=TIME, values=logged), Signal(time=TIME, values=speed))


def test_a_difference_of_a_speed_finer_than_the_logged_one_is_no_accelerometer() -> None:
    fine = SPEED + 0.02 * np.random.default_rng(1).standard_normal(len(SPEED))
    signals = Signal(time=TIME, values=take_centred(fine)), Signal(time=TIME, values=log_speed())
    assert is_rate_of_speed(*signals)


@pytest.mark.parametrize(
    ("error", "speed"),
    [
        (0.05 * np.random.default_rng(2).standard_normal(len(TIME)), SPEED),  # noise beside a perfect speed
        (0.1 * np.ones(len(TIME)), log_speed()),  # a slope of 1 %
        (0.04 * TRUE, log_speed()),  # gravity through the dive
        (np.zeros(len(TIME)), log_speed()),  # a perfect accelerometer beside a speed with noise
        (np.zeros(len(TIME)), np.round(SPEED * 3.6) / 3.6),  # beside a speed too coarse to tell
    ],
)
def test_an_accelerometer_of_its_own_is_never_taken_for_the_rate_of_speed(
    error: Values, speed: Values
) -> None:
    for logged in (TRUE + error, np.round((TRUE + error) / 0.0981) * 0.0981):
        assert not is_rate_of_speed(Signal(time=TIME, values=logged), Signal(time=TIME, values=speed))


def test_a_cruise_and_a_standing_car_tell_nothing() -> None:
    flat = Signal(time=TIME, values=np.full(len(TIME), 20.0))
    assert not is_rate_of_speed(Signal(time=TIME, values=np.zeros(len(TIME))), flat)
    standing = Signal(time=TIME, values=SPEED - SPEED.max())
    assert not is_rate_of_speed(Signal(time=TIME, values=take_centred(SPEED)), standing)


def log_fast(seed: int) -> tuple[Values, Values, Values]:
    """Time, motion and speed of a receiver of 100 Hz that logs hundredths of km/h, as VBOX does."""
    time = np.arange(600) / 100.0
    motion = -5.0 * np.clip((time - 2.0) / 0.4, 0.0, 1.0) - 0.2
    speed = 40.0 + np.cumsum(motion) / 100.0 + 0.005 * np.random.default_rng(seed).standard_normal(600)
    return time, motion, speed


@pytest.mark.parametrize("resolution", [1e-9, 0.001 * 9.80665, 0.01 * 9.80665])
@pytest.mark.parametrize("coarse", [RESOLUTION, 1.0 / 3.6])
def test_a_difference_of_a_coarse_speed_is_no_accelerometer(resolution: float, coarse: float) -> None:
    """Its rounding is 0.06 m/s^2 and more, and the difference is equal to the last digit."""
    time, _, speed = log_fast(1)
    speed = np.round(speed / coarse) * coarse
    for rate in (np.gradient(speed, 0.01), np.diff(speed, prepend=speed[0]) / 0.01):
        logged = np.round(rate / resolution) * resolution
        assert is_rate_of_speed(Signal(time=time, values=logged), Signal(time=time, values=speed))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_an_accelerometer_beside_a_coarse_rate_stays_one(seed: int, noise: float) -> None:
    """Also one that an inertial navigation system integrates to that speed, free of slope and dive."""
    time, motion, speed = log_fast(seed)
    coarse = np.round(speed / RESOLUTION) * RESOLUTION
    for felt in (motion, np.diff(speed, prepend=speed[0]) / 0.01):
        felt = felt + noise * np.random.default_rng(seed + 10).standard_normal(600)
        for logged in (felt, np.round(felt / 0.0981) * 0.0981):
            assert not is_rate_of_speed(Signal(time=time, values=logged), Signal(time=time, values=coarse))
