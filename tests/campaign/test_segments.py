"""A whole drive is cut at its brake applications, and what is no run is told."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.campaign.segments import Segment, SegmentRule, cut_segments, find_brake_rule
from tasks.campaign.signals import ChannelRule, Signal
from tests.campaign.telling import TABLE

CUT = SegmentRule(threshold=0.3, merge_gap=0.5, minimum=0.5, before=2.0, after=0.5)
SPEED = ChannelRule(channel="speed", sources=("v",), unit="m/s")
TIME = np.arange(3000) * 0.01
UNITS = {"brake_pressure": ("MPa", 1.0), "brake_command": ("%", 10.0), "pedal_force": ("N", 50.0)}
"""Unit of each brake signal, and its value where 1 MPa is braked with."""


def cut_drive(
    *applied: tuple[float, float], channel: str = "brake_pressure", speed: NDArray[np.float64] | None = None,
    kept: NDArray[np.bool_] | None = None,
) -> list[Segment]:  # fmt: skip
    """Segments of a drive of 30 s that brakes with 1 MPa from and to the given times."""
    unit, size = UNITS[channel]
    time, brake = TIME, np.zeros(len(TIME))
    for start, end in applied:
        brake[(time >= start - 1e-9) & (time <= end + 1e-9)] = size
    rules = [SPEED, ChannelRule(channel=channel, sources=("b",), unit=unit)]
    kept = np.ones(len(TIME), dtype=bool) if kept is None else kept
    driven = np.full(len(TIME), 20.0) - 0.01 * TIME if speed is None else speed
    signals = {"b": Signal(time=TIME, values=brake), "v": Signal(time=TIME[kept], values=driven[kept])}
    rule = find_brake_rule(rules)
    assert rule is not None
    return cut_segments(signals, rules, rule, CUT, TABLE)


@pytest.mark.parametrize("channel", UNITS)
def test_every_brake_signal_cuts_by_the_pressure_that_it_stands_for(channel: str) -> None:
    (segment,) = cut_drive((10.0, 12.0), channel=channel)
    assert (segment.start, segment.end) == pytest.approx((8.0, 12.5)) and not segment.fault
    assert find_brake_rule([SPEED]) is None


def test_a_signal_that_idles_above_the_threshold_says_so() -> None:
    """A drive-by-wire command idles at 0.15: the whole drive was one application, and the car was said to stand."""
    rule = ChannelRule(channel="brake_command", sources=("b",), unit="1")
    command = np.where((TIME > 10.0) & (TIME < 12.0), 0.3, 0.15)
    (segment,) = cut_segments({"b": Signal(time=TIME, values=command)}, [rule], rule, CUT, TABLE)
    assert "brake_command never falls below 0.15 (taken for 1.5 MPa): above_mpa must be" in segment.fault
    assert segment.fault.endswith("it is 0.03 (taken for 0.3 MPa)")
    # a recording that the brake starts is all braking, and idles nowhere
    pressed = np.clip(0.05 + (TIME - 5.0) / 10.0, 0.05, 0.5)[500:1200]
    (segment,) = cut_segments({"b": Signal(time=TIME[500:1200], values=pressed)}, [rule], rule, CUT, TABLE)
    assert not segment.fault
    above = SegmentRule(threshold=1.6, merge_gap=0.5, minimum=0.5, before=2.0, after=0.5)
    (segment,) = cut_segments({"b": Signal(time=TIME, values=command)}, [rule], rule, above, TABLE)
    assert not segment.fault and segment.start == pytest.approx(8.0, abs=0.02)


def test_a_drive_is_cut_by_the_mean_of_its_brake_signals_and_an_empty_one_cuts_nothing() -> None:
    pressed = Signal(time=TIME, values=np.where((TIME > 10.0) & (TIME < 12.0), 2.0, 0.0))
    dead, empty = Signal(time=TIME[::7], values=np.zeros(429)), Signal(time=np.empty(0), values=np.empty(0))
    for sources, count in (
        (("p", "dead"), 1),
        (("dead", "p"), 1),
        (("dead",), 0),
        (("empty",), 0),
        (("p", "empty"), 0),
    ):
        rule = ChannelRule(channel="brake_pressure", sources=sources, unit="MPa")
        assert (
            len(cut_segments({"p": pressed, "dead": dead, "empty": empty}, [rule], rule, CUT, TABLE)) == count
        )


@pytest.mark.parametrize("applied", [(), ((10.0, 10.2),)])
def test_a_drive_without_a_brake_application_has_no_segments(
    applied: tuple[tuple[float, float], ...],
) -> None:
    assert cut_drive(*applied) == []


def test_a_segment_begins_where_the_one_before_it_ends() -> None:
    first, second, third = cut_drive((10.0, 12.0), (13.0, 14.0), (14.6, 16.0))
    assert (first.start, first.end) == pytest.approx((8.0, 12.5))
    assert (second.start, second.end) == pytest.approx((12.5, 14.5))
    assert (third.start, third.end) == pytest.approx((14.5, 16.5))


def test_no_segment_reaches_into_the_next_application() -> None:
    cut = SegmentRule(threshold=0.3, merge_gap=0.5, minimum=0.5, before=2.0, after=3.0)
    brake = np.where(((TIME >= 10.0) & (TIME < 12.0)) | ((TIME >= 13.0) & (TIME < 14.0)), 1.0, 0.0)
    rule = ChannelRule(channel="brake_pressure", sources=("b",), unit="MPa")
    first, second = cut_segments({"b": Signal(time=TIME, values=brake)}, [rule], rule, cut, TABLE)
    assert first.end == second.start == pytest.approx(12.5, abs=0.01)


def test_a_brake_of_a_standing_car_is_no_run() -> None:
    speed = np.clip(2.0 * (TIME - 5.0), 0.0, 20.0)
    standing, driving = cut_drive((0.0, 4.0), (20.0, 22.0), speed=speed)
    assert "the car stands" in standing.fault and not driving.fault
    (crawling,) = cut_drive((10.0, 12.0), speed=np.full(len(TIME), 1.5))
    assert "slower than 2 m/s" in crawling.fault


def test_a_segment_begins_where_the_car_has_driven_off() -> None:
    (segment,) = cut_drive((10.0, 12.0), speed=np.clip(4.0 * (TIME - 8.5), 0.0, 20.0))
    assert segment.start == pytest.approx(9.0, abs=0.011) and not segment.fault


def test_a_segment_with_a_gap_of_its_clock_is_left_out_and_no_other() -> None:
    kept = (TIME < 10.5) | (TIME > 11.0)
    broken, whole = cut_drive((10.0, 12.0), (20.0, 22.0), kept=kept)
    assert broken.fault.startswith("channel speed has gaps") and not whole.fault
    silent, whole = cut_drive((10.0, 12.0), (20.0, 22.0), kept=TIME > 15.0)
    assert silent.fault == "channel speed has 0 samples in it" and not whole.fault
