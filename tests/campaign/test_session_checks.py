"""Checks of all runs together, and of recordings before runs are looked for."""

import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from tasks.campaign.checks import apply_checks
from tasks.campaign.clocks import measure_fall
from tasks.campaign.measured import Clock, Recordings
from tasks.campaign.signals import ChannelRule, Signal
from tests.campaign.telling import CONDITIONS, TABLE, tell_session

Values = NDArray[np.float64]
Columns = dict[str, Values]
GAIN = 2.4
"""Deceleration per pressure of the toy car [m/s^2 per MPa]."""


def make_stop(pressure: float, *, motor: float = 0.0, most: float = np.inf) -> Columns:
    """Channels of a stop with a motor that gives the first ``motor`` m/s^2, at most ``most`` m/s^2 in all."""
    rng = np.random.default_rng(3)
    applied = np.clip((np.arange(400) - 100) / 50, 0.0, 1.0)
    deceleration = np.minimum(applied * (GAIN * pressure + motor), most)
    return {
        "brake_pressure": np.maximum(applied * pressure + 0.002 * rng.standard_normal(400), 0.0),
        "speed": 30.0 - np.cumsum(deceleration) * 0.01 + 0.01 * rng.standard_normal(400),
        "engine_torque": -500.0 * motor * applied,
    }


def tell_gain(
    *stops: Columns, scale: float = 1.0, with_torque: bool = False, slippery: tuple[str, ...] = ()
) -> list[str]:
    runs = {
        f"s{number}": {
            name: values * (scale if name == "brake_pressure" else 1.0)
            for name, values in stop.items()
            if with_torque or name != "engine_torque"
        }
        for number, stop in enumerate(stops, start=1)
    }
    told = tell_session(runs, slippery=slippery)
    return [sentence for check, sentence in told.items() if "_brake" in check]


PLAIN = [make_stop(p) for p in (1.0, 2.0, 3.0)]
BLENDED = [make_stop(p, motor=m) for p, m in ((0.05, 2.5), (0.1, 2.5), (0.6, 2.0), (2.0, 1.5))]
SLIDING = [make_stop(p, most=1.6) for p in (1.0, 2.0, 4.0)]
SNOW = [make_stop(15.0, most=2.0), make_stop(14.0, most=3.5)]


def rescale(stop: Columns, factor: float) -> Columns:
    return stop | {"brake_pressure": factor * stop["brake_pressure"]}


@pytest.mark.parametrize(
    ("stops", "slippery"),
    [
        (PLAIN, ()),
        (BLENDED, ()),
        (SLIDING, ()),
        ([*PLAIN, *SLIDING], ()),
        ([*PLAIN, make_stop(0.02, motor=2.0)], ()),
        ([*PLAIN, *SNOW], ("s4", "s5")),
        (SNOW, ("s1", "s2")),
    ],
)
def test_engine_motor_and_friction_are_no_fault_of_the_gauge(
    stops: list[Columns], slippery: tuple[str, ...]
) -> None:
    assert tell_gain(*stops, slippery=slippery) == []


@pytest.mark.parametrize(
    ("stops", "scale", "slippery", "words"),
    [
        (PLAIN, 0.1, (), "gives 24 m/s^2 per MPa over the braking of s1, s2, s3,"),
        (PLAIN, 12.0, (), "gives 0.2 m/s^2 per MPa over the braking of s1, s2, s3,"),
        ([*PLAIN, *SLIDING], 0.1, (), "over the braking of s2, s3,"),
        ([*PLAIN, *SLIDING], 12.0, (), "over the braking of s1, s2, s3, s4, s5, s6,"),
        (PLAIN * 3, 12.0, (), "over the braking of s1, s2, s3, s4, s5, s6 and 3 more,"),
        # one recording of its own scale
        ([*PLAIN[:2], rescale(PLAIN[2], 0.1), *PLAIN], 1.0, (), "over the braking of s3, which"),
        ([*PLAIN[:2], rescale(PLAIN[2], 12.0), *PLAIN], 1.0, (), "over the braking of s3, which"),
        ([*PLAIN, *SNOW], 1.0, (), "over the braking of s4, s5, which"),
        (SNOW, 1.0, (), "over the braking of s1, s2, which"),
        # a stop on a slippery road hides no wrong scale
        ([*PLAIN, make_stop(1.0, most=1.6)], 12.0, ("s4",), "s1, s2, s3, which"),
        ([*PLAIN, make_stop(1.0, most=1.6)], 0.1, ("s4",), "s1, s2, s3, s4, which"),
    ],
)
def test_a_pressure_ten_times_off_is_named_with_its_runs(
    stops: list[Columns], scale: float, slippery: tuple[str, ...], words: str
) -> None:
    (problem,) = tell_gain(*stops, scale=scale, slippery=slippery)
    assert words in problem
    assert ("map the motor's torque as engine_torque" in problem) == ("at most 8" in problem)


def test_a_measured_motor_is_no_fault_of_the_gauge_even_at_one_pressure() -> None:
    alike = make_stop(0.1, motor=1.0)
    alike["brake_pressure"] = np.where(alike["brake_pressure"] > 0.09, 0.1, 0.0)
    (problem,) = tell_gain(*[alike] * 3)
    assert "map the motor's torque as engine_torque" in problem
    assert tell_gain(*[alike] * 3, with_torque=True) == []


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_pressure_ten_times_off_is_found_in_measured_campaigns(factor: float, outside_data: Path) -> None:
    folders = sorted((outside_data / "measured" / "campaigns").glob("ex-*"))
    if not folders:
        pytest.skip("no campaigns; set MUSYNC_DATA to the folder that holds measured/")
    for folder in folders:
        tables = {file.stem: pq.read_table(file) for file in sorted(folder.glob("runs/*.parquet"))}
        runs = [
            {channel: table.column(channel).to_numpy() for channel in ("brake_pressure", "speed")}
            for table in tables.values()
        ]
        assert tell_gain(*runs) == []
        assert len(tell_gain(*runs, scale=factor)) == 1


TIME = np.arange(500) * 0.01
BRAKE = np.clip((TIME - 1.5) / 0.3, 0.0, 1.0)
SPEED = 30.0 - 6.0 * np.cumsum(BRAKE) * 0.01
TURN = np.clip((TIME - 3.0) / 0.2, 0.0, 1.0)
"""Share of the turn: it begins 1.5 s after the brake."""


def braking_run(**channels: Values) -> Columns:
    return {"brake_pressure": 3.0 * BRAKE, "speed": SPEED, **channels}


def test_a_run_that_brakes_into_a_turn_is_told_with_its_place() -> None:
    runs = {"run-05": braking_run(lateral_acceleration=0.5 * TURN)}
    runs["run-06"] = braking_run(lateral_acceleration=-14.0 * TURN)
    told = tell_session(runs)["turn"]
    assert told.startswith("the car brakes while it turns in run-06 (up to 14 m/s^2 to the side, from 3.")
    assert told.endswith("end such a run at turn-in")
    runs = {f"run-{n:02d}": braking_run(lateral_acceleration=9.0 * TURN) for n in range(40)}
    told = tell_session(runs)["turn"]
    assert "and 34 more" in told and "run-07" not in told


YAW = np.degrees(5.0 * TURN / SPEED)


@pytest.mark.parametrize(
    ("run", "told"),
    [
        (braking_run(yaw_rate=YAW), True),  # speed times yaw rate tells it too
        *(
            ({name: BRAKE, "speed": SPEED, "lateral_acceleration": 6.0 * TURN}, True)
            for name in ("brake_command", "brake_torque", "pedal_force", "brake_stand_in")
        ),
        (braking_run(yaw_rate=YAW, lateral_acceleration=np.zeros(500)), False),
        (braking_run(), False),
        (braking_run(lateral_acceleration=3.0 * TURN), False),  # a bend of a road
        (
            braking_run(lateral_acceleration=np.where(np.abs(TIME - 3.0) < 0.1, 8.0, 0.0)),
            False,
        ),  # a correction
        (braking_run(lateral_acceleration=np.where(TIME < 1.4, 9.0, 0.0)), False),  # a turn before the brake
        ({"speed": SPEED, "lateral_acceleration": 9.0 * TURN}, False),
        ({"brake_pressure": BRAKE, "lateral_acceleration": 9.0 * TURN}, False),
        ({"brake_pressure": 0.0 * BRAKE, "speed": SPEED, "lateral_acceleration": 9.0 * TURN}, False),
    ],
)
def test_only_a_brake_that_is_applied_in_a_turn_is_told(run: Columns, told: bool) -> None:
    assert ("turn" in tell_session({"run-01": run})) == told


PRESSED = np.where(TIME > 2.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("brakes", "on"),
    [
        ((PRESSED, np.where(PRESSED > 0.0, 1.0, np.nan)), 1.0),
        ((100.0 * PRESSED,), 100.0),
        ((0.3 * PRESSED, 0.5 * PRESSED), None),
        ((np.clip(TIME - 2.0, 0.0, 1.0),), None),
        ((0.0 * PRESSED,), None),
    ],
)
def test_a_switch_is_told_and_a_command_of_several_levels_is_none(
    brakes: tuple[Values, ...], on: float | None
) -> None:
    rules = [
        ChannelRule(channel="speed", sources=("v",), unit="m/s"),
        ChannelRule(channel="brake_command", sources=("brake",), unit="1"),
    ]
    logged = [
        {"brake": Signal(time=TIME, values=brake), "v": Signal(time=TIME, values=PRESSED)} for brake in brakes
    ]
    told = [one.sentence for one in apply_checks(TABLE.recordings, Recordings(signals=logged, rules=rules))]
    assert len(told) == (on is not None)
    assert all(f"brake_command has the values 0 and {on:g} alone" in one for one in told)
    assert apply_checks(TABLE.recordings, Recordings(signals=[], rules=())) == []


DRIVE = np.arange(0.0, 60.0, 0.05)
SLOWING = 15.0 + 10.0 * np.cos(2 * np.pi * DRIVE / 12.0)
"""A car that slows and picks up again, by 5 m/s^2 at most."""


def tell_clock(factor: float, taken: str = "s", speed: Values = SLOWING) -> str:
    rule = ChannelRule(channel="speed", sources=("v",), unit="m/s")
    logged = {"v": Signal(time=DRIVE * factor, values=speed)}
    told = apply_checks(TABLE.recording, Recordings(signals=[logged], rules=[rule], clock_unit=taken))
    return "".join(one.sentence for one in told)


@pytest.mark.parametrize(
    ("factor", "taken", "words"),
    [
        (1e-4, "s", r"samples come every 0.005 ms .* the clock is not in s, it looks like h"),
        (1e-3, "s", r"samples come every 0.05 ms .* the clock is not in s, it looks like ks"),
        (1 / 60, "s", r"samples come every 0.833 ms .* the clock is not in s, it looks like min"),
        (1e3, "s", r"the clock is not in s, it looks like ms"),
        (1e-3, "us", r"the clock is not in us, it looks like ms"),
    ],
)
def test_a_clock_in_another_unit_is_told_as_a_clock(factor: float, taken: str, words: str) -> None:
    assert re.match(f".*{words}: correct the unit of time in the map$", tell_clock(factor, taken))


def test_a_sound_clock_a_lost_sample_and_a_speed_in_km_h_are_no_faults_of_the_clock() -> None:
    lost = SLOWING.copy()
    lost[::400] = 0.0
    assert tell_clock(1.0) == tell_clock(1.0, speed=lost) == tell_clock(1.0, speed=3.6 * SLOWING) == ""


def test_a_fall_is_measured_over_the_least_time_in_which_the_speed_falls_so_far() -> None:
    conditions = CONDITIONS["fall"]
    assert measure_fall(DRIVE, SLOWING, **conditions) == pytest.approx(4.4, abs=0.8)
    assert measure_fall(DRIVE, 0.0 * SLOWING, **conditions) is None


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ([0.0, 1.2, 0.0, 1.5], "begins again at sample 3, first from 1.200 to 0.000 s"),
        ([0.0, 9.0, np.nan, 1.0, 5.0, 2.0], "at samples 4, 6, "),
        ([0.0, 1.0, 0.8, 2.0], ""),
        ([0.0, 1.0, 1.0], ""),
    ],
)
def test_a_clock_that_stumbles_has_not_begun_again(times: list[float], words: str) -> None:
    told = "".join(one.sentence for one in apply_checks(TABLE.clock, Clock(time=np.array(times))))
    assert words in told and bool(words) == bool(told)
