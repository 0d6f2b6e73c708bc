"""The channel of the brake beside the speed: a sign, a swapped column, and what is no fault."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.campaign.channel_validation import find_plausibility_problems
from tasks.campaign.channels import CHANNELS_BY_NAME

INTERVAL = 0.05
TIME = np.arange(120) * INTERVAL
BRAKE = np.clip((TIME - 3.0) / 0.3, 0.0, 1.0)
"""Share of the brake: off for 3 s, then on."""
UNIT = {"brake_pressure": 3.0, "brake_torque": 3000.0, "brake_command": 0.6, "pedal_force": 150.0}


def problems_of(name: str, brake: NDArray[np.float64], deceleration: NDArray[np.float64]) -> list[str]:
    speed = 45.0 - np.cumsum(deceleration) * INTERVAL
    return find_plausibility_problems(
        {name: UNIT[name] * brake, "speed": speed},
        INTERVAL,
        {name: CHANNELS_BY_NAME[name].unit, "speed": "m/s"},
    )


@pytest.mark.parametrize("name", UNIT)
def test_a_signal_that_is_high_while_the_car_does_not_brake_is_another_one(name: str) -> None:
    (problem,) = problems_of(name, 1.0 - BRAKE, 9.0 * BRAKE)
    assert problem.startswith(f"channel {name} is no brake: the car slows by") and "swapped" in problem


@pytest.mark.parametrize("name", UNIT)
def test_a_signal_that_is_negative_while_the_car_brakes_is_turned_over(name: str) -> None:
    assert f"channel {name} is negative while the car brakes: turn its sign over" in problems_of(
        name, -BRAKE, 9.0 * BRAKE
    )


@pytest.mark.parametrize(
    ("name", "brake"), [("brake_pressure", -0.2), ("brake_command", -0.5), ("pedal_force", -0.8)]
)
def test_a_brake_that_pulls_is_an_offset(name: str, brake: float) -> None:
    (problem,) = problems_of(name, BRAKE + brake * (TIME < 0.1), 5.0 * BRAKE)
    assert problem.startswith(f"channel {name} falls to {brake * UNIT[name]:g}")


@pytest.mark.parametrize("name", UNIT)
@pytest.mark.parametrize(
    "deceleration",
    [
        5.0 * BRAKE,
        2.5 * (1.0 - BRAKE) + 1.0 * BRAKE,  # an engine brakes first, and the brake less
        1.0 - 1.5 * BRAKE,  # the brake holds the car back on a steep descent, and it still gains speed
    ],
)
def test_a_sound_brake_raises_no_alarm(name: str, deceleration: NDArray[np.float64]) -> None:
    assert problems_of(name, BRAKE, deceleration) == []


@pytest.mark.parametrize(("slower", "told"), [(1.0, False), (30.0, False), (1000.0, True)])
def test_a_stop_of_an_hour_is_a_time_in_ms(slower: float, told: bool) -> None:
    speed = 45.0 - 9.0 * np.cumsum(BRAKE) * INTERVAL
    columns = {"brake_pressure": 3.0 * BRAKE, "speed": speed}
    problems = find_plausibility_problems(
        columns, slower * INTERVAL, {"brake_pressure": "MPa", "speed": "m/s"}
    )
    assert any("correct the unit of time" in problem for problem in problems) == told
