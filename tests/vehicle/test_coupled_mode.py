"""Coupled mode: an adaptive solver on its twin, order of convergence, energy, contact, rest, and its physics."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from studies.peers import reference
from tasks.surface.road_profile import FLAT_ROAD, RoadHazard
from tasks.vehicle.model.chassis import Conditions, build_chassis
from tasks.vehicle.model.ports import compute_ports
from tasks.vehicle.model.states import AxleMemory, Instant, Memory, Motion
from tasks.vehicle.model.step import compute_body_rates, compute_motion_rates
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.road import make_road_feature
from tests.vehicle.conftest import HUMP, command

COAST = command(0.0, onset=None)
KERB = RoadHazard(center_m=20, length_m=0.6, height_m=0.10)


@pytest.fixture
def coupled(drive):
    return lambda *surface, **scenario: drive(*surface, mode="coupled", **scenario)


def work(columns, power):
    return np.concatenate([[0], np.cumsum(0.5e-3 * (power[1:] + power[:-1]))])


@pytest.mark.parametrize("pressure", [0.0, 0.7, 2.3])
def test_rates_agree_with_the_twin_in_any_state(vehicle, pressure):
    response = compute_surface_response(vehicle, "rain", 0.4)
    chassis = build_chassis(vehicle, response, Conditions())
    rng = np.random.default_rng(2)
    for _ in range(200):
        speed, station = rng.uniform(0.1, 30), rng.uniform(17, 25)
        omega = speed / 0.32 * rng.uniform(0.6, 1.1, 2)
        x = rng.normal(0, 0.02, 8)
        motion = Motion(station, speed, *omega)
        ports = compute_ports(
            motion,
            Memory(AxleMemory(0.0, 0.0, 0.0, 0.0), AxleMemory(0.0, 0.0, 0.0, 0.0)),
            tuple(x),
            Instant(0.0, pressure, 0.0, 0.0, False, False, 0.0, 0.0),
            1.0,
            1.0,
            1.0,
            None,
            chassis,
            response.tyre,
            make_road_feature(HUMP),
        )
        rates = compute_motion_rates(motion, ports, False, chassis)
        body = compute_body_rates(tuple(x), ports, chassis)
        twin = reference.compute_coupled_rates(
            np.array([speed, station, *omega, *x]), pressure, vehicle, "rain", response, HUMP
        )
        kernel = [rates.speed, rates.station, rates.omega_f, rates.omega_r, *body]
        np.testing.assert_allclose(kernel, twin, rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize(
    ("family", "friction", "speed_km_h", "hazard"),
    [("dry", 0.82, 40, HUMP), ("snow", 0.24, 20, FLAT_ROAD)],
)
def test_motion_agrees_with_an_adaptive_implicit_solver(
    vehicle, coupled, family, friction, speed_km_h, hazard
):
    response = compute_surface_response(vehicle, family, friction)
    v0 = speed_km_h / 3.6

    def rates(t, y):
        pressure = 2.3 * min(max(t - 1.0, 0.0) / 0.5, 1.0)
        return reference.compute_coupled_rates(y, pressure, vehicle, family, response, hazard)

    state = np.array([v0, 0.0, v0 / 0.32, v0 / 0.32, *np.zeros(8)])
    times = np.arange(0, 2.6, 0.1)
    solution = solve_ivp(
        rates, (0, 2.6), state, method="LSODA", rtol=1e-6, atol=1e-8, max_step=0.01, t_eval=times
    )
    columns = coupled(family, friction, speed_km_h=speed_km_h, hazard=hazard, duration=2.6).columns
    names = ("speed", "station", "wheel_speed_f", "wheel_speed_r", "heave", "pitch")
    tolerance = (2e-4, 2e-4, 2e-3, 2e-3, 1e-5, 1e-5)
    ticks = np.rint(times * 1000).astype(int)
    for row, name, atol in zip(solution.y, names, tolerance, strict=False):
        np.testing.assert_allclose(columns[name][ticks], row, atol=atol, err_msg=name)


def test_the_method_is_of_second_order(coupled):
    runs = [
        coupled(speed_km_h=40, hazard=HUMP, brake=COAST, duration=3.0, step=1e-3 / 2**k).columns
        for k in (0, 1, 5)
    ]
    for name in ("pitch", "heave", "axle_load_f"):
        coarse, fine = (np.abs(run[name] - runs[2][name]).max() for run in runs[:2])
        assert coarse / fine == pytest.approx(4, rel=0.15), name


@pytest.mark.parametrize("surface", [("dry", 0.82), ("rain", 0.347126), ("snow", 0.24)])
def test_halving_the_step_moves_a_stop_by_less_than_a_tenth_of_a_millimetre(coupled, surface):
    coarse, fine = (coupled(*surface, step=step) for step in (5e-4, 2.5e-4))
    assert coarse.stopping_distance == pytest.approx(fine.stopping_distance, abs=1e-4)
    assert np.abs(coarse.columns["pitch"] - fine.columns["pitch"]).max() < 2e-4


def test_kinetic_energy_lost_is_the_work_of_tyres_brakes_and_drag(vehicle, coupled):
    ride = coupled("rain", 0.4)
    c = {name: column[: int(ride.stop_time * 1000) - 1] for name, column in ride.columns.items()}
    wheels = [c["wheel_speed_f"], c["wheel_speed_r"]]
    energy = 0.5 * vehicle.mass * c["speed"] ** 2 + 0.5 * 2.4 * sum(omega**2 for omega in wheels)
    sliding = sum(c[f"tyre_force_{a}"] * (c["speed"] - 0.32 * c[f"wheel_speed_{a}"]) for a in "fr")
    braking = sum(c[f"brake_torque_{a}"] * c[f"wheel_speed_{a}"] for a in "fr")
    drag = vehicle.mass * 0.004 * c["speed"]
    lost = work(c, sliding + braking + drag)
    np.testing.assert_allclose(energy[0] - energy, lost, atol=1e-4 * energy[0])


def test_on_a_hump_the_road_force_does_the_rest_of_the_work(vehicle, coupled):
    c = coupled(speed_km_h=40, hazard=HUMP, brake=COAST, duration=4.0).columns
    energy = 0.5 * vehicle.mass * c["speed"] ** 2 + 0.5 * 2.4 * (
        c["wheel_speed_f"] ** 2 + c["wheel_speed_r"] ** 2
    )
    power = c["road_force"] * c["speed"] - vehicle.mass * 0.004 * c["speed"]
    power -= sum(c[f"tyre_force_{a}"] * (c["speed"] - 0.32 * c[f"wheel_speed_{a}"]) for a in "fr")
    assert np.ptp(energy) > 1000
    np.testing.assert_allclose(energy - energy[0], work(c, power), atol=1.0)


def test_newtons_law_holds_on_the_logged_columns(vehicle, coupled):
    c = coupled(speed_km_h=40, hazard=HUMP).columns
    moving = c["speed"] > 0
    force = c["road_force"] - c["tyre_force_f"] - c["tyre_force_r"] - vehicle.mass * 0.004
    np.testing.assert_allclose(
        c["longitudinal_acceleration"][moving], force[moving] / vehicle.mass, atol=1e-12
    )


def test_tyre_force_is_friction_of_slip_times_the_one_load(vehicle, coupled):
    response = compute_surface_response(vehicle, "rain", 0.4)
    c = coupled("rain", 0.4, speed_km_h=40, hazard=HUMP, duration=3.0).columns
    for axle in "fr":
        np.testing.assert_array_equal(c[f"tyre_load_{axle}"], c[f"axle_load_{axle}"])
        friction = reference.compute_reference_friction(c[f"braking_slip_{axle}"], vehicle, "rain", response)
        np.testing.assert_allclose(c[f"tyre_force_{axle}"], friction * c[f"axle_load_{axle}"], atol=0.1)


def test_weak_braking_stops_where_constant_force_says(coupled):
    """Below the ABS, dv/dt = -(T/R) / (m + I/R^2 (1 - kappa)) - a_coast, distance v0^2 / (2 |dv/dt|)."""
    ride = coupled(brake=command(0.8, onset=0.0, ramp_s=0.0), duration=15.0)
    deceleration = 800 / 0.32 / (1308 + 4.8 / 0.32**2) + 0.004
    assert ride.stopping_distance == pytest.approx((60 / 3.6) ** 2 / (2 * deceleration), rel=2e-3)


def test_steady_braking_moves_the_load_that_the_whole_car_demands(vehicle, coupled):
    """Moments about the ground: m h_cg d / L_w, and the wheels' own inertia I d / (R L_w)."""
    c = coupled(brake=command(1.5), duration=3.9).columns
    d = -c["longitudinal_acceleration"][3800]
    expected = (vehicle.mass * vehicle.cg_height + 4.8 / 0.32) * d / vehicle.wheelbase
    assert c["axle_load_f"][3800] - 7069.74 == pytest.approx(expected, rel=2e-3)


def test_the_calibrated_pitch_scale_is_the_mass_of_the_axles(vehicle, coupled):
    """gamma stands at 1.105 to 1.143 for braking; whole mass and wheel inertia over body mass give 1.113."""
    gamma = (vehicle.mass * vehicle.cg_height + 4.8 / 0.32) / (vehicle.sprung_mass * vehicle.cg_height)
    assert gamma == pytest.approx(1.113, abs=1e-3)
    scales = [scale for family in vehicle.families.values() for scale in family.pitch_scale]
    assert min(scales) < gamma < max(scales)


def test_stopping_distance_grows_with_speed_and_as_friction_falls(coupled):
    by_speed = [coupled(speed_km_h=speed).stopping_distance for speed in (20, 40, 60, 80)]
    by_friction = [coupled("rain", mu).stopping_distance for mu in (0.55, 0.5, 0.45, 0.4, 0.35)]
    for stops in (by_speed, by_friction):
        assert all(longer > shorter for shorter, longer in pairwise(stops))


def test_a_free_wheel_is_driven_by_the_road(coupled):
    c = coupled(speed_km_h=40, hazard=HUMP, brake=COAST, duration=4.0).columns
    assert np.ptp(c["speed"]) > 0.05
    np.testing.assert_allclose(c["wheel_speed_f"] * 0.32, c["speed"], atol=2e-3)
    assert c["braking_slip_f"].min() < 0 < c["braking_slip_f"].max()


def test_small_features_mirror(coupled):
    flat, up, down = (
        coupled(speed_km_h=40, brake=COAST, duration=4.0, hazard=replace(HUMP, height_m=height)).columns
        for height in (0.0, 0.002, -0.002)
    )
    for name in ("pitch", "heave"):
        assert np.abs(up[name] + down[name] - 2 * flat[name]).max() < 0.002 * np.abs(up[name]).max()


def test_contact_opens_and_an_unloaded_tyre_has_no_force(coupled):
    c = coupled(speed_km_h=40, hazard=KERB, duration=4.0).columns
    for axle in "fr":
        open_ = ~c[f"contact_{axle}"]
        assert open_.sum() > 5
        assert not c[f"tyre_force_{axle}"][open_].any()
        assert c[f"axle_load_{axle}"].min() == 0


@pytest.mark.parametrize("surface", [("dry", 0.82), ("rain", 0.347126), ("snow", 0.24)])
def test_wheels_are_quiet_down_to_standstill(coupled, surface):
    """No chatter: over the last half metre per second slip and force go one way only."""
    c = coupled(*surface).columns
    last = (c["speed"] < 0.5) & (c["speed"] > 0)
    assert last.sum() > 50
    for name in ("braking_slip_f", "tyre_force_f", "braking_slip_r", "tyre_force_r"):
        there_and_back = np.abs(np.diff(c[name][last])).sum()
        assert there_and_back < 1.1 * np.ptp(c[name][last]) + 1e-3 * np.abs(c[name][last]).max(), name


def test_a_locked_wheel_stands_quietly_and_never_turns_backward(vehicle, coupled):
    no_abs = replace(vehicle, abs_build_rate=1e-9, abs_release_rate=1e-9)
    c = coupled("snow", 0.24, car=no_abs, duration=12.0).columns
    sliding = (c["speed"] > 1) & (np.arange(12001) > 2000)
    assert c["wheel_speed_f"].min() > -1e-9
    assert np.abs(c["wheel_speed_f"][sliding]).max() < 0.05
    assert c["braking_slip_f"][sliding].min() > 0.99
    assert np.abs(np.diff(c["wheel_speed_f"][sliding])).max() < 1e-3


def test_the_car_stops_on_a_slope_and_is_held_there(vehicle, coupled):
    long_hump = RoadHazard(center_m=17.5, length_m=16.0, height_m=0.5)
    ride = coupled(speed_km_h=40, hazard=long_hump, brake=command(onset=0.0), duration=12.0)
    c = ride.columns
    assert c["speed"][-1] == 0 and abs(c["road_force"][-1]) > 100
    assert c["tyre_force_f"][-1] + c["tyre_force_r"][-1] == pytest.approx(c["road_force"][-1])
    assert abs(c["pitch_rate"][-1]) < 1e-7


def test_a_slow_abs_keeps_its_rates(vehicle, coupled):
    slow = replace(vehicle, abs_build_rate=4.0, abs_release_rate=8.0)
    change = np.diff(coupled("snow", 0.24, car=slow, duration=4.0).columns["abs_scale_f"])
    assert change.max() <= 4.0e-3 + 1e-12 and change.min() >= -8.0e-3 - 1e-12
    assert change.min() < -7.9e-3
