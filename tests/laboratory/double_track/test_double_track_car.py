"""The double-track car obeys momentum, energy and statics; its tyre and controller do what they should."""

from math import pi

import numpy as np
import pytest

from catalogs.entries import load
from studies.double_track.car import Surroundings, build_car
from studies.double_track.declared import find_surface, read_declared, read_vehicle, values_of
from studies.double_track.drive import drive_run, start_state, wheel_slips
from studies.double_track.motion import (
    CLIMB,
    DISC,
    HEAT,
    HEAVE_RATE,
    HEIGHT,
    PITCH,
    PUSH,
    PUSH_RATE,
    SPEED,
    STATION,
    TURN,
    Inputs,
)  # fmt: skip
from studies.double_track.suspension import damper_force, stop_force
from studies.double_track.tyre import magic_formula
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.tyres.burckhardt import compute_burckhardt_friction
from tasks.vehicle.tyres.magic_formula import Longitudinal, compute_longitudinal_friction

pytestmark = pytest.mark.minutes  # its kernels take half a minute to compile
SURFACES = read_declared("car")["surfaces"]["rows"]


def drive(plan, effects=(), abs_on=True, changes=(), weather="dry", rate=0, hazard=(0.0, 0.0, 0.0)):
    """States and rates of a run of (speed, pressure, duration), with the car's record."""
    speed, peak, duration = plan
    surface = find_surface(weather, rate)
    record = build_car(dict(effects), Surroundings(surface=surface, hazard=hazard))
    for name, value in dict(changes).items():
        record[0][name] = value
    controller = values_of(read_declared("car")["abs"]) | {"target_slip": surface["target_slip"]}
    if not abs_on:
        controller["least_speed"] = 1e9
    time = np.arange(round(duration * 100)) * 0.01
    still = np.zeros(len(time))
    pressure = peak * np.clip((time - 0.3) / 0.2, 0.0, 1.0)
    inputs = Inputs(0.01, pressure, still, still, still, still, np.array([-1, 0, 0]), np.zeros(4))
    return *drive_run(record, inputs, start_state(record, speed, 20.0), controller, 0.5), record[0]


def integral(values):
    return float(np.trapezoid(values, dx=0.01))


def test_static_loads_carry_the_weight_and_balance_about_the_centre_of_gravity():
    car = build_car({}, Surroundings(surface=SURFACES[0]))[0]
    vehicle = load("vehicle", "paper-reference")
    loads = car["static_load"]
    assert loads.sum() == pytest.approx(vehicle.mass * vehicle.gravity, rel=1e-12)
    assert (loads[:2].sum(), loads[2:].sum()) == pytest.approx(vehicle.static_axle_loads, rel=1e-12)
    to_left = read_declared("car")["body"]["cg_to_left"]["value"]
    assert loads @ car["aside"] == pytest.approx(vehicle.sprung_mass * vehicle.gravity * to_left, rel=1e-9)


def test_a_car_without_inputs_stays_in_equilibrium_and_coasts_by_the_catalogue():
    states, rates, _ = drive((20.0, 0.0, 1.0))
    assert np.abs(rates[:, SPEED] + read_vehicle("paper-reference")["coast_deceleration"]).max() < 1e-3
    assert np.abs(states[:, [PITCH, HEIGHT, HEIGHT + 3]]).max() < 1e-5


def test_braking_takes_as_much_energy_as_discs_tyres_and_bushings_get():
    quiet = {"disc_cooling": 0.0, "disc_cooling_by_speed": 0.0, "tyre_cooling": 0.0}
    y, _, car = drive((20.0, 2.3, 3.0), changes=quiet)
    hub = y[:, [SPEED]] + y[:, PUSH_RATE : PUSH_RATE + 4]
    kinetic = 0.5 * car["body_mass"] * y[:, SPEED] ** 2 + 0.5 * hub**2 @ car["wheel_mass"]
    kinetic += 0.5 * y[:, TURN : TURN + 4] ** 2 @ car["wheel_inertia"]
    kinetic += 0.5 * car["fore_aft_stiffness"] * (y[:, PUSH : PUSH + 4] ** 2).sum(axis=1)
    heat = (y[:, DISC : DISC + 2] - 20.0) @ car["disc_capacity"] + y[:, HEAT : HEAT + 4].sum(axis=1)
    bushings = car["fore_aft_damping"] * integral((y[:, PUSH_RATE : PUSH_RATE + 4] ** 2).sum(axis=1))
    mass = car["body_mass"] + car["wheel_mass"].sum()
    coasting = mass * car["coast"] * (y[-1, STATION] - y[0, STATION])
    lost = kinetic[0] - kinetic[-1]
    assert lost == pytest.approx(heat[-1] - heat[0] + bushings + coasting, rel=2e-4)
    assert lost > 150e3


def test_loads_change_by_what_accelerates_body_and_wheels_upward():
    y, dy, car = drive((11.0, 0.0, 2.5), hazard=(12.0, 3.7, 0.075), changes={"tyre_damping": 0.0})
    up = dy[:, HEAVE_RATE] * car["body_mass"] + dy[:, CLIMB : CLIMB + 4] @ car["wheel_mass"]
    station = y[:, [STATION]] - np.array([0, 0, 1, 1]) * car["wheelbase"] + y[:, PUSH : PUSH + 4]
    bump = np.where(abs(station - 12.0) < 1.85, 0.0375 * (1 + np.cos(2 * pi * (station - 12.0) / 3.7)), 0.0)
    load = np.maximum(car["static_load"] + car["tyre_stiffness"] * (bump - y[:, HEIGHT : HEIGHT + 4]), 0.0)
    assert np.abs(up - (load - car["static_load"]).sum(axis=1)).max() < 1e-6 * car["static_load"].sum()
    assert np.abs(up).max() > 3e3


def test_braking_pitches_the_body_as_load_transfer_over_the_springs():
    y, dy, car = drive((28.0, 1.5, 4.0))
    moment = -dy[-1, SPEED] * (car["body_mass"] * (car["body_lever"] + car["radius"]))
    moment -= dy[-1, SPEED] * car["wheel_mass"].sum() * car["radius"]
    moment -= dy[-1, TURN : TURN + 4] @ car["wheel_inertia"]
    front, rear = (2.0 / (1.0 / car["spring"][i] + 1.0 / car["tyre_stiffness"][i]) for i in (0, 2))
    a, b = car["ahead"][0], -car["ahead"][2]
    pitch = moment * (front + rear) / (front * rear * (a + b) ** 2)
    assert y[-1, PITCH] == pytest.approx(pitch, rel=0.01)


def test_the_controller_cycles_about_the_target_and_uses_nearly_all_grip():
    y, _, car = drive((21.0, 2.4, 3.0), weather="rain", rate=10)
    surface = find_surface("rain", 10)
    slips = np.array([wheel_slips(state, float(car["radius"])) for state in y[100:]]) / surface["target_slip"]
    used = (y[100, SPEED] - y[-1, SPEED]) / (0.01 * (len(y) - 101)) / (car["gravity"] * surface["peak"])
    assert 0.9 < slips.mean() < 1.2
    assert all(slips[:, i].max() > 1.15 and slips[:, i].min() < 0.95 for i in range(4))
    crossings = (np.diff(np.sign(slips - 1.0), axis=0) != 0).sum(axis=0)
    assert (crossings >= 8).all() and (crossings <= 60).all()
    assert 0.97 < used <= 1.0


@pytest.mark.parametrize("slip", [0.01, 0.05, 0.12, 0.6])
def test_the_tyre_is_as_another_implementation_has_it(slip):
    c = Longitudinal(**dict.fromkeys(Longitudinal._fields, 0.0))
    c = c._replace(pcx1=1.3, pdx1=0.9, pex1=0.4, pkx1=25.0)
    assert magic_formula(slip, 0.9, 25.0, 1.3, 0.4) == pytest.approx(
        compute_longitudinal_friction(slip, 0.0, 0.0, c), rel=1e-9
    )


@pytest.mark.parametrize("row", SURFACES, ids=lambda row: f"{row['weather']}-{row['rate']}")
def test_friction_by_weather_is_that_of_the_mapping_and_near_the_judged_curve(row):
    weather = Weather(
        kind=row["weather"],
        precipitation_mm_h=row["rate"],
        snow_accumulation_h=float(row["weather"] == "snow"),
    )
    state = surface_state(weather, load("surface", "dense-asphalt"))
    tyre = compute_surface_response(load("vehicle", "paper-reference"), row["weather"], state.friction).tyre
    assert row["peak"] == pytest.approx(tyre.peak, abs=1e-6)
    assert row["target_slip"] == pytest.approx(tyre.target_slip, abs=1e-5)
    assert row["snow_depth_mm"] == pytest.approx(state.snow_depth_mm)
    assert row["slip_stiffness"] == pytest.approx(0.87 * (tyre.rise * tyre.decay - tyre.fall), rel=1e-4)
    curve = (row["peak"], row["slip_stiffness"], row["shape"], row["curvature"])
    slips = np.linspace(0.0, 1.0, 20001)
    own = np.array([magic_formula(x, *curve) for x in slips])
    judged = np.array([compute_burckhardt_friction(x, 1.0, tyre) for x in slips])
    levels = np.linspace(0.15, 0.9, 16) * tyre.peak
    ratio = np.interp(levels, own[: own.argmax()], slips[: own.argmax()]) / np.interp(
        levels, judged[: judged.argmax()], slips[: judged.argmax()]
    )
    assert np.abs(ratio - 1.0).max() < 0.1
    assert own.max() == pytest.approx(judged.max(), rel=0.02)
    assert magic_formula(tyre.target_slip, *curve) == pytest.approx(tyre.peak, rel=0.02)


def test_dampers_lose_rate_and_stops_gain_it():
    assert damper_force(1e-4, 2000.0, 3.0, 0.0) == pytest.approx(0.2, rel=1e-6)
    assert damper_force(3.0, 2000.0, 3.0, 0.0) == pytest.approx(6000.0 / 2**0.5)
    assert damper_force(0.1, 2000.0, 3.0, 0.3) > -damper_force(-0.1, 2000.0, 3.0, 0.3) > 0.0
    assert stop_force(-0.03, 0.03, 1e5, 0.02) == 0.0
    assert stop_force(-0.05, 0.03, 1e5, 0.02) == pytest.approx(-3000.0)


def test_unknown_effects_are_refused_by_name():
    with pytest.raises(ValueError, match="the car has no drag_aera; it has"):
        build_car({"drag_aera": 0.5}, Surroundings(surface=SURFACES[0]))
