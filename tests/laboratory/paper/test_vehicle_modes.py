"""The table of docs/explanation/vehicle-modes.md is what the code gives, and the modes are as close as it says."""

from math import isnan
from pathlib import Path

import numpy as np
import pytest

from catalogs.entries import load
from studies.paper.vehicle_modes import HEADER, compute_differences, format_table

DOCUMENT = Path(__file__).resolve().parents[3] / "docs" / "explanation" / "vehicle-modes.md"


@pytest.fixture(scope="module")
def rows():
    return compute_differences()


def numbers(line):
    cells = [cell.strip() for cell in line.strip("|\n ").split("|")]
    return cells[0], [float("nan") if cell == "-" else float(cell) for cell in cells[1:]]


def test_the_documented_table_is_the_computed_one(rows):
    """To two units of the last printed digit of a length: the Euler step of paper mode scatters by millimetres."""
    lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
    start = lines.index(format_table({})[0]) + 2
    documented = dict(numbers(line) for line in lines[start : lines.index("", start)])
    computed = dict(numbers(line) for line in format_table(rows)[2:])
    tolerance = (0.02, 0.02, 0.005, 0.06, 0.05, 0.02, 0.001, 20.0)
    for name, printed_row in documented.items():
        for found, printed, atol, title in zip(
            computed[name], printed_row, tolerance, HEADER[1:], strict=True
        ):
            np.testing.assert_allclose(found, printed, atol=atol, err_msg=f"{name}, {title}")


def test_the_documented_table_holds_the_largest_differences(rows):
    largest = {
        name: max(getattr(row, name) for row in rows.values())
        for name in ("speed_rmse", "pitch_rmse_deg", "slip_rmse")
    }
    printed = DOCUMENT.read_text(encoding="utf-8")
    shown = [row for name, row in rows.items() if f"| {name} | " in printed]
    for name, value in largest.items():
        assert max(getattr(row, name) for row in shown) == pytest.approx(value, rel=0.05), name


def test_the_documented_dive_of_slow_stops_is_the_computed_one(drive):
    lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("| from [km/h]"))
    speeds, times, paper, coupled = (numbers(lines[start + i])[1] for i in (0, 2, 3, 4))
    for speed, time, *peaks in zip(speeds, times, paper, coupled, strict=True):
        rides = [
            drive(speed_km_h=speed, mode=mode, duration=4.0, steady=load("low-speed rule"))
            for mode in ("paper", "coupled")
        ]
        assert rides[0].stop_time - 1 == pytest.approx(time, abs=0.006)
        found = [float(np.degrees(ride.columns["pitch"].max())) for ride in rides]
        np.testing.assert_allclose(found, peaks, atol=0.006, err_msg=f"{speed:g} km/h")


def test_the_modes_agree_on_every_condition_of_the_paper(rows):
    for name, row in rows.items():
        if not isnan(row.stop_paper):
            assert abs(row.stop_paper - row.stop_coupled) < 0.08, name
        assert row.speed_rmse < 0.05 and row.pitch_rmse_deg < 0.25 and row.slip_rmse < 0.01, name
        assert abs(row.peak_pitch_paper_deg - row.peak_pitch_coupled_deg) < 0.1, name


def test_the_modes_pitch_alike_until_the_stop_without_a_calibrated_moment(drive):
    for surface in (("dry", 0.82), ("rain", 0.347126), ("snow", 0.42)):
        paper, coupled = (drive(*surface, mode=mode, hold=True) for mode in ("paper", "coupled"))
        braking = slice(1000, int(1000 * paper.stop_time) - 300)
        apart = np.degrees(paper.columns["pitch"] - coupled.columns["pitch"])[braking]
        assert np.sqrt(np.mean(apart**2)) < 0.04
