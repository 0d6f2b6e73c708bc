"""A brake that is applied in a turn."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.campaign.turning import describe_turning

INTERVAL = 0.01
TIME = np.arange(500) * INTERVAL
BRAKE = np.clip((TIME - 1.5) / 0.3, 0.0, 1.0)
SPEED = 30.0 - 6.0 * np.cumsum(BRAKE) * INTERVAL
TURN = np.clip((TIME - 3.0) / 0.2, 0.0, 1.0)
"""Share of the turn: it begins 1.5 s after the brake."""
Columns = dict[str, NDArray[np.float64]]


def braking_run(**channels: NDArray[np.float64]) -> Columns:
    return {"brake_pressure": 3.0 * BRAKE, "speed": SPEED, **channels}


def test_a_run_that_brakes_into_a_turn_is_told_with_its_place() -> None:
    runs = {"run-05": braking_run(lateral_acceleration=0.5 * TURN)}
    runs["run-06"] = braking_run(lateral_acceleration=-14.0 * TURN)
    (told,) = describe_turning(runs, INTERVAL)
    assert told.startswith(
        "the car brakes while it turns in 1 of 2 runs: run-06 (up to 14 m/s^2 to the side, from 3."
    )
    assert told.endswith("end such a run at turn-in")


def test_speed_times_yaw_rate_tells_it_without_an_accelerometer_to_the_side() -> None:
    yaw = np.asarray(np.degrees(5.0 * TURN / SPEED))
    (told,) = describe_turning({"run-01": braking_run(yaw_rate=yaw)}, INTERVAL)
    assert "run-01 (up to 5 m/s^2" in told
    without = {"run-01": braking_run(yaw_rate=yaw, lateral_acceleration=np.zeros(500))}
    assert describe_turning(without, INTERVAL) == []


@pytest.mark.parametrize("name", ["brake_command", "brake_torque", "pedal_force"])
def test_any_signal_of_the_brake_tells_it(name: str) -> None:
    run = {name: BRAKE, "speed": SPEED, "lateral_acceleration": 6.0 * TURN}
    assert len(describe_turning({"run-01": run}, INTERVAL)) == 1


@pytest.mark.parametrize(
    "run",
    [
        braking_run(),
        braking_run(lateral_acceleration=3.0 * TURN),  # a bend of a road
        braking_run(lateral_acceleration=np.where(np.abs(TIME - 3.0) < 0.1, 8.0, 0.0)),  # a correction
        braking_run(lateral_acceleration=np.where(TIME < 1.4, 9.0, 0.0)),  # a turn before the brake
        {"speed": SPEED, "lateral_acceleration": 9.0 * TURN},
        {"brake_pressure": BRAKE, "lateral_acceleration": 9.0 * TURN},
        {"brake_pressure": 0.0 * BRAKE, "speed": SPEED, "lateral_acceleration": 9.0 * TURN},
    ],
)
def test_a_brake_that_is_applied_straight_on_raises_no_alarm(run: Columns) -> None:
    assert describe_turning({"run-01": run}, INTERVAL) == []


def test_the_sentence_names_no_more_runs_than_one_reads() -> None:
    runs = {f"run-{n:02d}": braking_run(lateral_acceleration=9.0 * TURN) for n in range(40)}
    (told,) = describe_turning(runs, INTERVAL)
    assert "in 40 of 40 runs" in told and "and 34 more" in told and "run-07" not in told
