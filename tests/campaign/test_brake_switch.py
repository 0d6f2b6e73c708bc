"""A brake switch in place of a command."""

import numpy as np
import pytest

from tasks.campaign.brake_switch import describe_brake_switch
from tasks.campaign.signals import ChannelRule, Signal

TIME = np.arange(400) / 100.0
PRESSED = np.where(TIME > 2.0, 1.0, 0.0)


def describe_switch(*brakes: np.ndarray, channel: str = "brake_command", unit: str = "1") -> list[str]:
    rule = ChannelRule(channel=channel, sources=("brake",), unit=unit)
    speed = ChannelRule(channel="speed", sources=("v",), unit="m/s")
    recordings = [
        {"brake": Signal(time=TIME, values=brake, unit=""), "v": Signal(time=TIME, values=PRESSED, unit="")}
        for brake in brakes
    ]
    return describe_brake_switch(recordings, (speed, rule))


@pytest.mark.parametrize("on", [1.0, 100.0])
def test_a_switch_is_told(on: float) -> None:
    (told,) = describe_switch(on * PRESSED, np.where(PRESSED > 0.0, on, np.nan))
    assert f"brake_command has the values 0 and {on:g} alone" in told
    assert "not how hard" in told


@pytest.mark.parametrize(
    "brakes",
    [
        (0.3 * PRESSED, 0.5 * PRESSED),
        (np.minimum(np.maximum(TIME - 2.0, 0.0), 1.0),),
        (0.0 * PRESSED,),
    ],
)
def test_a_command_of_several_levels_is_no_switch(brakes: tuple[np.ndarray, ...]) -> None:
    assert describe_switch(*brakes) == []


def test_a_map_without_brake_has_no_switch() -> None:
    assert describe_brake_switch([], ()) == []
