"""A gauge that reads more than 0 while nobody brakes is warned of, with its offset where all runs agree."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.campaign.telling import tell_session

INTERVAL = 0.01
Columns = dict[str, NDArray[np.float64]]


def make_stop(rest: float = 0.0, peak: float = 2.0, *, drag: float = 0.3, seed: int = 0) -> Columns:
    """Channels of a car that rolls for 2 s and brakes, with a gauge that rests at ``rest`` MPa."""
    brake = peak * np.clip((np.arange(500) - 200) / 30, 0.0, 1.0)
    noise = 0.004 * np.random.default_rng(seed).standard_normal(500)
    speed = 25.0 - np.cumsum(drag + 2.4 * brake) * INTERVAL
    return {"brake_pressure": np.maximum(brake + rest + noise, 0.0), "speed": np.maximum(speed, 0.0)}


def warn_of_gauge(*runs: Columns) -> str | None:
    named = {f"s{n}": run for n, run in enumerate(runs, start=1)}
    told = tell_session(named)
    return told.get("common_rest") or told.get("highest_rest")


def test_a_gauge_that_rests_at_one_level_in_all_runs_has_an_offset() -> None:
    runs = [make_stop(0.08 + 0.002 * k, peak, seed=k) for k, peak in enumerate((0.15, 2.0, 0.0))]
    warning = warn_of_gauge(*runs)
    assert warning is not None
    assert "rests at 0.082 MPa while the car does not brake, in 3 runs alike" in warning
    assert "offset: -0.082" in warning


def test_a_gauge_that_rests_at_another_level_in_each_run_is_warned_of() -> None:
    warning = warn_of_gauge(make_stop(0.01), make_stop(0.08), make_stop(0.05))
    assert warning is not None and "rests at 0.010 (s1) to 0.080 MPa (s2)" in warning
    alone = warn_of_gauge(make_stop(0.08))
    assert alone is not None and "offset" not in alone  # one run does not tell the gauge from the driver


@pytest.mark.parametrize(
    "run",
    [
        make_stop(0.0),
        make_stop(0.015),  # what is taken for no pressure anyway
        make_stop(0.6, drag=1.6),  # a brake that is held
        {name: values[200:] for name, values in make_stop(0.0).items()},  # a run that begins with its brake
        make_stop(0.08) | {"speed": np.zeros(500)},  # a foot on the pedal of a car that stands
    ],
)
def test_a_sound_gauge_raises_no_alarm(run: Columns) -> None:
    assert warn_of_gauge(run, run) is None


def test_a_pedal_that_is_pressed_slowly_does_not_rest() -> None:
    run = make_stop(0.0)
    run["brake_pressure"] = run["brake_pressure"] + np.clip(np.arange(500) / 1000, 0.0, 0.2)
    assert warn_of_gauge(run, run) is None
