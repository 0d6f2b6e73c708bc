"""A sticking tyre holds its place sideways: its deflection, the friction circle, the links, and the end of a stop."""

from dataclasses import replace
from math import exp, hypot

import numpy as np
import pytest

from tasks.vehicle.effects.lateral_force import (
    NO_HOLD,
    compute_lateral_deflection_rate,
    compute_lateral_hold,
)
from tasks.vehicle.effects.table import pack_effect_values
from tests.vehicle.conftest import command

LINKS = {"track_change": 0.14, "track_change_by_travel": 1.7, "bump_steer": 0.14, "lateral_stiffness": 1.6e5}
STICKING = {"stick_ratio": 0.777, "stick_below": 1.0, "stick_above": 3.0, **LINKS}


def test_the_hold_of_an_axle_has_the_value_of_its_equations():
    hold = compute_lateral_hold(0.01, 2400.0, 0.05, -0.2, 2.0, 4000.0, 0.5, pack_effect_values(LINKS))
    # 1600 N of deflection within the 3200 N that the circle leaves; incline 0.14 + 1.7 x 0.05
    assert hold.link_force == pytest.approx(0.5 * 1600.0 * 0.225, rel=1e-12)
    # 2 m/s x 0.14 x 0.05 - 0.225 x 0.2 m/s, which unwinds within a reach of 0.025 m
    assert hold.rate == pytest.approx(-0.031 - 0.031 * 0.01 / 0.025, rel=1e-12)


def test_without_a_lateral_stiffness_there_is_no_hold_and_no_bit_changes(drive, vehicle):
    loose = {**LINKS, "lateral_stiffness": 0.0}
    assert compute_lateral_hold(0.01, 1e3, 0.05, 0.1, 1.0, 4e3, 1.0, pack_effect_values(loose)) == NO_HOLD
    brake = {"brake": command(2.3), "mode": "coupled", "duration": 5.0}
    plain, held = (drive("dry", 0.82, car=replace(vehicle, effects=e), **brake) for e in ({}, loose))
    assert plain.columns.keys() == held.columns.keys()
    for name, values in plain.columns.items():
        assert values.tobytes() == held.columns[name].tobytes(), name


def test_a_deflection_follows_the_road_and_ends_where_the_tyre_slides():
    deflection, reach, step = 0.0, 0.02, 1e-5
    for _ in range(3000):
        deflection += step * compute_lateral_deflection_rate(deflection, 1.0, reach)
    assert deflection == pytest.approx(reach * (1.0 - exp(-0.03 / reach)), rel=1e-3)


@pytest.mark.parametrize("brake_force", [-3900.0, 0.0, 2400.0, 3999.0, 5000.0])
def test_the_lateral_force_gets_what_braking_leaves_of_the_friction_circle(brake_force):
    for deflection in (-1.0, -0.004, 0.01, 1.0):
        hold = compute_lateral_hold(
            deflection, brake_force, 0.0, 0.0, 1.0, 4000.0, 1.0, pack_effect_values(LINKS)
        )
        force = hold.link_force / 0.14
        assert force * deflection >= 0.0
        assert hypot(force, brake_force) <= max(4000.0, abs(brake_force)) * (1.0 + 1e-12)
        if abs(deflection) == 1.0 and abs(brake_force) < 4000.0:
            assert hypot(force, brake_force) == pytest.approx(4000.0, rel=1e-12)


def test_a_gentle_stop_gives_up_its_dive_before_it_stands_and_more_of_it_than_a_hard_one(drive, vehicle):
    kept = {}
    for effects in ({}, STICKING):
        for pressure in (1.6, 2.3):
            car = replace(vehicle, effects=effects)
            columns = drive(
                "dry", 0.82, mode="coupled", car=car, brake=command(pressure), duration=7.0
            ).columns
            speed, pitch = columns["speed"], columns["pitch"] - vehicle.static_pitch
            rolling, standing = np.argmax(speed < 3.5), np.argmax(speed < 0.1)
            held = columns["longitudinal_acceleration"][[rolling, standing]]
            assert held[1] == pytest.approx(held[0], rel=0.02)
            kept[bool(effects), pressure] = pitch[standing] / pitch[rolling]
    assert kept[False, 1.6] > 0.97 and kept[False, 2.3] > 0.97
    assert kept[True, 1.6] < kept[True, 2.3] - 0.1 < 0.8
