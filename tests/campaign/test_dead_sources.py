"""A dead sensor in a list of which the mean is taken."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.campaign.channels import CHANNELS_BY_NAME
from tasks.campaign.dead_sources import find_dead_sources
from tasks.campaign.signals import ChannelRule, Signal

TIME = np.arange(300) / 100.0
BRAKE = np.clip(TIME - 1.0, 0.0, 1.0)
NOISE = np.random.default_rng(1).standard_normal(300)


def find_dead(*values: NDArray[np.float64], channel: str = "brake_pressure", unit: str = "MPa") -> list[str]:
    names = ("front", "rear", "other")[: len(values)]
    rule = ChannelRule(channel=channel, sources=names, unit=unit)
    signals = [Signal(time=TIME, values=one, unit=CHANNELS_BY_NAME[channel].unit) for one in values]
    return find_dead_sources(rule, signals)


@pytest.mark.parametrize("level", [0.0, 0.101, 12.0])
@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_a_source_that_holds_one_value_while_another_moves_is_dead(level: float, noise: float) -> None:
    (told,) = find_dead(5.0 * BRAKE, level + noise * NOISE)
    assert told.startswith("its signal rear is dead: it stays at")
    assert "while front moves by 5," in told and "take rear out of source" in told


def test_each_dead_source_is_named() -> None:
    assert [told.split()[2] for told in find_dead(0.0 * TIME, 3.0 * BRAKE, 0.0 * TIME)] == ["front", "other"]


@pytest.mark.parametrize(
    "values",
    [
        (5.0 * BRAKE, 1.0 * BRAKE),  # a valve limits the rear axle
        (5.0 * BRAKE,),
        (0.5 * BRAKE, 0.0 * BRAKE),  # too gentle to tell
        (0.0 * BRAKE, 0.0 * BRAKE),
        (5.0 * BRAKE, np.full(300, np.nan)),  # told by another rule
        (5.0 * BRAKE, np.minimum(4.0 * BRAKE, 0.1)),  # the rear axle is released early
    ],
)
def test_sources_that_move_raise_no_alarm(values: tuple[NDArray[np.float64], ...]) -> None:
    assert find_dead(*values) == []


def test_an_axle_may_drive_alone() -> None:
    assert find_dead(3000.0 * BRAKE, 0.0 * BRAKE, channel="engine_torque", unit="N m") == []


@pytest.mark.parametrize(("channel", "unit"), [("brake_command", "%"), ("steering_angle", "rad")])
def test_other_lists_are_checked_too(channel: str, unit: str) -> None:
    limit = CHANNELS_BY_NAME[channel].limit
    assert len(find_dead(0.5 * limit * BRAKE, 0.0 * BRAKE, channel=channel, unit=unit)) == 1
