"""Inputs that a table holds between the updates of a slower bus: told from coarse gauges, pauses and commands."""

import numpy as np
import pytest

from tasks.campaign.assembly import assemble_run
from tasks.campaign.checks import apply_checks
from tasks.campaign.measured import Recordings
from tasks.campaign.signals import ChannelRule, Signal
from tasks.campaign.slow_channels import take_input_updates
from tests.campaign.telling import TABLE

CLOCK = np.arange(900) * 0.01
PRESSURE = np.interp(CLOCK, [0.0, 2.02, 3.41, 5.0, 6.13, 6.7], [0.0, 0.0, 1.7, 1.7, 2.3, 0.0])
"""Of a stop with a rest, two applications, a plateau and a rest [MPa]."""


def hold_pressure(step: float, resolution: float = 0.01, jitter: float = 0.0) -> Signal:
    """The pressure in a table of 100 Hz, from a bus with an update every ``step`` rows, give or take ``jitter``."""
    rng = np.random.default_rng(3)
    updates = 3.0 + step * np.arange(-1, 900 / step) + rng.uniform(-jitter, jitter, int(900 / step + 1.999))
    updates = updates[updates <= 899]
    sent = np.round(np.interp(updates, np.arange(900), PRESSURE) / resolution) * resolution
    return Signal(time=CLOCK, values=sent[np.searchsorted(updates, np.arange(900), side="right").clip(1) - 1])


@pytest.mark.parametrize(
    ("step", "jitter", "period"),
    [(10, 0.0, 0.1), (5, 0.0, 0.05), (2, 0.0, 0.02), (12.5, 0.0, 0.125), (10, 0.8, 0.1)],
)
def test_a_held_pressure_is_linear_between_its_updates(step: float, jitter: float, period: float) -> None:
    updates = take_input_updates(hold_pressure(step, jitter=jitter))
    assert np.median(np.diff(updates.time)) == pytest.approx(period, rel=0.05)
    late = np.interp(CLOCK[20:880], updates.time, updates.values) - PRESSURE[20:880]
    assert np.sqrt(np.mean(late**2)) < 0.02
    assert abs(np.mean(late)) < 0.006


def test_a_rest_and_a_plateau_keep_an_update_at_each_period() -> None:
    updates = take_input_updates(hold_pressure(10))
    np.testing.assert_allclose(np.diff(updates.time), 0.1)
    assert updates.time[0] <= 0.1 and updates.time[-1] > CLOCK[-1] - 0.1


@pytest.mark.parametrize("resolution", [0.01, 0.1, 0.5])
def test_a_gauge_in_each_row_is_left_as_it_is(resolution: float) -> None:
    noisy = PRESSURE + 0.02 * np.random.default_rng(5).standard_normal(900)
    for pressure in (PRESSURE, np.where(PRESSURE > 0.0, noisy, 0.0)):
        signal = Signal(time=CLOCK, values=np.round(pressure / resolution) * resolution)
        taken = take_input_updates(signal)
        assert np.interp(CLOCK[5:-5], taken.time, taken.values) == pytest.approx(
            signal.values[5:-5], abs=0.51 * resolution
        )
        assert taken is signal or resolution > 0.01


def test_the_steps_of_a_command_are_no_updates() -> None:
    seconds = np.arange(6000) * 0.01
    pulses = Signal(time=seconds, values=np.where(seconds % 4.0 < 2.0, 0.0, 0.3))
    few = Signal(time=CLOCK, values=np.clip(np.floor(CLOCK / 0.2) - 10.0, 0.0, 8.0))
    assert take_input_updates(pulses) is pulses and take_input_updates(few) is few


def test_rows_that_follow_no_one_clock_are_left_as_they_are() -> None:
    holds = np.random.default_rng(2).choice([1, 2, 2, 2, 2, 4], 600)
    values = np.repeat(np.arange(600.0), holds)[:900]
    signal = Signal(time=CLOCK, values=values)
    assert take_input_updates(signal) is signal


def test_a_run_brakes_with_the_pressure_between_the_updates_of_its_bus() -> None:
    speed = 30.0 - 0.01 * np.cumsum(2.0 * PRESSURE) + 0.02 * np.random.default_rng(1).standard_normal(900)
    signals = {"p": hold_pressure(10), "v": Signal(time=CLOCK, values=speed)}
    rules = [
        ChannelRule(channel="brake_pressure", sources=("p",), unit="MPa"),
        ChannelRule(channel="speed", sources=("v",), unit="m/s"),
    ]
    found = assemble_run(signals, rules, 0.0, np.inf, 100.0, TABLE)
    assert found.problems == ()
    pressure = found.columns["brake_pressure"]
    true = np.interp(found.start + 0.01 * np.arange(len(pressure)), CLOCK, PRESSURE)
    assert np.sqrt(np.mean((pressure - true) ** 2)) < 0.02
    (told,) = apply_checks(TABLE.recordings, Recordings(signals=[signals], rules=rules))
    assert told.sentence.startswith("channel brake_pressure holds each value until the next update of 10 Hz")
