"""The unit of the brake pressure, by the deceleration that it gives over all runs."""

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from tasks.campaign.brake_gain import find_gain_problems

Runs = dict[str, dict[str, np.ndarray]]
INTERVAL = 0.01
GAIN = 2.4
"""Deceleration per pressure of the toy car [m/s^2 per MPa]."""


def make_stop(pressure: float, *, motor: float = 0.0, most: float = np.inf) -> dict[str, np.ndarray]:
    """Channels of a stop with a motor that gives the first ``motor`` m/s^2, at most ``most`` m/s^2 in all."""
    rng = np.random.default_rng(3)
    applied = np.clip((np.arange(400) - 100) / 50, 0.0, 1.0)
    deceleration = np.minimum(applied * (GAIN * pressure + motor), most)
    return {
        "brake_pressure": np.maximum(applied * pressure + 0.002 * rng.standard_normal(400), 0.0),
        "speed": 30.0 - np.cumsum(deceleration) * INTERVAL + 0.01 * rng.standard_normal(400),
        "engine_torque": -500.0 * motor * applied,
    }


def make_runs(*stops: dict[str, np.ndarray], scale: float = 1.0, with_torque: bool = False) -> Runs:
    return {
        f"s{number}": {"brake_pressure": scale * stop["brake_pressure"], "speed": stop["speed"]}
        | ({"engine_torque": stop["engine_torque"]} if with_torque else {})
        for number, stop in enumerate(stops, start=1)
    }


PLAIN = [make_stop(p) for p in (1.0, 2.0, 3.0)]
BLENDED = [
    make_stop(0.05, motor=2.5), make_stop(0.1, motor=2.5), make_stop(0.6, motor=2.0), make_stop(2.0, motor=1.5)
]  # fmt: skip
SLIDING = [make_stop(p, most=1.6) for p in (1.0, 2.0, 4.0)]


@pytest.mark.parametrize(
    "stops", [PLAIN, BLENDED, SLIDING, [*PLAIN, *SLIDING], [*PLAIN, make_stop(0.02, motor=2.0)]]
)
def test_engine_motor_and_friction_are_no_fault_of_the_gauge(stops: list[dict[str, np.ndarray]]) -> None:
    assert find_gain_problems(make_runs(*stops), INTERVAL) == []


@pytest.mark.parametrize(
    ("stops", "scale", "words"),
    [
        (PLAIN, 0.1, "gives 24 m/s^2 per MPa over the braking of s1, s2, s3,"),
        (PLAIN, 12.0, "gives 0.2 m/s^2 per MPa over the braking of s1, s2, s3,"),
        ([*PLAIN, *SLIDING], 0.1, "over the braking of s2, s3,"),
        ([*PLAIN, *SLIDING], 12.0, "over the braking of s1, s2, s3, s4, s5, s6,"),
        (PLAIN * 3, 12.0, "over the braking of s1, s2, s3, s4, s5, s6 and 3 more,"),
    ],
)
def test_a_pressure_ten_times_off_is_named_with_its_runs(
    stops: list[dict[str, np.ndarray]], scale: float, words: str
) -> None:
    (problem,) = find_gain_problems(make_runs(*stops, scale=scale), INTERVAL)
    assert words in problem
    assert ("map the motor's torque as engine_torque" in problem) == (scale < 1.0)


@pytest.mark.parametrize("factor", [0.1, 12.0])
def test_one_recording_of_its_own_scale_is_named(factor: float) -> None:
    runs = make_runs(*PLAIN, *PLAIN)
    runs["s3"]["brake_pressure"] = factor * runs["s3"]["brake_pressure"]
    (problem,) = find_gain_problems(runs, INTERVAL)
    assert "over the braking of s3, which" in problem


@pytest.mark.parametrize("dry", [PLAIN, []])
def test_anti_lock_stops_on_a_slippery_road_are_no_fault_of_the_gauge(
    dry: list[dict[str, np.ndarray]],
) -> None:
    snow = [make_stop(15.0, most=2.0), make_stop(14.0, most=3.5)]
    runs = make_runs(*dry, *snow)
    slippery = list(runs)[len(dry) :]
    assert find_gain_problems(runs, INTERVAL, slippery=slippery) == []
    (problem,) = find_gain_problems(runs, INTERVAL)
    assert f"over the braking of {', '.join(slippery)}, which" in problem


@pytest.mark.parametrize(("scale", "named"), [(12.0, "s1, s2, s3, which"), (0.1, "s1, s2, s3, s4, which")])
def test_a_stop_on_a_slippery_road_hides_no_wrong_scale(scale: float, named: str) -> None:
    runs = make_runs(*PLAIN, make_stop(1.0, most=1.6), scale=scale)
    (problem,) = find_gain_problems(runs, INTERVAL, slippery=["s4"])
    assert named in problem


def test_a_measured_motor_is_no_fault_of_the_gauge_even_at_one_pressure() -> None:
    alike = [make_stop(0.1, motor=1.0)] * 3
    for stop in alike:
        stop["brake_pressure"] = np.where(stop["brake_pressure"] > 0.09, 0.1, 0.0)
    (problem,) = find_gain_problems(make_runs(*alike), INTERVAL)
    assert "map the motor's torque as engine_torque" in problem
    assert find_gain_problems(make_runs(*alike, with_torque=True), INTERVAL) == []


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_pressure_ten_times_off_is_found_in_measured_campaigns(factor: float, outside_data: Path) -> None:
    folders = sorted((outside_data / "measured" / "campaigns").glob("ex-*"))
    if not folders:
        pytest.skip("no campaigns; set MUSYNC_DATA to the folder that holds measured/")
    for folder in folders:
        tables = {file.stem: pq.read_table(file) for file in sorted(folder.glob("runs/*.parquet"))}
        runs = {
            name: {channel: table.column(channel).to_numpy() for channel in ("brake_pressure", "speed")}
            for name, table in tables.items()
        }
        assert find_gain_problems(runs, INTERVAL) == []
        for run in runs.values():
            run["brake_pressure"] = factor * run["brake_pressure"]
        assert len(find_gain_problems(runs, INTERVAL)) == 1
