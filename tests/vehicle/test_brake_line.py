"""The brake line between command and pads, and the other numbers that a grown vehicle brings into coupled mode."""

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from tasks.surface.wet_friction import ANY_SPEED
from tasks.vehicle.effects.brake_line import (
    DISC_COOLING,
    compute_acting_pressure,
    compute_disc_temperature_rate,
    compute_line_pressure,
)
from tasks.vehicle.effects.equations import compute_friction_factor, compute_resistance, compute_strut_force
from tasks.vehicle.effects.table import pack_effect_values
from tests.vehicle.conftest import command

STOP = command(1.5)


def theta(**values):
    return pack_effect_values(values)


@pytest.fixture
def coupled(drive, vehicle):
    def run(effects=None, **scenario):
        return drive(mode="coupled", car=replace(vehicle, effects=effects or {}), **scenario).columns

    return run


def test_with_no_numbers_the_acting_pressure_is_the_commanded_one():
    assert compute_acting_pressure(2.345, 17.0, 300.0, theta()) == 2.345
    assert compute_line_pressure(1.0, 2.0, 2.345, 5e-4, theta()) == 2.345
    assert compute_friction_factor(theta(), 30.0, 1.4, 1e5, 1.0, ANY_SPEED) == 1.0


def test_each_number_of_the_line_does_what_it_says():
    assert compute_acting_pressure(2.0, 20.0, 0.0, theta(push_out=0.1)) == pytest.approx(1.9)
    assert compute_acting_pressure(2.0, 20.0, 200.0, theta(fade=0.06)) == pytest.approx(2.0 * 0.88)
    assert compute_acting_pressure(2.0, 20.0, 0.0, theta(pressure_curve=0.04)) == pytest.approx(2.16)
    pads = theta(pad_speed=0.006, pad_speed_reference=15.0)
    assert compute_acting_pressure(2.0, 20.0, 0.0, pads) == pytest.approx(2.0 * 0.97)
    assert compute_line_pressure(0.0, 1.0, 1.0, 0.1, theta(lag=0.1)) == pytest.approx(1.0 - exp(-1.0))


def test_discs_take_the_heat_and_give_it_to_the_air():
    assert compute_disc_temperature_rate(0.0, 7400.0, 7400.0) == 1.0
    assert compute_disc_temperature_rate(50.0, 50.0 * DISC_COOLING, 7400.0) == 0.0


def test_a_lag_and_a_dead_time_delay_the_torque_by_as_much(coupled):
    def reached(effects):
        columns = coupled(effects, brake=STOP, duration=2.5)
        torque = columns["brake_torque_f"]
        return np.flatnonzero(torque > 0.5 * torque.max())[0] * 1e-3

    plain = reached({})
    assert reached({"dead_time": 0.06}) - plain == pytest.approx(0.06, abs=0.002)
    assert 0.02 < reached({"lag": 0.05}) - plain < 0.06


def test_fade_lengthens_a_stop_and_leaves_coasting_as_it_is(coupled):
    plain, faded = (
        coupled(effects, brake=STOP, duration=3.5, speed_km_h=100) for effects in ({}, {"fade": 0.5})
    )
    assert faded["speed"][-1] > plain["speed"][-1] + 0.1
    coast = command(0.0, onset=None)
    still = [coupled(effects, brake=coast, duration=1.0)["speed"] for effects in ({}, {"fade": 0.5})]
    assert np.array_equal(*still)


def test_wind_creep_an_engine_in_gear_rubbing_pads_and_rolling_by_speed_change_coasting_by_their_force(
    coupled, vehicle
):
    coast = command(0.0, onset=None)
    turning = (vehicle.wheel_inertia_f + vehicle.wheel_inertia_r) / vehicle.wheel_radius**2
    plain = coupled(brake=coast, duration=0.6)
    v, a = plain["speed"][500], plain["longitudinal_acceleration"][500]
    weight = vehicle.mass * vehicle.gravity
    for effects, force in (
        ({"pad_drag": 40.0}, 40.0 / vehicle.wheel_radius),
        ({"rolling_speed": 0.0006}, 0.0006 * v * weight),
        ({"creep_force": 500.0, "creep_speed": 40.0}, -500.0 * (1.0 - v / 40.0)),
        # the same power through every gear: 4 kW at 60 km/h are 0.23 kN
        ({"engine_power": 4.0}, 4e3 / v / (1.0 + (12.0 * vehicle.wheel_radius / v) ** 2)),
    ):
        got = (a - coupled(effects, brake=coast, duration=0.6)["longitudinal_acceleration"][500]) * (
            vehicle.mass + turning
        )
        assert got == pytest.approx(force, rel=0.02), effects
    assert compute_resistance(theta(drag_area=1.0, wind_speed=-10.0), 10.0, 1.0, 0.0) == 0.0


def test_idle_creep_drives_a_wheel_and_not_a_body_whose_tyres_slide(coupled, vehicle):
    creep = {"creep_force": 800.0, "creep_speed": 8.0}

    def compare_with_a_force_on_the_body(pressure, **surface):
        stop = {**surface, "brake": command(pressure), "duration": 1.6, "speed_km_h": 25}
        plain, pushed = (coupled(effects, **stop) for effects in ({}, creep))
        window = slice(1300, 1500)
        less = np.mean((pushed["longitudinal_acceleration"] - plain["longitudinal_acceleration"])[window])
        return less * vehicle.mass / (800.0 * (1.0 - np.mean(pushed["speed"][window]) / 8.0))

    assert compare_with_a_force_on_the_body(0.8) == pytest.approx(1.0, abs=0.1)
    assert abs(compare_with_a_force_on_the_body(3.0, family="snow", friction=0.2)) < 0.1


def test_struts_meet_friction_and_a_stop():
    dry = theta(coulomb_friction=80.0)
    assert compute_strut_force(dry, 0.0, 0.0, 0.0, 0.5) == pytest.approx(80.0)
    assert compute_strut_force(dry, 0.0, 0.0, 0.0, -0.5) == pytest.approx(-80.0)
    stop = theta(stop_stiffness=1e5, stop_clearance=0.04)
    assert compute_strut_force(stop, 0.0, 0.0, -0.03, 0.0) == 0.0
    assert compute_strut_force(stop, 0.0, 0.0, -0.05, 0.0) == pytest.approx(-1000.0)


def test_friction_falls_with_speed_and_load():
    effects = theta(friction_speed=0.01, load_sensitivity=0.15)
    assert compute_friction_factor(effects, 20.0, 1.2, 0.0, 0.0, ANY_SPEED) == pytest.approx(0.8 * 0.97)
