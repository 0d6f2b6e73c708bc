"""Units, channel rules, clocks and episodes."""

import numpy as np
import pytest

from tasks.campaign.assembly import assemble_run
from tasks.campaign.channels import UNITS, guess_unit, unit_factor
from tasks.campaign.segments import find_pressure_episodes
from tasks.campaign.signals import (
    ChannelRule,
    Gain,
    Signal,
    convert_to_channel,
    make_common_clock,
    resample_on_clock,
)
from tasks.errors import InputError
from tests.campaign.telling import TABLE


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [("bar", "MPa", 0.1), ("km/h", "m/s", 1 / 3.6), ("g", "m/s^2", 9.80665), ("rpm", "rad/s", 0.104719755),
     ("deg", "rad", 0.0174532925), ("psi", "bar", 0.0689475729), ("%", "1", 0.01), ("ns", "s", 1e-9)],
)  # fmt: skip
def test_units_convert_by_their_definitions(unit: str, target: str, factor: float) -> None:
    assert unit_factor(unit, target) == pytest.approx(factor, rel=1e-8)


def test_every_unit_returns_to_itself() -> None:
    for unit, (dimension, _) in UNITS.items():
        for other, (kind, _) in UNITS.items():
            if dimension == kind:
                assert unit_factor(unit, other) * unit_factor(other, unit) == pytest.approx(1.0)


def test_units_of_different_things_are_refused() -> None:
    with pytest.raises(InputError, match="bar is of pressure, m/s of speed"):
        unit_factor("bar", "m/s")


@pytest.mark.parametrize(
    ("target", "ratio", "unit"),
    [("m/s", 3.6, "km/h"), ("deg", 1 / 57.3, "rad"), ("MPa", 10.0, "bar"), ("m/s", 1.3, None)],
)
def test_a_ratio_names_the_unit_that_explains_it(target: str, ratio: float, unit: str | None) -> None:
    assert guess_unit(target, ratio) == unit


def test_sign_scale_offset_and_delay_act_as_the_map_says() -> None:
    rule = ChannelRule(
        channel="pitch", sources=("x",), unit="rad", sign=-1, scale=1.1, offset=0.2, delay=0.03
    )
    found = convert_to_channel(Signal(time=np.array([1.0, 2.0]), values=np.array([0.0, np.pi / 180])), rule)
    np.testing.assert_allclose(found.values, [0.2, -1.1 + 0.2])
    np.testing.assert_allclose(found.time, [0.97, 1.97])


def test_a_gain_changes_the_quantity() -> None:
    gain = Gain(value=0.01, source_unit="N m", target_unit="bar")
    rule = ChannelRule(channel="brake_pressure", sources=("x",), unit="kN m", gain=gain)
    assert rule.factor == pytest.approx(1.0)


def test_a_slow_signal_is_linear_between_its_samples() -> None:
    slow = Signal(time=np.array([0.0, 0.5, 1.0]), values=np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(
        resample_on_clock(slow, np.array([0.0, 0.25, 0.5, 0.75])), [0.0, 0.5, 1.0, 0.5]
    )


def test_a_sample_that_falls_on_the_clock_within_rounding_is_taken_as_it_is() -> None:
    start = 1_761_234_585.16  # a log of Unix times, in steps that no floating-point number is
    time = start + np.arange(400) * 0.1
    speed = np.round(20.0 + 5.0 * np.sin(0.3 * np.arange(400))) / 3.6
    clock = make_common_clock([Signal(time=time, values=speed)], 10.0)
    np.testing.assert_array_equal(
        resample_on_clock(Signal(time=np.round(time, 3), values=speed), clock), speed
    )


def test_a_fast_signal_keeps_its_mean_and_does_not_fold_into_the_clock() -> None:
    t = np.arange(20001) / 10_000
    tone = Signal(time=t, values=3.0 + np.sin(2 * np.pi * 100.0 * t + 0.9))
    clock = np.arange(10, 190) / 100
    np.testing.assert_allclose(resample_on_clock(tone, clock), 3.0, atol=2e-3)


def test_the_common_clock_covers_only_what_all_signals_have() -> None:
    def signal(start: float, end: float) -> Signal:
        return Signal(time=np.linspace(start, end, 50), values=np.zeros(50))

    clock = make_common_clock([signal(0.0, 2.0), signal(0.5, 3.0)], 10.0)
    assert (clock[0], clock[-1], len(clock)) == (0.5, 2.0, 16)
    assert not len(make_common_clock([signal(0.0, 1.0), signal(2.0, 3.0)], 10.0))


def test_a_run_with_a_problem_gives_no_columns() -> None:
    t = np.arange(300) / 100
    rule = ChannelRule(channel="pitch", sources=("x",), unit="deg")
    sound = assemble_run({"x": Signal(time=t, values=np.sin(t))}, [rule], -np.inf, np.inf, 100.0, TABLE)
    assert list(sound.columns) == ["pitch"] and not sound.problems
    broken = assemble_run({"x": Signal(time=t, values=90 * np.sin(t))}, [rule], -np.inf, np.inf, 100.0, TABLE)
    assert broken.problems and not broken.columns


@pytest.mark.parametrize("delay", [0.05, -0.12])
def test_the_delay_of_one_channel_shifts_it_and_no_other(delay: float) -> None:
    t = np.arange(400) / 100
    signals = {"x": Signal(time=t, values=np.sin(t)), "late": Signal(time=t, values=np.sin(t - delay))}
    rules = [
        ChannelRule(channel="yaw_rate", sources=("x",), unit="deg/s"),
        ChannelRule(channel="roll_rate", sources=("late",), unit="deg/s", delay=delay),
    ]
    found = assemble_run(signals, rules, 1.0, 3.0, 100.0, TABLE)
    truth = np.sin(found.start + 0.01 * np.arange(len(found.columns["yaw_rate"])))
    for values in found.columns.values():
        np.testing.assert_allclose(values, truth, atol=1e-4)


def test_active_samples_up_to_the_gap_apart_are_one_episode() -> None:
    t = np.arange(100) * 0.02
    pressure = np.zeros(100)
    pressure[10:15] = pressure[18:20] = pressure[30:33] = 0.2
    near, far = find_pressure_episodes(t, pressure, threshold=0.12, merge_gap=0.08)
    assert (near.onset, near.onset_time, near.end_time) == (10, t[10], t[19])
    assert far.onset == 30 and far.duration == pytest.approx(0.04)
    assert len(find_pressure_episodes(t, pressure, threshold=0.12, merge_gap=0.079)) == 3
    assert find_pressure_episodes(t, pressure, threshold=0.3, merge_gap=0.08) == ()
