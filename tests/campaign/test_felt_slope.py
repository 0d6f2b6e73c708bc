"""Slopes of the road that an accelerometer reads and no map names."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.campaign import speed_by_acceleration as felt_slope
from tests.campaign.telling import CONDITIONS, make_runs, tell_session

INTERVAL = 0.02
TIME = np.arange(400) * INTERVAL
SLOPES = {"run-01": -0.042, "run-02": 0.0, "run-03": 0.022, "run-04": -0.02}
"""Of the road, uphill positive [1]."""
Columns = dict[str, NDArray[np.float64]]
NUMBERS = CONDITIONS["felt_slope"]
DRIFT = NUMBERS["drift"]


def estimate_slopes(runs: dict[str, Columns]) -> dict[str, float]:
    return felt_slope.estimate_slopes(make_runs(runs, INTERVAL), **NUMBERS)


def measure_apart(runs: dict[str, Columns]) -> dict[str, tuple[float, float]]:
    return felt_slope.measure_apart(make_runs(runs, INTERVAL), NUMBERS["shortest"])


def describe_slopes(runs: dict[str, Columns]) -> list[str]:
    return list(tell_session(runs, INTERVAL).values())


def drive_on_slopes(
    slope: float, *, brake: float = 5.0, dive: float = 0.03, late: float = 0.0, seed: int = 1
) -> Columns:
    """A stop whose accelerometer reads gravity along the road and along the body's dive."""
    noise = np.random.default_rng(seed)
    rate = -0.2 - brake * np.clip((TIME - 3.0) / 0.3, 0.0, 1.0)
    felt = rate * (1.0 + dive) + 9.80665 * slope + 0.02 * noise.standard_normal(len(TIME))
    speed = 40.0 + np.cumsum(rate) * INTERVAL + 0.005 * noise.standard_normal(len(TIME))
    return {"speed": np.interp(TIME - late, TIME, speed), "longitudinal_acceleration": felt}


def test_slopes_from_run_to_run_are_told_with_their_size() -> None:
    runs = {name: drive_on_slopes(slope, seed=n) for n, (name, slope) in enumerate(SLOPES.items())}
    (told,) = describe_slopes(runs)
    assert "by -0.41 (run-01) to 0.22 m/s^2 (run-03)" in told
    assert "slopes of -4.2 to 2.2 %" in told and "map road_slope" in told


def test_what_braking_gives_does_not_count() -> None:
    """Runs that brake differently hard read another mean of the dive, and one that is late another of the rise."""
    runs = {
        f"run-{n:02d}": drive_on_slopes(0.01, brake=brake, dive=0.1, late=0.1, seed=n)
        for n, brake in enumerate((0.0, 1.0, 3.0, 5.0, 7.0))
    }
    assert [zero for zero, _ in measure_apart(runs).values()] == pytest.approx([0.098] * 5, abs=0.02)
    assert describe_slopes(runs) == []


@pytest.mark.parametrize(
    "runs",
    [
        {name: drive_on_slopes(0.05) for name in SLOPES},  # one slope, or one offset
        {name: drive_on_slopes(slope) for name, slope in list(SLOPES.items())[:2]},
        {name: drive_on_slopes(0.1 * slope) for name, slope in SLOPES.items()},
        {
            name: drive_on_slopes(slope) | {"road_slope": 57.3 * slope + 0.0 * TIME}
            for name, slope in SLOPES.items()
        },
        {name: {"speed": drive_on_slopes(slope)["speed"]} for name, slope in SLOPES.items()},
        {name: {c: x[:30] for c, x in drive_on_slopes(slope).items()} for name, slope in SLOPES.items()},
    ],
)
def test_one_offset_small_slopes_and_mapped_ones_raise_no_alarm_and_are_no_slope(
    runs: dict[str, Columns],
) -> None:
    assert describe_slopes(runs) == [] and estimate_slopes(runs) == {}


@pytest.mark.parametrize("zero", [0.0, 0.5])
def test_the_slope_of_each_run_is_read_off_the_accelerometer_whatever_its_zero(zero: float) -> None:
    runs = {name: drive_on_slopes(slope, seed=n) for n, (name, slope) in enumerate(SLOPES.items())}
    for columns in runs.values():
        columns["longitudinal_acceleration"] = columns["longitudinal_acceleration"] + zero
    found = estimate_slopes(runs)
    middle = float(np.median(list(SLOPES.values())))
    assert found == pytest.approx({name: slope - middle for name, slope in SLOPES.items()}, abs=0.001)


def test_of_a_scatter_that_is_half_drift_half_of_it_is_slope() -> None:
    scatter = np.array([-1.0, 1.0, -1.0, 1.0]) * np.sqrt(2.0) * DRIFT / 9.80665
    runs = {name: drive_on_slopes(slope) for name, slope in zip(SLOPES, scatter, strict=True)}
    found = list(estimate_slopes(runs).values())
    assert found == pytest.approx((0.5 * (scatter - np.median(scatter))).tolist(), abs=2e-5)
    assert min(estimate_slopes({n: drive_on_slopes(30.0 * s) for n, s in SLOPES.items()}).values()) >= -0.202


def test_runs_of_one_deceleration_each_tell_no_slope() -> None:
    """Scale and zero of the accelerometer stand in for each other there, and the rest is noise of both."""
    runs = {}
    for n, brake in enumerate((2.0, 4.0, 6.0, 8.0)):
        columns = drive_on_slopes(0.0, brake=brake, seed=n)
        runs[f"run-{n}"] = {name: values[TIME > 3.6] for name, values in columns.items()}
    assert measure_apart(runs) == {} == estimate_slopes(runs)


def make_short_stops(
    count: int, noise: float, kept: float, window: tuple[float, float], seed: int = 0
) -> dict[str, Columns]:
    """Stops on a flat road whose speed has noise that keeps a part from sample to sample."""
    begin, end = window
    inside, runs = (begin < TIME) & (end > TIME), {}
    for n in range(count):
        columns = drive_on_slopes(0.0, seed=seed + n)
        loud = (
            np.random.default_rng(seed + n + 90).standard_normal(len(TIME)) * noise * np.sqrt(1.0 - kept**2)
        )
        for i in range(1, len(loud)):
            loud[i] += kept * loud[i - 1]
        columns["speed"] = columns["speed"] + loud
        runs[f"run-{n}"] = {name: values[inside] for name, values in columns.items()}
    return runs


@pytest.mark.parametrize(("noise", "kept"), [(0.03, 0.0), (0.1, 0.0), (0.03, 0.9)])
def test_runs_scatter_by_their_errors_and_that_is_no_slope(noise: float, kept: float) -> None:
    runs = make_short_stops(40, noise, kept, (2.2, 4.2))
    zeros, errors = np.array(list(measure_apart(runs).values())).T
    assert 0.7 < np.std(zeros) / np.sqrt(np.mean(errors**2)) < 1.4
    slopes = np.array(list(estimate_slopes(runs).values()) or [0.0])
    assert np.std(slopes) < 0.002


def test_an_error_holds_what_scale_and_delay_leave_open() -> None:
    """Stops of little more than one deceleration: their zeros are off together, by the accelerometer's scale."""
    off = []
    for seed in range(0, 4000, 100):
        found = measure_apart(make_short_stops(3, 0.005, 0.0, (3.1, 4.5), seed))
        off += [(zero, error) for zero, error in found.values()]
    zeros, errors = np.array(off).T
    assert 0.6 < np.sqrt(np.mean(zeros**2) / np.mean(errors**2)) < 1.6


def test_a_speed_that_reads_nothing_at_walking_pace_counts_to_there() -> None:
    runs = {name: drive_on_slopes(slope, seed=n) for n, (name, slope) in enumerate(SLOPES.items())}
    whole = estimate_slopes({name: {c: x[:300] for c, x in run.items()} for name, run in runs.items()})
    for columns in runs.values():
        columns["speed"][300:] = 0.0
    assert estimate_slopes(runs) == whole
