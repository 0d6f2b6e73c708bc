"""Clocks that begin again, and clocks in another unit than the map says, are told before runs are looked for."""

import re

import numpy as np
import pytest

from tasks.campaign.clocks import describe_clock_scale, describe_restarts, measure_fall
from tasks.campaign.signals import Signal

TIME = np.arange(0.0, 60.0, 0.05)
SPEED = 15.0 + 10.0 * np.cos(2 * np.pi * TIME / 12.0)
"""A car that slows and picks up again, by 5 m/s^2 at most."""


def describe(factor: float, taken: str = "s", speed: np.ndarray = SPEED) -> str:
    signal = Signal(time=TIME * factor, values=speed)
    return describe_clock_scale([signal], signal, taken, deceleration=15.0, shortest=1e-4)


@pytest.mark.parametrize(
    ("factor", "taken", "words"),
    [
        (1e-3, "s", r"samples come every 0.05 ms .* the clock is not in s, it looks like ks"),
        (1 / 60, "s", r"samples come every 0.833 ms .* the clock is not in s, it looks like min"),
        (1e3, "s", r"the clock is not in s, it looks like ms"),
        (1e-3, "us", r"the clock is not in us, it looks like ms"),
    ],
)
def test_a_clock_in_another_unit_is_told_as_a_clock(factor: float, taken: str, words: str) -> None:
    assert re.search(words, describe(factor, taken))


def test_a_sound_clock_a_lost_sample_and_a_speed_in_km_h_are_no_faults_of_the_clock() -> None:
    lost = SPEED.copy()
    lost[::400] = 0.0
    assert describe(1.0) == describe(1.0, speed=lost) == describe(1.0, speed=3.6 * SPEED) == ""


def test_a_fall_is_measured_over_the_least_time_in_which_the_speed_falls_so_far() -> None:
    assert measure_fall(TIME, SPEED) == pytest.approx(4.4, abs=0.8)
    assert measure_fall(TIME, 0.0 * SPEED) is None


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ([0.0, 1.2, 0.0, 1.5], "begins again at sample 3, first from 1.200 to 0.000 s"),
        ([0.0, 9.0, np.nan, 1.0, 5.0, 2.0], "at samples 4, 6, "),
        ([0.0, 1.0, 0.8, 2.0], ""),
        ([0.0, 1.0, 1.0], ""),
    ],
)
def test_a_clock_that_stumbles_has_not_begun_again(times: list[float], words: str) -> None:
    told = describe_restarts(np.array(times))
    assert words in told and bool(words) == bool(told)
