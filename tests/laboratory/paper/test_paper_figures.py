"""Figures of the paper's studies show what the studies found, and what was printed."""

import numpy as np
import pytest

from catalogs.entries import load
from flows.measured.agreement import draw_trajectories
from studies.measured_drives.dive_figure import draw_dives
from studies.paper.sensitivity import draw_sensitivity
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceState
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.rollout import Controls, simulate_scenario


def test_bands_lie_about_the_nominal_curve_and_printed_figures_at_their_rates():
    rates = {"nominal_rates_mm_h": [0, 1, 3], "rates_mm_h": [0, 3]}
    friction = {"nominal_mu": [0.8, 0.5, 0.3], "mu_p05": [0.7, 0.2], "mu_p95": [0.9, 0.4]}
    stops = {"nominal_stop_m": [30, 37, 63], "stop_m_p05": [29, 58], "stop_m_p95": [31, 69]}
    printed = [
        {"figure": "snow1_stop_m.p95", "printed": 42.53}, {"figure": "snow3_stop_m.p05", "printed": 58.39},
        {"figure": "spearman.snow1.snow_density", "printed": -0.535}, {"figure": "rain50_mu.nominal", "printed": 0.347},
    ]  # fmt: skip
    figure = draw_sensitivity({"snow": rates | friction | stops}, printed)
    above, below = figure.panels
    assert [list(line.y) for line in above.lines[1:]] == [[0.8, 0.5, 0.3]]
    *_, marks = below.lines
    assert (marks.x, marks.y) == ([1.0, 3.0], [42.53, 58.39])
    assert below.lines[0].high == [31, 69]


def fold(drive: str, dive: list[float], predicted: list[float]) -> dict:
    trajectory = {
        "time_s": [0.01 * k for k in range(len(dive))],
        "dive_deg": dive,
        "predicted_dive_deg": predicted,
    }
    return {
        "drive": drive,
        "events": 3,
        "peak_ratio": None if drive == "$2" else 1.1,
        "mean_trajectory": trajectory,
    }


def test_each_dive_is_drawn_over_its_own_peak_and_the_mean_where_all_drives_have_values():
    figure = draw_dives(
        [fold("one", [0.0, -0.5, -2.0], [0.0, -1.0, -1.0]), fold("$2", [0.0, 1.0], [0.0, 0.5])]
    )
    first, second, mean = figure.panels
    assert [list(line.y) for line in first.lines] == [[0.0, -0.25, -1.0], [0.0, -1.0, -1.0]]
    assert "peak ratio 1.10" in first.title and second.title.startswith("$2: 3")
    (line, _) = mean.lines
    np.testing.assert_allclose(line.y, [0.0, 0.25])
    assert (min(line.low), max(line.high)) == pytest.approx((-0.5, 1.0))


def test_a_model_that_is_its_own_reference_leaves_nothing_over():
    brake = BrakeCommand(
        peak_pressure_mpa=2.3, onset_s=0.1, ramp_s=0.5, onset_station_m=None, hold_s=None, release_s=0.5
    )
    ride = simulate_scenario(
        load("vehicle", "paper-reference"), SurfaceState(kind="dry", friction=0.82),
        Controls(initial_speed=10.0, brake=brake, hold_speed_until_brake=True), FLAT_ROAD, mode="paper", duration_s=1.0,
    )  # fmt: skip
    told = ride.columns
    wheels = {"fl": "f", "fr": "f", "rl": "r", "rr": "r"}
    trace = {
        "time": told["t_ns"] * 1e-9,
        "speed": told["speed"],
        "pitch": np.degrees(told["pitch"] + ride.static_pitch),
    }
    trace |= {f"slip_{wheel}": told[f"braking_slip_{axle}"] for wheel, axle in wheels.items()}
    trace |= {f"wheel_load_{wheel}": told[f"axle_load_{axle}"] / 2 for wheel, axle in wheels.items()}
    figure = draw_trajectories("own $case", trace, {"itself": ride}, (0.1, 0.9))
    left_over = [panel.lines[0] for panel in figure.panels if panel.y == "difference"]
    assert len(left_over) == 4 and max(np.max(np.abs(line.y)) for line in left_over) < 1e-9
    (pitch,) = (panel.lines[0].y for panel in figure.panels if panel.y == "pitch, nose down [deg]")
    assert pitch[-1] - pitch[0] > 1.0
