"""The sign of an engine's or motor's torque, by the car that it drives."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.campaign.channel_validation import find_plausibility_problems
from tasks.campaign.channels import CHANNELS_BY_NAME

INTERVAL = 0.02
TIME = np.arange(400) * INTERVAL
MASS, RADIUS = 1600.0, 0.32
DRIVE = np.where(TIME < 2.0, 1200.0, -900.0)
"""Torque of an electric car: the driver accelerates, and takes the foot off at 2 s [N m]."""
BRAKE = np.clip((TIME - 5.0) / 0.3, 0.0, 1.0)
Values = NDArray[np.float64]


def problems_of(
    torque: Values, told: Values, *, brake: Values = BRAKE, resistance: float = 0.2, **more: Values
) -> list[str]:
    rate = torque / (MASS * RADIUS) - resistance - 5.0 * brake - 9.81 * np.sin(more.get("slope", 0.0 * TIME))
    columns = {
        "brake_pressure": 2.5 * brake,
        "speed": 25.0 + np.cumsum(rate) * INTERVAL,
        "engine_torque": told,
    }
    if "slope" in more:
        columns["road_slope"] = np.degrees(more["slope"])
    found = find_plausibility_problems(
        columns, INTERVAL, {name: CHANNELS_BY_NAME[name].unit for name in columns}
    )
    return [problem for problem in found if "engine_torque" in problem]


def test_a_torque_that_drives_the_car_where_it_slows_is_turned_over() -> None:
    (problem,) = problems_of(DRIVE, -DRIVE)
    assert problem.startswith(
        "channel engine_torque runs against the rate of speed while the brake is released"
    )
    assert problem.endswith("turn its sign over")


def test_the_slope_of_the_road_is_taken_off_where_it_is_mapped() -> None:
    climb = 0.15 * np.sin(TIME)
    torque = 3.0 * MASS * RADIUS * np.sin(TIME) - 1.3 * MASS * RADIUS * np.sin(TIME)
    assert problems_of(torque, torque, brake=np.zeros(400), slope=climb) == []
    assert len(problems_of(torque, -torque, brake=np.zeros(400), slope=climb)) == 1


@pytest.mark.parametrize(
    ("torque", "told"),
    [
        (DRIVE, DRIVE),
        (0.05 * DRIVE, -0.05 * DRIVE),  # too little to tell
        (DRIVE, np.zeros(400)),
        (DRIVE, -0.01 * DRIVE),  # a torque in kN m, or a share
        (-900.0 * (1.0 - BRAKE), 900.0 * BRAKE - 900.0),  # the brake takes over from the motor
        (np.where(TIME < 0.5, 300.0, 0.0), np.where(TIME < 0.5, -300.0, 0.0)),
    ],
)  # fmt: skip
def test_a_sound_torque_and_one_that_says_nothing_raise_no_alarm(torque: Values, told: Values) -> None:
    assert problems_of(torque, told) == []


def test_a_slope_that_is_driven_up_with_more_torque_is_no_fault() -> None:
    climb = 0.05 * np.sin(TIME)
    torque = MASS * RADIUS * 9.81 * 0.8 * climb
    rate = torque / (MASS * RADIUS) - 9.81 * np.sin(climb)
    columns = {
        "brake_pressure": 0.0 * TIME,
        "speed": 25.0 + np.cumsum(rate) * INTERVAL,
        "engine_torque": torque,
    }
    assert find_plausibility_problems(columns, INTERVAL, dict.fromkeys(columns, "MPa")) == []


def test_a_signal_in_place_of_the_pressure_does_not_say_when_the_brake_is_released() -> None:
    """One of a thousandth of its scale: the brake takes over from the motor, and seems released."""
    rate = -(1.0 + 5.0 * BRAKE)
    columns = {
        "brake_pressure": 0.001 * BRAKE,
        "speed": 40.0 + np.cumsum(rate) * INTERVAL,
        "engine_torque": 900.0 * BRAKE - 900.0,
    }
    units = {"brake_pressure": "N m", "speed": "m/s", "engine_torque": "N m"}
    assert find_plausibility_problems(columns, INTERVAL, units) == []


def test_without_a_signal_of_the_brake_nothing_is_told() -> None:
    speed = 25.0 + np.cumsum(DRIVE / (MASS * RADIUS)) * INTERVAL
    columns = {"speed": speed, "engine_torque": -DRIVE}
    assert find_plausibility_problems(columns, INTERVAL, {"speed": "m/s", "engine_torque": "N m"}) == []
