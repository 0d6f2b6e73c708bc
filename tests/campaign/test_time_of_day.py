"""A clock of the digits of hours, minutes and seconds: read where the map says so, and told where it does not."""

from pathlib import Path

import numpy as np
import pytest

from tasks.campaign.channel_validation import find_clock_problems
from tasks.campaign.signals import Signal
from tasks.campaign.time_of_day import has_digits_of_day, looks_like_time_of_day, read_time_of_day
from tests.campaign.recorded import braking_columns, log_signal
from tests.flows.measured.recordings import import_columns, problems_of, write_csv


def write_digits(seconds: np.ndarray) -> np.ndarray:
    """The time since midnight as HHMMSS.ss."""
    seconds = np.round(seconds, 2) % 86400.0
    return np.round(seconds // 3600 * 1e4 + seconds // 60 % 60 * 1e2 + seconds % 60, 2)


def test_digits_are_read_as_seconds_since_midnight() -> None:
    stamps = np.array([73000.05, np.nan, 73059.95, 73100.0, 80000.0])
    np.testing.assert_allclose(read_time_of_day(stamps), [27000.05, np.nan, 27059.95, 27060.0, 28800.0])


def test_a_drive_goes_on_after_midnight() -> None:
    seconds = 86395.0 + 0.05 * np.arange(200)
    np.testing.assert_allclose(read_time_of_day(write_digits(seconds)), seconds)


@pytest.mark.parametrize("start", [37435.0, 39595.0])  # over a minute, over an hour
def test_digits_that_are_taken_for_seconds_are_told(start: float) -> None:
    stamps = write_digits(start + 0.05 * np.arange(400))
    (problem,) = find_clock_problems(Signal(time=stamps, values=0.0 * stamps))
    assert "digits of hours, minutes and seconds: give unit: HHMMSS under time" in problem


def test_a_gap_in_a_clock_of_seconds_is_no_time_of_day() -> None:
    time = 0.05 * np.arange(4000)
    assert not looks_like_time_of_day(time)
    assert not looks_like_time_of_day(time[(time < 50.0) | (time > 110.0)])
    assert not looks_like_time_of_day(time[:1000]) and has_digits_of_day(time[:1000])


def test_a_log_of_a_time_of_day_is_imported_by_its_unit_and_told_without_it(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    log["time"] = write_digits(37438.0 + log.pop("t_ms") / 1e3)
    source = write_csv(tmp_path / "log.csv", log)
    text = problems_of(tmp_path, log, time={"source": "time"})
    assert "give unit: HHMMSS under time in the map" in text
    assert "cut the run there" not in text and "frozen" not in text
    found = import_columns(tmp_path, source, time={"source": "time", "unit": "HHMMSS"})
    assert len(found["speed"]) > 390
    np.testing.assert_allclose(found["speed"], braking_columns()["speed"][: len(found["speed"])], atol=1e-6)


def test_what_is_no_time_of_day_is_refused_as_one(tmp_path: Path) -> None:
    text = problems_of(tmp_path, log_signal(braking_columns()), time={"source": "t_ms", "unit": "HHMMSS"})
    assert (
        "log.csv: clock t_ms must be in HHMMSS, with minutes and seconds below 60; it reads 0 to 4000" in text
    )
