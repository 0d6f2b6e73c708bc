"""The end of a stop in paper mode: steady it moves with its inputs, literal it hangs on a chattering sample."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from catalogs.scenario import Scenario
from flows.making.driving import controls_of, hazard_of, weather_of
from tasks.surface.road_profile import FLAT_ROAD, RoadHazard
from tasks.surface.state import SurfaceState
from tasks.surface.weather import surface_state
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.paper.low_speed import BrakedStop, SteadyStop, compute_brake_pitch_input
from tasks.vehicle.paper.wheel_step import find_implicit_speed, solve_wheel_speed
from tasks.vehicle.paper.wheels import build_wheels, compute_axle_step
from tasks.vehicle.parameters import Vehicle, compute_surface_response
from tasks.vehicle.rollout import Controls, Rollout, simulate_scenario
from tests.vehicle.conftest import command

STEADY = load("low-speed rule")
SURFACES = (("dry", 0.82), ("rain", 0.5), ("snow", 0.51), ("snow", 0.42), ("snow", 0.24))
BRAKED = [one.scenario for one in load("list of conditions") if one.scenario.peak_pressure_mpa]
"""The conditions of Appendix C that brake."""
ROLLING = ("speed", "braking_slip_f", "braking_slip_r", "longitudinal_acceleration")
"""Signals that the rule sets to zero at the stop: there each of them jumps."""
SMOOTH = ("station", "pitch", "heave", "axle_load_f", "axle_load_r")
LARGEST = 1e-3
"""Of a signal's range: what a millionth of friction or speed may move [1]."""


def stop_on(
    vehicle: Vehicle,
    family: str,
    friction: float,
    steady: SteadyStop | None = STEADY,
    *,
    speed: float = 40 / 3.6,
    hazard: RoadHazard = FLAT_ROAD,
    brake: BrakeCommand | None = None,
    step: float = 5e-4,
) -> Rollout:
    controls = Controls(initial_speed=speed, brake=brake or command(onset=0.2), hold_speed_until_brake=False)
    surface = SurfaceState(kind=family, friction=friction)
    return simulate_scenario(
        vehicle, surface, controls, hazard, mode="paper", duration_s=6.5, step_s=step, steady=steady
    )


def largest_move(a: Rollout, b: Rollout) -> float:
    """Largest change of any label or signal, as a share of its range; what a stop sets to zero while both cars roll."""
    rolls = (a.columns["speed"] > 0) & (b.columns["speed"] > 0)
    moved = [
        np.abs(b.columns[name] - a.columns[name])[rolls if name in ROLLING else slice(None)].max()
        / np.ptp(a.columns[name])
        for name in (*SMOOTH, *ROLLING)
    ]
    pitch = np.ptp(a.columns["pitch"])
    moved += [abs(getattr(b, name) / getattr(a, name) - 1) for name in ("stop_time", "stopping_distance")]
    moved += [abs(end(b.columns["pitch"]) - end(a.columns["pitch"])) / pitch for end in (np.max, np.min)]
    return float(max(moved))


def drive_condition(
    vehicle: Vehicle, scenario: Scenario, more: tuple[float, float], steady: SteadyStop | None
) -> Rollout:
    """Drive with so much more friction and initial speed [m/s]."""
    controls = controls_of(scenario)
    surface = surface_state(weather_of(scenario), load("surface", "dense-asphalt"))
    return simulate_scenario(
        vehicle, replace(surface, friction=surface.friction + more[0]),
        replace(controls, initial_speed=controls.initial_speed + more[1]), hazard_of(scenario), mode="paper",
        duration_s=10.0, steady=steady,
    )  # fmt: skip


def list_moves(vehicle: Vehicle, conditions: list[Scenario], steady: SteadyStop | None) -> list[float]:
    """Largest move of each condition under a millionth of friction and of speed, both ways."""
    found = []
    millionths = ((1e-6, 0), (-1e-6, 0), (0, 1e-6), (0, -1e-6))
    for held in (replace(one, hold_speed=True) for one in conditions):
        base = drive_condition(vehicle, held, (0, 0), steady)
        found.append(
            max(largest_move(base, drive_condition(vehicle, held, more, steady)) for more in millionths)
        )
    return found


def test_a_millionth_of_friction_or_speed_moves_no_label_of_a_steady_stop(vehicle):
    found = list_moves(vehicle, BRAKED, STEADY)
    assert len(found) == 27
    assert max(found) < LARGEST, found


def test_a_stop_on_the_other_side_of_a_tick_moves_its_speed_by_no_more_than_the_published_stop_speed(vehicle):
    """Appendix B sets a speed of 0.05 m/s to zero; on snow of 3 mm the stop then passes the tick at 8.468 s."""
    scenario = replace(next(one for one in BRAKED if one.precipitation_mm_h == 3), hold_speed=True)
    a, b = (drive_condition(vehicle, scenario, (mu, 0), STEADY) for mu in (0, -1e-6))
    moved = np.abs(a.columns["speed"] - b.columns["speed"])
    one_stands = (a.columns["speed"] > 0) != (b.columns["speed"] > 0)
    assert one_stands.sum() == 1
    assert 0.9 * vehicle.stop_speed < moved[one_stands] <= 1.01 * vehicle.stop_speed
    assert moved[~one_stands].max() < 1e-3


def test_it_moves_every_literal_stop(vehicle):
    found = list_moves(vehicle, BRAKED[::4], None)
    assert min(found) > 10 * LARGEST, found


@pytest.mark.parametrize(("family", "friction"), SURFACES)
def test_below_one_metre_a_second_the_slip_no_longer_chatters(vehicle, family, friction):
    jumps = {}
    for steady in (STEADY, None):
        columns = stop_on(vehicle, family, friction, steady).columns
        slow = (columns["speed"] > 0) & (columns["speed"] < 1)
        jumps[steady] = np.abs(np.diff(columns["braking_slip_f"][slow])).max()
    assert jumps[STEADY] < 2e-4 < 0.05 < jumps[None]


def test_above_the_implicit_speed_both_are_one_drive_bit_for_bit(vehicle):
    literal, steady = (stop_on(vehicle, "snow", 0.42, one).columns for one in (None, STEADY))
    tyre = compute_surface_response(vehicle, "snow", 0.42).tyre
    profile = command(onset=0.2).profile
    limit = find_implicit_speed(build_wheels(vehicle), tyre, profile, 5e-4, 2.0, vehicle.gravity)
    fast = steady["speed"] > limit + 0.01
    assert 3 < limit < 6 and fast.sum() > 1000
    for name in ("speed", "braking_slip_f", "wheel_speed_r", "pitch", "axle_load_f"):
        np.testing.assert_array_equal(literal[name][fast], steady[name][fast])


def test_a_steady_stop_is_the_literal_one_of_a_step_sixteen_times_as_short(vehicle):
    """Appendix B's equations are the same: the literal steps approach the steady stop as they shrink."""
    steady = stop_on(vehicle, "snow", 0.42)
    fine = stop_on(vehicle, "snow", 0.42, None, step=1 / 32000)
    coarse = stop_on(vehicle, "snow", 0.42, None)
    assert abs(steady.stop_time - fine.stop_time) < 0.1 * abs(coarse.stop_time - fine.stop_time)
    assert abs(steady.stop_time - fine.stop_time) < 2e-3


def test_the_implicit_step_solves_its_own_equation(vehicle):
    """I (omega' - omega) / h = R F(kappa') - q(kappa') T, in the band, before it and past it."""
    wheels, tyre = build_wheels(vehicle), compute_surface_response(vehicle, "snow", 0.42).tyre
    axle, load, pressure, step = wheels.front, 7500.0, 2.3, 5e-4
    for omega in (3.0, 2.9, 2.5, 1.0):
        before = compute_axle_step(0.95, omega, load, pressure, 1.0, step, axle, wheels, tyre)
        after = solve_wheel_speed(omega, 0.94, load, pressure, before, step, axle, wheels, tyre)
        end = compute_axle_step(0.94, after, load, pressure, before.scale, step, axle, wheels, tyre)
        assert after == pytest.approx(omega + step * end.rate, abs=1e-7)


def test_the_released_value_is_the_mean_over_the_hold_time():
    """Two samples of 3 m/s2 among 200 of 5: their mean is 4.98, while the last sample alone is 3."""
    acceleration = np.zeros(4000)
    acceleration[1000:3000] = -5.0
    acceleration[2998:3000] = -3.0
    rule = {"hold_s": 0.2, "release_s": 0.1, "hold_ratio": 0.8}
    literal = compute_brake_pitch_input(acceleration, 0.001, BrakedStop(onset=1.0, sample=3000), **rule)
    steady = compute_brake_pitch_input(
        acceleration, 0.001, BrakedStop(onset=1.0, sample=3000, time=2.9996), **rule, held_share=1.0
    )
    assert literal[3000] == 3.0
    assert steady[3000] == pytest.approx((198 * 5 + 2 * 3) / 200 * (1 - 0.0004 / 0.1))
    np.testing.assert_array_equal(literal[:3000], steady[:3000])


def test_a_brake_shorter_than_the_hold_time_is_averaged_from_its_onset():
    rule = {"hold_s": 0.2, "release_s": 0.1, "hold_ratio": 0.8}
    acceleration = np.full(1000, -0.004)
    acceleration[450:500] = -4.0
    d = compute_brake_pitch_input(
        acceleration, 0.001, BrakedStop(onset=0.45, sample=500), **rule, held_share=1.0
    )
    assert d[500] == pytest.approx(1.05 * 0.004), "of the samples since the onset, all capped"


def test_a_stop_on_the_pads_of_another_tyre_and_a_slow_abs_ends_too(vehicle):
    slow = replace(vehicle, abs_build_rate=4.0, abs_release_rate=8.0)
    ride = stop_on(slow, "snow", 0.42)
    change = np.diff(ride.columns["abs_scale_f"][ride.columns["speed"] > 0])
    assert change.max() <= 4.0e-3 + 1e-9 and change.min() >= -8.0e-3 - 1e-9
    assert np.isfinite(ride.stop_time)
