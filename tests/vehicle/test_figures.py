"""Figures of a vehicle: the paper's car by hand, and frequencies and damping beside the modes of the whole half-car."""

from dataclasses import replace
from math import isnan, pi

import numpy as np
import pytest

from catalogs.entries import entry_names, load
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceState
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.figures import FIGURES, compute_figures
from tasks.vehicle.rollout import Controls, simulate_scenario


def half_car_modes(v):
    """Frequencies without damping [Hz] and damping ratios [1] of the half-car's four modes, slowest first."""
    k_f, k_r, t_f, t_r = (
        v.suspension_stiffness_f, v.suspension_stiffness_r, v.tyre_stiffness_f, v.tyre_stiffness_r
    )  # fmt: skip
    a, b = v.cg_to_front_axle, v.cg_to_rear_axle
    front, rear = np.array([1.0, a, -1.0, 0.0]), np.array([1.0, -b, 0.0, -1.0])

    def above(front_value, rear_value):
        return front_value * np.outer(front, front) + rear_value * np.outer(rear, rear)

    stiffness = above(k_f, k_r) + np.diag([0.0, 0.0, t_f, t_r])
    damping = above(v.suspension_damping_f, v.suspension_damping_r)
    inverse = np.diag(1 / np.array([v.sprung_mass, v.pitch_inertia, v.unsprung_mass_f, v.unsprung_mass_r]))
    free = np.sqrt(np.sort(np.linalg.eigvals(inverse @ stiffness).real)) / (2 * pi)
    zero, one = np.zeros((4, 4)), np.eye(4)
    poles = np.linalg.eigvals(np.block([[zero, one], [-inverse @ stiffness, -inverse @ damping]]))
    swinging = sorted((p for p in poles if p.imag > 0), key=abs)
    assert len(swinging) == 4
    return free, [-p.real / abs(p) for p in swinging]


@pytest.mark.parametrize("name", entry_names("vehicle"))
def test_frequencies_and_damping_are_close_to_those_of_the_whole_half_car(name):
    vehicle = load("vehicle", name)
    found, (frequencies, ratios) = compute_figures(vehicle), half_car_modes(vehicle)
    body = sorted(
        (found[f"{motion}_frequency"], found[f"{motion}_damping_ratio"]) for motion in ("heave", "pitch")
    )
    wheels = sorted(found[f"wheel_hop_frequency_{axle}"] for axle in "fr")
    assert [frequency for frequency, _ in body] + wheels == pytest.approx(frequencies, rel=0.05)
    assert [ratio for _, ratio in body] == pytest.approx(ratios[:2], rel=0.15)


def test_the_papers_car_has_these_figures():
    assert compute_figures(load("vehicle", "paper-reference")) == pytest.approx(
        {
            "mass": 1308, "unsprung_share": 108 / 1308, "wheelbase": 2.7, "static_front_load": 7069.74,
            "static_rear_load": 5761.74, "static_front_share": 0.5509684, "cg_height_over_wheelbase": 0.55 / 2.7,
            "dynamic_index": 5 / 6, "heave_frequency": 1.0000708, "heave_damping_ratio": 0.4002318,
            "pitch_frequency": 1.1091322, "pitch_damping_ratio": 0.4438786, "wheel_hop_frequency_f": 10.1648171,
            "wheel_hop_frequency_r": 10.1648171, "wheel_radius": 0.32, "wheel_inertia_f": 2.4, "wheel_inertia_r": 2.4,
            "deceleration_per_pressure": 1000 / 0.32 / 1308, "front_brake_share": 0.65,
            "peak_deceleration": 0.82 * 1.01 * 9.81, "coast_deceleration": 0.004,
            "road_load": 0.004 * 1308 / (1308 + 4.8 / 0.32**2), "dive_gradient": 4.6826539, "gravity": 9.81,
        },
        rel=1e-6,
    )  # fmt: skip


def test_dive_and_road_load_are_those_of_a_drive():
    """A stop at a steady 4 m/s2, and the first second of coasting from 60 km/h."""
    car = load("vehicle", "bmw-320i")
    figures, dry = compute_figures(car), SurfaceState(kind="dry", friction=0.82)

    def drive(pressure, speed, **brake):
        command = BrakeCommand(
            peak_pressure_mpa=pressure, ramp_s=0.2, onset_s=0.0, onset_station_m=None, hold_s=None, release_s=1.0
        )  # fmt: skip
        controls = Controls(initial_speed=speed, brake=command, hold_speed_until_brake=False)
        return simulate_scenario(car, dry, controls, FLAT_ROAD, mode="coupled", duration_s=3.0).columns

    braked = drive(1.5, 30.0)
    gradient = np.degrees(braked["pitch"][-1]) / (-braked["longitudinal_acceleration"][-1] / 9.81)
    assert gradient == pytest.approx(figures["dive_gradient"], rel=0.03)
    assert gradient == pytest.approx(2.8, abs=0.1)
    coasted = drive(0.0, 60 / 3.6)
    assert -coasted["longitudinal_acceleration"][500] == pytest.approx(figures["road_load"], rel=0.03)


def test_a_figure_beyond_what_floats_hold_is_nan():
    tiny = replace(load("vehicle", "paper-reference"), sprung_mass=1e-300, cg_to_front_axle=1e-300)
    huge = replace(tiny, cg_to_front_axle=1e300)
    assert isnan(compute_figures(tiny)["dynamic_index"]) and isnan(compute_figures(huge)["pitch_frequency"])
    assert compute_figures(tiny).keys() == FIGURES.keys()
