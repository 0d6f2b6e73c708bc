"""Checks of one run: a sound one raises no alarm, whatever the model lacks, and a fault put into it is named."""

from collections.abc import Callable
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from catalogs.entries import load
from tasks.campaign.assembly import judge_columns
from tasks.campaign.campaign import CHANNELS, Run
from tasks.campaign.channels import SPEED_UNITS, UNITS
from tasks.campaign.measured import MeasuredRun
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.table import EFFECT_TABLE
from tests.campaign.recorded import braking_columns
from tests.campaign.telling import TABLE, tell_run, tell_session
from tests.identification.synthetic import NOISE, SURFACE, VEHICLE, plain_run

Values = NDArray[np.float64]
Columns = dict[str, Values]
TIME = np.arange(120) * 0.05
BRAKE = np.clip((TIME - 3.0) / 0.3, 0.0, 1.0)
"""Share of the brake: off for 3 s, then on."""
SIZE = {"brake_pressure": 3.0, "brake_torque": 3000.0, "brake_command": 0.6, "pedal_force": 150.0}


def stop_with(name: str, brake: Values, deceleration: Values) -> Columns:
    return {name: SIZE[name] * brake, "speed": 45.0 - 0.05 * np.cumsum(deceleration)}


@pytest.mark.parametrize("name", SIZE)
def test_a_signal_with_which_the_car_does_not_brake_is_turned_over_or_another_one(name: str) -> None:
    (problem,) = tell_run(stop_with(name, 1.0 - BRAKE, 9.0 * BRAKE), 0.05)
    assert problem.startswith(f"channel {name} is no brake: the car slows by") and "swapped" in problem
    problem = tell_run(stop_with(name, -BRAKE, 9.0 * BRAKE), 0.05)[-1]
    assert problem.startswith(f"channel {name} is negative while the car brakes")
    assert problem.endswith("turn its sign over")


@pytest.mark.parametrize(
    ("name", "brake"), [("brake_pressure", -0.2), ("brake_command", -0.5), ("pedal_force", -0.8)]
)
def test_a_brake_that_pulls_is_an_offset(name: str, brake: float) -> None:
    (problem,) = tell_run(stop_with(name, BRAKE + brake * (TIME < 0.1), 5.0 * BRAKE), 0.05)
    assert problem.startswith(f"channel {name} falls to {brake * SIZE[name]:g}")


@pytest.mark.parametrize("name", SIZE)
@pytest.mark.parametrize(
    "deceleration",
    [
        5.0 * BRAKE,
        2.5 * (1.0 - BRAKE) + 1.0 * BRAKE,  # an engine brakes first, and the brake less
        1.0 - 1.5 * BRAKE,  # the brake holds the car back on a steep descent, and it still gains speed
    ],
)
def test_a_sound_brake_raises_no_alarm(name: str, deceleration: Values) -> None:
    assert tell_run(stop_with(name, BRAKE, deceleration), 0.05) == []


@pytest.mark.parametrize(("slower", "told"), [(1.0, False), (30.0, False), (1000.0, True)])
def test_a_stop_of_an_hour_is_a_time_in_ms(slower: float, told: bool) -> None:
    problems = tell_run(stop_with("brake_pressure", BRAKE, 9.0 * BRAKE), slower * 0.05)
    assert any("correct the unit of time" in problem for problem in problems) == told


@pytest.mark.parametrize(("true", "taken"), list(permutations(SPEED_UNITS, 2)))
def test_a_speed_in_another_unit_is_told_by_an_accelerometer(true: str, taken: str) -> None:
    channels = {name: braking_columns()[name] for name in ("speed", "longitudinal_acceleration")}
    wrong = channels["speed"] * UNITS[taken][1] / UNITS[true][1]
    (told,) = tell_run(channels | {"speed": wrong}, speed=taken, longitudinal_acceleration="g")
    assert f"taken as {taken}, it looks like {true}" in told
    assert tell_run(channels, speed=taken, longitudinal_acceleration="g") == []


def test_a_stop_harder_than_tyres_give_is_told_without_an_accelerometer() -> None:
    hard = 20.0 - 5.0 * np.clip(0.01 * np.arange(400) - 1.0, 0.0, 3.0)
    assert tell_run({"speed": braking_columns()["speed"]}) == tell_run({"speed": hard}) == []
    (told,) = tell_run({"speed": 3.6 * hard})
    assert "falls by 18 m/s^2, which" in told and "taken as m/s, it looks like km/h" in told


@pytest.mark.parametrize(
    ("radius", "unit", "told"),
    [
        (1 / 3.6, "rad/s", True),
        (1.02 / 3.6, "rad/s", True),  # a worn tyre
        (1.05 / 3.6, "rad/s", False),
        (0.31, "rad/s", False),
        (1 / 3.6, "rpm", False),  # a small tyre, by a logger that counts turns
        (1 / 3.6, "km/h", False),  # converted by a gain
    ],
)
def test_a_wheel_speed_in_km_h_that_is_taken_for_rad_s_is_told(radius: float, unit: str, told: bool) -> None:
    speed = np.linspace(30.0, 10.0, 600)
    runs = {f"run-{k}": {"speed": speed, "wheel_speed_front": speed / radius} for k in range(2)}
    sentences = tell_session(runs, wheel_speed_front=unit)
    assert list(sentences) == ["wheel_in_km_h"] * told
    assert all("1/(3.6 x rolling radius in m)" in one for one in sentences.values())


SPAN = np.arange(400) * 0.02
INERTIA = 1600.0 * 0.32
"""Mass times rolling radius [kg m]."""
DRIVE = np.where(SPAN < 2.0, 1200.0, -900.0)
"""Torque of an electric car: the driver accelerates, and takes the foot off at 2 s [N m]."""
PRESSED = np.clip((SPAN - 5.0) / 0.3, 0.0, 1.0)
CLIMB = 0.15 * np.sin(SPAN)


def drive_with(
    torque: Values, told: Values, brake: Values = PRESSED, climb: Values | None = None, size: float = 2.5
) -> Columns:
    slope = 0.0 * SPAN if climb is None else climb
    rate = torque / INERTIA - 0.2 - 5.0 * brake - 9.81 * np.sin(slope)
    columns = {
        "brake_pressure": size * brake,
        "speed": 25.0 + 0.02 * np.cumsum(rate),
        "engine_torque": told,
    }
    return columns if climb is None else columns | {"road_slope": np.degrees(climb)}


@pytest.mark.parametrize(
    "columns",
    [
        drive_with(DRIVE, -DRIVE),
        # the slope of the road is taken off where it is mapped
        drive_with(1.7 * INERTIA * np.sin(SPAN), -1.7 * INERTIA * np.sin(SPAN), 0.0 * SPAN, CLIMB),
    ],
)
def test_a_torque_that_drives_the_car_where_it_slows_is_turned_over(columns: Columns) -> None:
    (told,) = tell_run(columns, 0.02)
    assert told.startswith("channel engine_torque runs against the rate of speed while the brake is released")
    assert told.endswith("turn its sign over")


UPHILL = INERTIA * 9.81 * 0.8 * 0.05 * np.sin(SPAN)
"""Torque of a driver who goes up a slope with more of it, and still slows there."""


@pytest.mark.parametrize(
    "columns",
    [
        drive_with(DRIVE, DRIVE),
        drive_with(0.05 * DRIVE, -0.05 * DRIVE),  # too little to tell
        drive_with(DRIVE, 0.0 * SPAN),
        drive_with(DRIVE, -0.01 * DRIVE),  # a torque in kN m, or a share
        drive_with(-900.0 * (1.0 - PRESSED), 900.0 * PRESSED - 900.0),  # the brake takes over from the motor
        drive_with(np.where(SPAN < 0.5, 300.0, 0.0), np.where(SPAN < 0.5, -300.0, 0.0)),
        drive_with(1.7 * INERTIA * np.sin(SPAN), 1.7 * INERTIA * np.sin(SPAN), 0.0 * SPAN, CLIMB),
        drive_with(UPHILL - 9.81 * INERTIA * np.sin(0.05 * np.sin(SPAN)), UPHILL, 0.0 * SPAN),
        {name: x for name, x in drive_with(DRIVE, -DRIVE).items() if name != "brake_pressure"},
    ],
)
def test_a_sound_torque_and_one_that_says_nothing_raise_no_alarm(columns: Columns) -> None:
    assert tell_run(columns, 0.02) == []


def test_a_signal_in_place_of_the_pressure_does_not_say_when_the_brake_is_released() -> None:
    """One of a thousandth of its scale: the brake takes over from the motor, and seems released."""
    columns = drive_with(-900.0 * (1.0 - PRESSED), 900.0 * PRESSED - 900.0, size=0.001)
    columns["brake_stand_in"] = columns.pop("brake_pressure")
    assert tell_run(columns, 0.02) == []


def judge_run(run: Run, columns: Columns) -> list[str]:
    about = MeasuredRun(name=run.name, interval=run.interval)
    return judge_columns(columns, {}, about, CHANNELS, TABLE)[1]


def columns_of(run: Run, theta: Values) -> Columns:
    """The run as a car with ``theta`` would have been measured."""
    clean = predict_channels(prepare_run(run, VEHICLE, SURFACE), theta, refinement=4)
    response = clean + NOISE * np.random.default_rng(3).standard_normal(clean.shape)
    columns = dict(zip(CHANNELS, response.T, strict=True))
    return {"time": run.interval * np.arange(len(response)), "brake_pressure": run.pressure, **columns}


@pytest.mark.parametrize("effect", load("library of effects"), ids=lambda effect: effect.name)
@pytest.mark.parametrize("share", [-0.5, 0.5])
def test_an_effect_that_the_model_lacks_is_no_fault(effect: Effect, share: float) -> None:
    theta = np.zeros(len(EFFECT_TABLE))
    for k, parameter in enumerate(effect.parameters):
        bound = parameter.upper if share > 0 else parameter.lower
        size = abs(share) * bound
        if parameter.effect == "engine braking":
            size = min(size, 10.0 * parameter.step)  # a car's, where the bounds are those of trucks
        theta[parameter.index] = size if k == 0 else parameter.start
    for speed, peak in ((6.0, 1.0), (15.0, 1.5), (20.0, 4.0)):
        run = replace(plain_run(speed, peak), disc_rise=150.0)
        assert judge_run(run, columns_of(run, theta)) == []


@pytest.mark.parametrize(("count", "interval"), [(20, 0.01), (150, 0.001)])
def test_a_run_shorter_than_the_smoothing_is_checked_as_any_other(count: int, interval: float) -> None:
    """Twenty samples at 100 Hz are a run; they used to end in a traceback."""
    run = replace(plain_run(20.0, 2.0), interval=interval)
    columns = {name: values[:count] for name, values in columns_of(run, np.zeros(len(EFFECT_TABLE))).items()}
    assert judge_run(run, columns | {"brake_pressure": np.linspace(0.0, 0.5, count)}) == []


def test_a_stop_that_a_slow_log_leaves_with_few_samples_is_no_car_that_stands() -> None:
    city_stop = np.concatenate((np.full(8, 14.0), np.linspace(14.0, 0.0, 8), np.zeros(4)))
    (told,) = tell_run({"speed": city_stop}, 0.5)
    assert "for 20 samples, which take 10 s at 2 Hz" in told
    assert "where it drives, log faster or take a longer run" in told


@pytest.fixture(scope="module")
def runs() -> list[Columns]:
    from tests.conftest import DATA

    folder = Path(DATA) / "measured" / "campaigns"
    files = sorted(folder.glob("ex-*/runs/*.parquet"))
    if not files:
        pytest.skip(f"no campaigns at {folder}; set MUSYNC_DATA to the folder that holds measured/")
    tables = [pq.read_table(file) for file in files]
    return [{name: table.column(name).to_numpy() for name in table.column_names} for table in tables]


def problems_of(columns: Columns) -> list[str]:
    return judge_columns(columns, {}, MeasuredRun(interval=0.01), (), TABLE)[1]


def test_sound_runs_raise_no_alarm(runs: list[Columns]) -> None:
    assert len(runs) == 78
    assert [problem for run in runs for problem in problems_of(run)] == []


def scale_channel(*names: str, factor: float) -> Callable[[Columns], Columns]:
    return lambda run: run | {name: run[name] * factor for name in names}


def hold_channel(name: str) -> Callable[[Columns], Columns]:
    def damage(run: Columns) -> Columns:
        row = np.arange(len(run[name]))
        return run | {name: np.where((row >= 100) & (row < 180), run[name][100], run[name])}

    return damage


def shift_channel(seconds: float) -> Callable[[Columns], Columns]:
    return lambda run: run | {"time": run["time"] + seconds * (np.arange(len(run["time"])) > 150)}


@pytest.mark.parametrize(
    ("damage", "share"),
    [
        (scale_channel("pitch", factor=-1), 1.0),
        (scale_channel("pitch_rate", factor=-1), 1.0),
        (scale_channel("pitch", "pitch_rate", factor=-1), 0.8),
        (scale_channel("longitudinal_acceleration", factor=-1), 1.0),
        (scale_channel("longitudinal_acceleration", factor=1 / 9.81), 1.0),
        (scale_channel("speed", factor=3.6), 1.0),
        (scale_channel("pitch", factor=np.pi / 180), 1.0),
        (hold_channel("pitch"), 1.0),
        (hold_channel("speed"), 1.0),
        (shift_channel(0.4), 1.0),
        (shift_channel(-0.2), 1.0),
    ],
    ids=["pitch over", "rate over", "both over", "accel over", "accel in g", "speed in km/h", "pitch in rad",
         "frozen pitch", "frozen speed", "clock on", "clock back"],
)  # fmt: skip
def test_a_fault_in_a_braking_run_is_found(
    runs: list[Columns], damage: Callable[[Columns], Columns], share: float
) -> None:
    braking = [run for run in runs if run["brake_pressure"].max() > 0.3]
    found = sum(bool(problems_of(damage(run))) for run in braking)
    assert found >= share * len(braking), f"{found} of {len(braking)}"
