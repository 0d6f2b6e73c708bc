"""Paper mode: golden distances, its twin, and properties of stops and road features."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from catalogs.entries import load
from studies.peers import reference
from tasks.surface.road_profile import FLAT_ROAD, RoadHazard
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.paper import paper_mode
from tasks.vehicle.paper.low_speed import BrakedStop
from tasks.vehicle.paper.paper_mode import (
    LITERAL_PASSES,
    MOST_PASSES,
    StepGrid,
    run_paper_mode,
    simulate_body,
)
from tasks.vehicle.paper.wheels import build_wheels, simulate_stop
from tasks.vehicle.parameters import compute_surface_response
from tests.vehicle.conftest import HUMP, command

ONSET_NOW = command(onset=0.0)


def stop_of(vehicle, family, friction, *, speed_km_h=60.0, step=5e-4):
    free = replace(vehicle, coast_deceleration=0.0)
    tyre = compute_surface_response(free, family, friction).tyre
    return simulate_stop(speed_km_h / 3.6, step, 200_000, ONSET_NOW.profile, build_wheels(free), tyre)[0]


def friction_of(kind, rate):
    surface = load("surface", "dense-asphalt")
    weather = Weather(kind=kind, precipitation_mm_h=rate, snow_accumulation_h=1.0)
    return surface_state(weather, surface).friction


@pytest.mark.parametrize(
    ("family", "friction", "distance"),
    [
        ("dry", 0.82, 30.326),
        ("rain", 0.595585, 30.330),
        ("rain", 0.502657, 32.966),
        ("rain", 0.434150, 37.922),
        ("rain", 0.400622, 40.806),
        ("rain", 0.369279, 44.022),
        ("rain", 0.355843, 45.604),
        ("rain", 0.347126, 46.6995),
        ("snow", 0.51, 32.144),
        ("snow", 0.465, 34.434),
        ("snow", 0.42, 37.261),
        ("snow", 0.33, 46.576),
        ("snow", 0.24, 63.497),
    ],
)
def test_stops_are_the_nominal_ones_of_the_published_protocol(vehicle, family, friction, distance):
    """Made once by an independent implementation of Appendix B; below 4 m/s the Euler step scatters by mm."""
    scatter = 0.014 if friction == 0.51 else 0.006
    assert stop_of(vehicle, family, friction) == pytest.approx(distance, abs=scatter)


@pytest.mark.parametrize(("step", "change"), [(1e-3, 0.025), (1e-4, -0.010)])
def test_the_euler_step_moves_a_stop_on_rain_50_by_what_is_known(vehicle, step, change):
    """+25 mm at 1 ms and -10 mm at 0.1 ms, known for the sum of v_n dt, which is v_0 dt / 2 longer."""
    moved = stop_of(vehicle, "rain", 0.347126, step=step) - stop_of(vehicle, "rain", 0.347126)
    assert moved + 60 / 3.6 * (step - 5e-4) / 2 == pytest.approx(change, abs=0.001)


def test_stopping_distance_grows_as_friction_falls(vehicle):
    stops = [stop_of(vehicle, "rain", mu) for mu in np.linspace(0.55, 0.35, 9)]
    assert all(longer > shorter for shorter, longer in pairwise(stops))


@pytest.mark.parametrize("kind", ["rain", "snow"])
def test_stopping_distance_grows_with_the_rate(vehicle, kind):
    rates = (5, 10, 20, 30, 40, 50) if kind == "rain" else (0.5, 0.8, 1.1, 1.4, 1.7, 2.0)
    stops = [stop_of(vehicle, kind, friction_of(kind, rate)) for rate in rates]
    assert all(longer > shorter for shorter, longer in pairwise(stops))


def test_stopping_distance_grows_with_speed(vehicle):
    stops = [stop_of(vehicle, "dry", 0.82, speed_km_h=speed) for speed in (20, 40, 60, 80, 100)]
    assert all(longer > shorter for shorter, longer in pairwise(stops))


def test_the_lean_stop_is_the_logged_stop(vehicle, drive):
    still = replace(vehicle, coast_deceleration=0.0)
    ride = drive("rain", 0.4, brake=ONSET_NOW, car=still)
    assert ride.stopping_distance == pytest.approx(stop_of(vehicle, "rain", 0.4), abs=2e-3)


def test_weak_braking_stops_where_constant_force_says(vehicle, drive):
    """Below the ABS, dv/dt = -(T/R) / (m + I/R^2 (1 - kappa)) - a_coast, distance v0^2 / (2 |dv/dt|)."""
    ride = drive(brake=command(0.8, onset=0.0, ramp_s=0.0), duration=15.0)
    force, inertia = 800 / 0.32, 4.8 / 0.32**2
    deceleration = force / (1308 + inertia) + 0.004
    assert ride.stopping_distance == pytest.approx((60 / 3.6) ** 2 / (2 * deceleration), rel=2e-3)


def test_fast_motion_agrees_with_the_twin(vehicle):
    """Down to 5 m/s: below, the last bit of a sum decides which way the wheel chatters."""
    response, steps = compute_surface_response(vehicle, "rain", 0.4), 6000
    run = run_paper_mode(
        vehicle, response, 60 / 3.6, False, ONSET_NOW.profile, FLAT_ROAD, StepGrid(steps=steps, step=5e-4)
    )
    weight = vehicle.mass * vehicle.gravity / vehicle.wheelbase
    transfer = vehicle.mass * vehicle.cg_height / vehicle.wheelbase

    def loads(n, acceleration):
        return np.array([weight * 1.5 - transfer * acceleration, weight * 1.2 + transfer * acceleration])

    twin = reference.simulate_paper_drive(
        vehicle, "rain", response,
        reference.ReferenceDrive(
            initial_speed=60 / 3.6, pressure=lambda t: 2.3 * min(t / 0.5, 1.0), loads=loads, hazard=FLAT_ROAD
        ),
        steps=steps, step=5e-4,
    )  # fmt: skip
    fast = twin["speed"][:, 0] > 5
    assert fast.sum() > 3000
    for columns, name in (
        ([1], "speed"),
        ([0], "station"),
        ([5, 6], "omega"),
        ([7, 8], "force"),
        ([9, 10], "load"),
    ):
        kernel = run.log[: len(fast)][fast][:, columns]
        np.testing.assert_allclose(kernel, twin[name][fast], rtol=2e-5, atol=1e-5)


def test_road_feature_motion_agrees_with_the_twin(vehicle):
    response, steps = compute_surface_response(vehicle, "dry", 0.82), 4000
    run = run_paper_mode(
        vehicle, response, 40 / 3.6, False, command(onset=1.5).profile, HUMP, StepGrid(steps=steps, step=5e-4)
    )
    twin = reference.simulate_paper_drive(
        vehicle, "dry", response,
        reference.ReferenceDrive(
            initial_speed=40 / 3.6, pressure=lambda t: 2.3 * min(max(t - 1.5, 0) / 0.5, 1.0),
            loads=lambda n, _: run.log[n, 9:11], hazard=HUMP,
        ),
        steps=steps, step=5e-4,
    )  # fmt: skip
    np.testing.assert_allclose(run.log[:, 1], twin["speed"][:, 0], atol=1e-5)
    np.testing.assert_allclose(run.log[:, 5:7], twin["omega"], atol=1e-4)


def test_a_slow_abs_is_the_published_rate_limit(vehicle, drive):
    slow = replace(vehicle, abs_build_rate=4.0, abs_release_rate=8.0)
    ride = drive("snow", 0.24, car=slow, duration=4.0)
    change = np.diff(ride.columns["abs_scale_f"])
    assert change.max() <= 4.0e-3 + 1e-12 and change.min() >= -8.0e-3 - 1e-12
    assert change.min() < -7.9e-3
    fast = drive("snow", 0.24, car=replace(vehicle, abs_build_rate=2000.0, abs_release_rate=2000.0))
    for name, column in drive("snow", 0.24).columns.items():
        np.testing.assert_array_equal(fast.columns[name], column)


def test_passes_go_on_until_the_station_settles(vehicle, monkeypatch):
    """Half-car and wheels feed each other: a car that nearly stalls on a hump needs more passes than the published."""
    response = compute_surface_response(vehicle, "rain", 0.358)
    brake = command(10.3, onset=0.22, hold_s=0.3, release_s=0.0).profile
    hump = RoadHazard(center_m=1.904, length_m=3.2, height_m=0.12)

    def stations(most, *drive):
        monkeypatch.setattr(paper_mode, "MOST_PASSES", most)
        return run_paper_mode(
            vehicle, response, *drive, StepGrid(steps=8230, step=5e-4), load("low-speed rule")
        ).log[:, 0]

    usual, stalling = (40 / 3.6, True, command().profile, HUMP), (10.6 / 3.6, False, brake, hump)
    published, settled = (stations(most, *stalling) for most in (LITERAL_PASSES, MOST_PASSES))
    assert np.abs(settled - published).max() > 1e-3
    np.testing.assert_array_equal(stations(2 * MOST_PASSES, *stalling), settled)
    np.testing.assert_array_equal(stations(MOST_PASSES, *usual), stations(LITERAL_PASSES, *usual))


def test_the_body_response_is_that_of_road_and_brake_together(vehicle):
    """Superposition: one integration with both inputs, in the matrix form, for a braked hump."""
    response = compute_surface_response(vehicle, "dry", 0.82)
    run = run_paper_mode(
        vehicle, response, 40 / 3.6, True, command().profile, HUMP, StepGrid(steps=6000, step=5e-4)
    )
    states, road, loads = simulate_body(
        vehicle, response, HUMP, run.log, BrakedStop(onset=run.onset, sample=run.stop), 5e-4
    )
    assert (loads > 0).all()
    rates = np.gradient(states, 5e-4, axis=0)
    sample = slice(3500, 5000, 100)
    for x, rate, heights in zip(states[sample], rates[sample], road[sample], strict=True):
        without = reference.compute_half_car_rates(x, heights, 0.0, vehicle)
        np.testing.assert_allclose(np.delete(rate - without, 5), 0, atol=0.02)


def test_steady_braking_pitches_the_body_by_the_calibrated_moment(vehicle, drive):
    """K x = B_b gamma m_s h d, gamma 1.104778 on dry asphalt (Eq. app_brake_pitch)."""
    columns = drive(brake=command(1.5), duration=3.9).columns
    moment = 1.104778 * 1200 * 0.55 * -columns["longitudinal_acceleration"][3800]
    _, _, stiffness, _, direction = reference.build_half_car_matrices(vehicle)
    assert columns["pitch"][3800] == pytest.approx(
        np.linalg.solve(stiffness, direction * moment)[1], rel=1e-3
    )


def test_on_a_road_feature_the_moment_has_the_coupled_scale(drive):
    """0.98 (Table frozen_empirical_params), also before the feature is reached."""
    far = replace(HUMP, center_m=100.0)
    flat, feature = (
        drive(brake=command(1.5), duration=2.0, hazard=hazard).columns for hazard in (FLAT_ROAD, far)
    )
    assert feature["pitch"][1800] / flat["pitch"][1800] == pytest.approx(0.98, rel=2e-3)


def test_only_slowing_down_pitches_the_paper_body(drive):
    """d_theta = max(-dv/dt, 0): a depression's downhill side pushes the car without lifting its nose."""
    coast = command(0.0, onset=None)
    up, down = (
        drive(speed_km_h=40, brake=coast, duration=4.0, hazard=replace(HUMP, height_m=height))
        for height in (0.002, -0.002)
    )
    mirrored = np.abs(up.columns["pitch"] + down.columns["pitch"]).max()
    assert mirrored > 0.05 * np.abs(up.columns["pitch"]).max()


def test_loads_at_rest_carry_the_weight_and_loads_in_motion_average_to_it(vehicle, drive):
    columns = drive(speed_km_h=40, hazard=HUMP, brake=command(0.0, onset=None)).columns
    weight = vehicle.mass * vehicle.gravity
    total = columns["axle_load_f"] + columns["axle_load_r"]
    assert total[0] == pytest.approx(weight) and total[-1] == pytest.approx(weight, rel=1e-6)
    assert total.mean() == pytest.approx(weight, rel=1e-3)


def test_on_a_flat_road_the_analytic_load_feeds_the_tyre(drive):
    """The published seam: F_x = mu_B F_z holds with ``tyre_load``, not with the half-car's ``axle_load``."""
    columns = drive().columns
    braking = slice(2000, 4000)
    assert np.abs(columns["tyre_load_f"] - columns["axle_load_f"])[braking].min() > 10
    slip, tyre_load = columns["braking_slip_f"][braking], columns["tyre_load_f"][braking]
    assert np.corrcoef(columns["tyre_force_f"][braking] / tyre_load, slip)[0, 1] > 0.99


def test_on_a_road_feature_the_half_car_feeds_the_tyre(drive):
    columns = drive(speed_km_h=40, hazard=HUMP).columns
    np.testing.assert_array_equal(columns["tyre_load_f"], columns["axle_load_f"])


def test_the_paper_wheel_is_never_driven(drive):
    columns = drive(brake=command(onset=3.0)).columns
    assert columns["braking_slip_f"].min() == 0
    assert np.ptp(columns["wheel_speed_f"][:3000]) == 0 < np.ptp(columns["speed"][:3000])
