"""What brake and throttle read at rest is their zero in a campaign that is read."""

from pathlib import Path

import numpy as np
import pytest

from catalogs.campaigns import read_campaign
from tests.catalogs.campaign_folder import NAMES, braking_columns, change_header, write_campaign, write_run


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_campaign(tmp_path)


def test_what_a_gauge_reads_at_rest_in_all_runs_alike_is_its_zero(folder: Path) -> None:
    before = read_campaign(folder)
    assert before.brake_rest == 0.0 and not before.resting_gauge
    for number, name in enumerate(NAMES):
        columns = braking_columns(number)
        write_run(folder, name, columns | {"brake_pressure": columns["brake_pressure"] + 0.08})
    after = read_campaign(folder)
    assert after.brake_rest == pytest.approx(0.08, abs=0.005) and not after.resting_gauge
    for one, other in zip(before.runs, after.runs, strict=True):
        assert other.pressure[200:] == pytest.approx(one.pressure[200:], abs=0.01)
    change_header(folder, lambda h: h.update(brake_stands_for="a signal in N m"))
    assert read_campaign(folder).brake_rest == 0.0


def test_a_gauge_that_drifts_from_run_to_run_has_no_zero_and_the_sentence_of_its_check(folder: Path) -> None:
    for number, name in enumerate(NAMES):
        columns = braking_columns(number)
        write_run(folder, name, columns | {"brake_pressure": columns["brake_pressure"] + 0.02 * number})
    drifting = read_campaign(folder)
    assert drifting.brake_rest == 0.0
    assert "MPa (run-06) while the car does not brake" in drifting.resting_gauge


def test_a_command_that_idles_above_0_is_counted_from_there(folder: Path) -> None:
    """A drive-by-wire car commands 0.15 while it does not brake: it braked from the first sample, stops 11 m off."""
    before = read_campaign(folder)
    for number, name in enumerate(NAMES):
        columns = braking_columns(number)
        command = 0.15 + 0.1 * columns.pop("brake_pressure")
        write_run(folder, name, columns | {"brake_command": command})
    change_header(folder, lambda h: h.update(brake_signal="brake_command", not_measured=["brake_pressure"]))
    after = read_campaign(folder)
    assert after.brake_rest == pytest.approx(1.5, abs=0.005)
    for one, other in zip(before.runs, after.runs, strict=True):
        assert other.pressure == pytest.approx(one.pressure, abs=0.03)  # the gauge's noise


def test_a_throttle_that_rests_above_0_is_counted_from_what_it_reads_while_the_brake_is_applied(
    folder: Path,
) -> None:
    """A plate that idles at 0.15 drove the car through its stops: an engine was said to hold it back with 565 N m."""
    assert read_campaign(folder).throttle_rest == 0.0
    for number, name in enumerate(NAMES):
        columns = braking_columns(number)
        driven = np.where(columns["time"] < 0.8, 0.3, 0.0)
        write_run(folder, name, columns | {"throttle": 0.15 + 0.85 * driven + (0.1 if number == 1 else 0.0)})
    campaign = read_campaign(folder)
    assert campaign.throttle_rest == pytest.approx(0.15)
    for run in campaign.runs:
        if run.name != NAMES[1]:  # one driver's foot on both pedals is no rest
            assert run.throttle is not None and run.throttle[-1] == 0.0
            assert run.throttle[0] == pytest.approx(0.255)
    for number, name in enumerate(NAMES):  # a foot that holds both pedals
        write_run(folder, name, braking_columns(number) | {"throttle": np.full(len(driven), 0.31)})
    assert read_campaign(folder).throttle_rest == 0.0
