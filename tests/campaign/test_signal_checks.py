"""Checks of one signal: clocks, frozen sensors, dead ones in a list, and an acceleration that is none."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.campaign.checks import apply_checks
from tasks.campaign.clocks import has_digits_of_day, looks_like_time_of_day, read_time_of_day
from tasks.campaign.measured import LoggedSignal
from tasks.campaign.signal_checks import compare_with_rate_of_speed
from tasks.campaign.signals import Signal
from tests.campaign.recorded import write_digits
from tests.campaign.telling import CONDITIONS, TABLE, tell_signal

Values = NDArray[np.float64]


@pytest.mark.parametrize(
    ("step", "told"), [(0.0, "repeats: keep_first under time"), (-0.3, "cut the run there")]
)
def test_a_clock_that_repeats_a_stamp_is_told_the_key_for_it(step: float, told: str) -> None:
    time = np.concatenate((0.01 * np.arange(50), 0.01 * (49 + np.arange(50)) + step))
    (problem,) = tell_signal(Signal(time=time, values=np.arange(100.0)))
    assert "does not advance" in problem and told in problem and ("keep_first" in problem) == (step == 0.0)


def test_digits_are_read_as_seconds_since_midnight_and_a_drive_goes_on_after_it() -> None:
    stamps = np.array([73000.05, np.nan, 73059.95, 73100.0, 80000.0])
    np.testing.assert_allclose(read_time_of_day(stamps), [27000.05, np.nan, 27059.95, 27060.0, 28800.0])
    seconds = 86395.0 + 0.05 * np.arange(200)
    np.testing.assert_allclose(read_time_of_day(write_digits(seconds)), seconds)


@pytest.mark.parametrize("start", [37435.0, 39595.0])  # over a minute, over an hour
def test_digits_that_are_taken_for_seconds_are_told(start: float) -> None:
    stamps = write_digits(start + 0.05 * np.arange(400))
    (problem,) = tell_signal(Signal(time=stamps, values=0.0 * stamps))
    assert "digits of hours, minutes and seconds: give unit: HHMMSS under time" in problem


def test_a_gap_in_a_clock_of_seconds_is_no_time_of_day() -> None:
    time = 0.05 * np.arange(4000)
    assert not looks_like_time_of_day(time)
    assert not looks_like_time_of_day(time[(time < 50.0) | (time > 110.0)])
    assert not looks_like_time_of_day(time[:1000]) and has_digits_of_day(time[:1000])


def tell_frozen(values: Values, time: Values) -> list[str]:
    signal = Signal(time=time, values=values)
    return tell_signal(signal, speed=signal)


def test_a_run_that_begins_within_a_split_step_shows_no_finer_sensor() -> None:
    """A dongle's whole km/h at 5 Hz: 51, then 50 while the car cruises, then a stop; the clock cuts the first step."""
    stop = [49.0, 48.0, 46.0, 43.0, *np.arange(40.0, 8.0, -4.0)]
    logged = np.concatenate(([51.0], np.full(28, 50.0), stop)) / 3.6
    time = 0.2 * np.arange(len(logged))
    for share in (0.3, 0.5, 0.64):
        clock = time[:-1] + 0.2 * share
        assert tell_frozen(np.interp(clock, time, logged), clock) == []


def test_rounding_is_no_step_of_a_coarse_sensor_and_a_freeze_ends_with_a_larger_one() -> None:
    """Speed in whole km/h, held while the car cruises, with what a resampling leaves of it."""
    driven = (
        np.concatenate((np.arange(100.0, 80.0, -1.0), np.full(40, 80.0), np.arange(79.0, 40.0, -1.0))) / 3.6
    )
    time = 0.1 * np.arange(len(driven))
    rounded = driven + 1e-13 * (np.arange(len(driven)) % 2)
    uneven = np.interp(time, time + 0.02 * np.sin(np.arange(len(time))), driven)  # put on an even clock
    assert [tell_frozen(values, time) for values in (driven, rounded, uneven)] == [[], [], []]
    (problem,) = tell_frozen(np.where(driven < 80.0 / 3.6, rounded - 5.0, rounded), time)
    assert "holds 22.22 for" in problem and problem.endswith("cut the run there, or leave the channel out")


TIME = np.arange(300) / 100.0
BRAKE = np.clip(TIME - 1.0, 0.0, 1.0)


def find_dead(*values: Values, channel: str = "brake_pressure", unit: str = "MPa") -> list[str]:
    others = {
        name: Signal(time=TIME, values=one)
        for name, one in zip(("front", "rear", "other"), values, strict=False)
    }
    told = [
        apply_checks(
            TABLE.signal,
            LoggedSignal(
                channel=channel, source=name, logged=one, converted=one, others=others, span=TABLE.spans[channel],
                unit=unit,
            ),
        )
        for name, one in others.items()
    ]  # fmt: skip
    return [one.sentence for own in told for one in own if one.check.name == "dead_source"]


@pytest.mark.parametrize("level", [0.0, 0.101, 12.0])
@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_a_source_that_holds_one_value_while_another_moves_is_dead(level: float, noise: float) -> None:
    (told,) = find_dead(5.0 * BRAKE, level + noise * np.random.default_rng(1).standard_normal(300))
    assert told.startswith("its signal rear is dead: it stays at")
    assert "while front moves by 5," in told and "take rear out of source" in told


@pytest.mark.parametrize(
    ("channel", "unit", "values", "dead"),
    [
        ("brake_pressure", "MPa", (0.0 * TIME, 3.0 * BRAKE, 0.0 * TIME), ["front", "other"]),
        ("brake_command", "%", (0.6 * BRAKE, 0.0 * BRAKE), ["rear"]),
        ("steering_angle", "rad", (450.0 * BRAKE, 0.0 * BRAKE), ["rear"]),
        ("engine_torque", "N m", (3000.0 * BRAKE, 0.0 * BRAKE), []),  # an axle may drive alone
        ("brake_pressure", "MPa", (5.0 * BRAKE, 1.0 * BRAKE), []),  # a valve limits the rear axle
        ("brake_pressure", "MPa", (5.0 * BRAKE,), []),
        ("brake_pressure", "MPa", (0.5 * BRAKE, 0.0 * BRAKE), []),  # too gentle to tell
        ("brake_pressure", "MPa", (0.0 * BRAKE, 0.0 * BRAKE), []),
        ("brake_pressure", "MPa", (5.0 * BRAKE, np.full(300, np.nan)), []),  # told by another rule
        (
            "brake_pressure",
            "MPa",
            (5.0 * BRAKE, np.minimum(4.0 * BRAKE, 0.1)),
            [],
        ),  # the rear is released early
    ],
)
def test_each_dead_source_of_a_list_is_named_and_no_other(
    channel: str, unit: str, values: tuple[Values, ...], dead: list[str]
) -> None:
    assert [told.split()[2] for told in find_dead(*values, channel=channel, unit=unit)] == dead


STEP = 0.05
DRIVE = 1000.0 + np.arange(200) * STEP
TRUE = -4.0 * np.clip((DRIVE - 1003.0) / 0.5, 0.0, 1.0) - 0.2
SPEED = 40.0 + np.cumsum(TRUE) * STEP
FINE = SPEED + 0.02 * np.random.default_rng(1).standard_normal(len(SPEED))
RESOLUTION = 0.01 / 3.6
"""Of a receiver that logs hundredths of km/h [m/s]."""
G = 9.80665


def round_to(values: Values, resolution: float) -> Values:
    return np.round(values / resolution) * resolution


def is_computed(acceleration: Values, speed: Values, time: Values = DRIVE) -> bool:
    signals = Signal(time=time, values=acceleration), Signal(time=time, values=speed)
    return compare_with_rate_of_speed(*signals, **CONDITIONS["computed_acceleration"]) < 1.0


def take_centred(speed: Values, step: float = STEP) -> Values:
    return np.gradient(speed, step)


def take_backward(speed: Values, step: float = STEP) -> Values:
    return np.diff(speed, prepend=speed[0]) / step


def take_forward(speed: Values, step: float = STEP) -> Values:
    return np.roll(take_backward(speed, step), -1)


@pytest.mark.parametrize("resolution", [1e-9, 0.001 * G, 0.01 * G])
@pytest.mark.parametrize("differentiate", [take_centred, take_backward, take_forward])
def test_a_difference_of_the_speed_is_no_accelerometer(
    differentiate: Callable[[Values], Values], resolution: float
) -> None:
    logged = round_to(FINE, RESOLUTION)
    assert is_computed(round_to(differentiate(logged), resolution), logged)
    assert is_computed(take_centred(FINE), logged)  # of a speed finer than the logged one


@pytest.mark.parametrize(
    ("error", "speed"),
    [
        (0.05 * np.random.default_rng(2).standard_normal(len(DRIVE)), SPEED),  # noise beside a perfect speed
        (0.1 * np.ones(len(DRIVE)), round_to(FINE, RESOLUTION)),  # a slope of 1 %
        (0.04 * TRUE, round_to(FINE, RESOLUTION)),  # gravity through the dive
        (0.0 * TRUE, round_to(FINE, RESOLUTION)),  # a perfect accelerometer beside a speed with noise
        (0.0 * TRUE, np.round(SPEED * 3.6) / 3.6),  # beside a speed too coarse to tell
    ],
)
def test_an_accelerometer_of_its_own_is_never_taken_for_the_rate_of_speed(
    error: Values, speed: Values
) -> None:
    for logged in (TRUE + error, round_to(TRUE + error, 0.0981)):
        assert not is_computed(logged, speed)


def test_a_cruise_and_a_standing_car_tell_nothing() -> None:
    assert not is_computed(0.0 * DRIVE, 0.0 * DRIVE + 20.0)
    assert not is_computed(take_centred(SPEED), SPEED - SPEED.max())


def log_fast(seed: int) -> tuple[Values, Values, Values]:
    """Time, motion and speed of a receiver of 100 Hz, as VBOX is."""
    time = np.arange(600) / 100.0
    motion = -5.0 * np.clip((time - 2.0) / 0.4, 0.0, 1.0) - 0.2
    speed = 40.0 + np.cumsum(motion) / 100.0 + 0.005 * np.random.default_rng(seed).standard_normal(600)
    return time, motion, speed


@pytest.mark.parametrize("resolution", [1e-9, 0.001 * G, 0.01 * G])
@pytest.mark.parametrize("coarse", [RESOLUTION, 1.0 / 3.6])
def test_a_difference_of_a_coarse_speed_is_no_accelerometer(resolution: float, coarse: float) -> None:
    """Its rounding is 0.06 m/s^2 and more, and the difference is equal to the last digit."""
    time, _, speed = log_fast(1)
    speed = round_to(speed, coarse)
    for differentiate in (take_centred, take_backward):
        assert is_computed(round_to(differentiate(speed, 0.01), resolution), speed, time)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_an_accelerometer_beside_a_coarse_rate_stays_one(seed: int, noise: float) -> None:
    """Also one that an inertial navigation system integrates to that speed, free of slope and dive."""
    time, motion, speed = log_fast(seed)
    for felt in (motion, take_backward(speed, 0.01)):
        felt = felt + noise * np.random.default_rng(seed + 10).standard_normal(600)
        for logged in (felt, round_to(felt, 0.0981)):
            assert not is_computed(logged, round_to(speed, RESOLUTION), time)
