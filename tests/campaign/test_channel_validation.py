"""The import's checks on many sound runs: no false alarm, and faults put into them are found."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from tasks.campaign.channel_validation import (
    find_clock_problems,
    find_frozen_problem,
    find_plausibility_problems,
    find_signal_problems,
)
from tasks.campaign.channels import CHANNELS_BY_NAME
from tasks.campaign.signals import Signal

Columns = dict[str, np.ndarray]
INTERVAL = 0.01


@pytest.mark.parametrize(
    ("step", "told"), [(0.0, "repeats: keep_first under time"), (-0.3, "cut the run there")]
)
def test_a_clock_that_repeats_a_stamp_is_told_the_key_for_it(step: float, told: str) -> None:
    time = np.concatenate((INTERVAL * np.arange(50), INTERVAL * (49 + np.arange(50)) + step))
    (problem,) = find_clock_problems(Signal(time=time, values=0.0 * time))
    assert "does not advance" in problem and told in problem and ("keep_first" in problem) == (step == 0.0)


def problems_of(columns: Columns) -> list[str]:
    time = columns["time"]
    channels = {name: values for name, values in columns.items() if name != "time"}
    found = find_plausibility_problems(
        channels, INTERVAL, {name: CHANNELS_BY_NAME[name].unit for name in channels}
    )
    speed = Signal(time=time, values=channels["speed"])
    for name, values in channels.items():
        signal = Signal(time=time, values=values)
        found += find_signal_problems(signal)
        frozen = find_frozen_problem(name, signal, speed)
        found += [] if frozen is None else [frozen]
    return found


@pytest.fixture(scope="module")
def runs() -> list[Columns]:
    from tests.conftest import DATA

    folder = Path(DATA) / "measured" / "campaigns"
    files = sorted(folder.glob("ex-*/runs/*.parquet"))
    if not files:
        pytest.skip(f"no campaigns at {folder}; set MUSYNC_DATA to the folder that holds measured/")
    tables = [pq.read_table(file) for file in files]
    return [{name: table.column(name).to_numpy() for name in table.column_names} for table in tables]


def test_sound_runs_raise_no_alarm(runs: list[Columns]) -> None:
    assert len(runs) == 78
    assert [problem for run in runs for problem in problems_of(run)] == []


def scale_channel(*names: str, factor: float) -> Callable[[Columns], Columns]:
    return lambda run: run | {name: run[name] * factor for name in names}


def hold_channel(name: str) -> Callable[[Columns], Columns]:
    def damage(run: Columns) -> Columns:
        values = run[name].copy()
        values[100:180] = values[100]
        return run | {name: values}

    return damage


def shift_channel(seconds: float) -> Callable[[Columns], Columns]:
    return lambda run: run | {"time": run["time"] + seconds * (np.arange(len(run["time"])) > 150)}


@pytest.mark.parametrize(
    ("fault", "damage", "share"),
    [
        ("pitch turned over", scale_channel("pitch", factor=-1), 1.0),
        ("pitch rate turned over", scale_channel("pitch_rate", factor=-1), 1.0),
        ("pitch and pitch rate turned over", scale_channel("pitch", "pitch_rate", factor=-1), 0.8),
        ("acceleration turned over", scale_channel("longitudinal_acceleration", factor=-1), 1.0),
        ("acceleration in g", scale_channel("longitudinal_acceleration", factor=1 / 9.81), 1.0),
        ("speed in km/h", scale_channel("speed", factor=3.6), 1.0),
        ("pitch in rad", scale_channel("pitch", factor=np.pi / 180), 1.0),
        ("frozen pitch", hold_channel("pitch"), 1.0),
        ("frozen speed", hold_channel("speed"), 1.0),
        ("clock jumps on", shift_channel(0.4), 1.0),
        ("clock jumps back", shift_channel(-0.2), 1.0),
    ],
)
def test_a_fault_in_a_braking_run_is_found(
    runs: list[Columns], fault: str, damage: Callable[[Columns], Columns], share: float
) -> None:
    braking = [run for run in runs if run["brake_pressure"].max() > 0.3]
    found = sum(bool(problems_of(damage(run))) for run in braking)
    assert found >= share * len(braking), f"{fault}: {found} of {len(braking)}"


def test_a_run_that_begins_within_a_split_step_shows_no_finer_sensor() -> None:
    """A dongle's whole km/h at 5 Hz: 51, then 50 while the car cruises, then a stop; the clock cuts the first step."""
    logged = (
        np.concatenate(([51.0], np.full(28, 50.0), [49.0, 48.0, 46.0, 43.0], np.arange(40.0, 8.0, -4.0)))
        / 3.6
    )
    time = 0.2 * np.arange(len(logged))
    for share in (0.3, 0.5, 0.64):
        clock = time[:-1] + 0.2 * share
        signal = Signal(time=clock, values=np.interp(clock, time, logged))
        assert find_frozen_problem("speed", signal, signal) is None


def test_rounding_is_no_step_of_a_coarse_sensor() -> None:
    """Speed in whole km/h, held while the car cruises, with what a resampling leaves of it."""
    driven = (
        np.concatenate((np.arange(100.0, 80.0, -1.0), np.full(40, 80.0), np.arange(79.0, 40.0, -1.0))) / 3.6
    )
    time = 0.1 * np.arange(len(driven))
    rounded = driven + 1e-13 * (np.arange(len(driven)) % 2)
    uneven = np.interp(time, time + 0.02 * np.sin(np.arange(len(time))), driven)  # put on an even clock
    for values in (driven, rounded, uneven):
        signal = Signal(time=time, values=values)
        assert find_frozen_problem("speed", signal, signal) is None
    lost = Signal(time=time, values=np.where(driven < 80.0 / 3.6, rounded - 5.0, rounded))
    problem = find_frozen_problem("speed", lost, lost)
    assert problem is not None and "holds 22.22 for" in problem
    assert problem.endswith("cut the run there, or leave the channel out")
