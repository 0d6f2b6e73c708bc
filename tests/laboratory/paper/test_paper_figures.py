"""Figures of the paper's studies show what the studies found, and what was printed."""

import numpy as np

from catalogs.entries import load
from flows.measured.agreement import draw_trajectories
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceState
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.rollout import Controls, simulate_scenario


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
