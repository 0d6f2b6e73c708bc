"""Channels slower than their run: told from gaps and coarse sensors, and empty between their samples."""

import numpy as np
import pytest

from tasks.campaign.assembly import assemble_run
from tasks.campaign.campaign import CHANNELS
from tasks.campaign.signals import ChannelRule, Signal
from tasks.campaign.slow_channels import (
    collect_samples,
    fill_between_samples,
    mark_samples,
    measure_slow_rates,
    take_updates,
)
from tests.campaign.telling import TABLE

CLOCK = np.arange(600) * 0.01
SPEED = 30.0 - 6.0 * np.clip(CLOCK - 1.0, 0.0, 4.0) - 0.3 * CLOCK
"""A stop as a receiver sees it [m/s]."""


def keep_every(values: np.ndarray, every: int) -> np.ndarray:
    return np.where(np.arange(len(values)) % every == 0, values, np.nan)


def test_a_channel_with_a_value_at_few_instants_is_slow_and_one_that_misses_single_values_has_gaps() -> None:
    assert mark_samples("speed", keep_every(SPEED, 10)).sum() == 60
    holed = np.where(np.isin(np.arange(600), (7, 300, 301)), np.nan, SPEED)
    assert mark_samples("speed", holed).all()


def test_an_input_must_have_a_value_at_every_instant() -> None:
    assert mark_samples("brake_pressure", keep_every(SPEED, 10)).all()


def test_a_slow_channel_is_linear_between_its_samples() -> None:
    filled = fill_between_samples("speed", keep_every(SPEED, 10))
    np.testing.assert_allclose(filled, np.interp(CLOCK, CLOCK[::10], SPEED[::10]))


def test_only_a_run_with_a_slow_channel_says_where_samples_are() -> None:
    assert collect_samples({"speed": SPEED}) is None
    sampled = collect_samples({"speed": keep_every(SPEED, 10), "pitch": SPEED})
    assert sampled is not None and sampled.sum(axis=0).tolist() == [60, *[600] * (len(CHANNELS) - 1)]


def hold_values(values: np.ndarray, holds: np.ndarray) -> np.ndarray:
    """Each value for some rows, as a table of the fastest signal's rate has a slow one."""
    starts = np.concatenate(([0], np.cumsum(holds)))
    return values[starts[np.searchsorted(starts, np.arange(len(values)), side="right") - 1]]


@pytest.mark.parametrize("jitter", [0, 1])
def test_a_held_signal_has_a_sample_at_each_update(jitter: int) -> None:
    rng = np.random.default_rng(4)
    noisy = SPEED + 0.02 * rng.standard_normal(600)
    holds = 10 + rng.integers(-jitter, jitter + 1, 80)
    updates = take_updates(Signal(time=CLOCK, values=hold_values(noisy, holds)))
    assert len(updates.time) == pytest.approx(60, abs=2)
    rows = np.round(updates.time / 0.01).astype(int)
    # of the first and the last value the logger does not show the other end
    np.testing.assert_array_equal(updates.values[1:-1], noisy[rows][1:-1])


def test_an_update_that_brings_the_same_value_is_a_sample_too() -> None:
    noisy = SPEED + 0.02 * np.random.default_rng(4).standard_normal(600)
    noisy[300] = noisy[290]
    assert len(take_updates(Signal(time=CLOCK, values=hold_values(noisy, np.full(60, 10)))).time) == 60


def test_a_held_signal_goes_on_while_the_car_stands():
    noisy = SPEED + 0.02 * np.random.default_rng(4).standard_normal(600)
    noisy[:95], noisy[495:] = noisy[0], 0.0
    updates = take_updates(Signal(time=CLOCK, values=hold_values(noisy, np.full(60, 10))))
    np.testing.assert_allclose(updates.time, CLOCK[::10])


@pytest.mark.parametrize("step", [0.1, 0.28, 1.0])
def test_a_coarse_sensor_is_no_held_signal(step: float) -> None:
    signal = Signal(time=CLOCK, values=np.round(SPEED / step) * step)
    assert take_updates(signal) is signal


def test_a_run_is_empty_between_the_samples_of_a_slow_signal_and_inputs_are_not() -> None:
    pressure = 1.5 * np.clip((CLOCK - 1.0) / 0.3, 0.0, 1.0)
    pressure += 0.01 * np.random.default_rng(1).standard_normal(600)
    signals = {
        "gps": Signal(time=CLOCK[4::10] + 0.002, values=SPEED[4::10]),
        "brake": Signal(time=CLOCK[::5], values=pressure[::5]),
        "imu": Signal(time=CLOCK, values=np.gradient(SPEED, 0.01)),
    }
    rules = [
        ChannelRule(channel="speed", sources=("gps",), unit="m/s"),
        ChannelRule(channel="brake_pressure", sources=("brake",), unit="MPa"),
        ChannelRule(channel="longitudinal_acceleration", sources=("imu",), unit="m/s^2"),
    ]
    found = assemble_run(signals, rules, 0.0, np.inf, 100.0, TABLE)
    assert found.problems == ()
    rows = np.flatnonzero(np.isfinite(found.columns["speed"]))
    assert set(np.diff(rows)) == {10} and found.start + 0.01 * rows[1] == pytest.approx(0.142, abs=0.005)
    assert found.columns["speed"][rows[1:-1]] == pytest.approx(
        np.interp(found.start + 0.01 * rows[1:-1], signals["gps"].time, signals["gps"].values)
    )
    assert np.isfinite(found.columns["brake_pressure"]).all()
    assert np.isfinite(found.columns["longitudinal_acceleration"]).all()
    assert measure_slow_rates([found.columns], 100.0) == {"speed": 10.0}


@pytest.mark.parametrize(("first", "silent", "sound"), [(63, 600, True), (0, 600, True), (0, 430, False)])
def test_a_slow_channel_covers_its_run_up_to_one_of_its_own_steps(
    first: int, silent: int, sound: bool
) -> None:
    rows = np.arange(first, silent, 100)
    signals = {"gps": Signal(time=CLOCK[rows], values=SPEED[rows]), "imu": Signal(time=CLOCK, values=SPEED)}
    rules = [
        ChannelRule(channel="speed", sources=("gps",), unit="m/s"),
        ChannelRule(channel="lateral_acceleration", sources=("imu",), unit="m/s^2", scale=0.01),
    ]
    problems = assemble_run(signals, rules, 0.0, np.inf, 100.0, TABLE).problems
    assert not problems if sound else "speed: has samples from 0.000 to 4.000 s of a run" in problems[0]
