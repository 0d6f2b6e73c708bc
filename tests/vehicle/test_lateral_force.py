"""A sticking tyre holds its place sideways: its deflection, the friction circle, the links, and the end of a stop."""

from dataclasses import replace
from math import exp, hypot

import numpy as np
import pytest

from tasks.vehicle.effects.chassis import (
    STICK_SLIP,
    compute_effective_friction,
    compute_effective_slope,
    compute_stick_friction,
)
from tasks.vehicle.effects.lateral_force import (
    NO_HOLD,
    compute_lateral_deflection_rate,
    compute_lateral_hold,
)
from tasks.vehicle.effects.table import pack_effect_values
from tasks.vehicle.parameters import compute_surface_response
from tests.vehicle.conftest import command

LINKS = {"track_change": 0.14, "track_change_by_travel": 1.9, "bump_steer": 0.08, "lateral_stiffness": 1e5}
STICKING = {"stick_ratio": 1.0, "stick_below": 1.0, "stick_above": 3.0, **LINKS}


def test_the_hold_of_an_axle_has_the_value_of_its_equations():
    hold = compute_lateral_hold(
        0.01, 0.002, 0.05, -0.2, 2.0, 4000.0, 0.5, pack_effect_values({**STICKING, "track_change": 0.1})
    )
    # 1000 of 4000 N; half the friction asked by braking at STICK_SLIP, so the circle does not bind; incline 0.1 + 1.9 x 0.05
    assert hold.wound == 0.25
    assert hold.link_force == pytest.approx(0.5 * 1000.0 * 0.195, rel=1e-12)
    # 2 m/s x 0.08 x 0.05 - 0.195 x 0.2 m/s, which unwinds within a reach of 0.04 m
    assert hold.rate == pytest.approx(-0.031 - 0.031 * 0.01 / 0.04, rel=1e-12)


def test_without_a_lateral_stiffness_there_is_no_hold_and_no_bit_changes(drive, vehicle):
    loose = {**LINKS, "lateral_stiffness": 0.0}
    assert compute_lateral_hold(0.01, 0.5, 0.05, 0.1, 1.0, 4e3, 1.0, pack_effect_values(loose)) == NO_HOLD
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


@pytest.mark.parametrize("wound", [-1.0, 0.3, 0.9, 1.0])
def test_braking_and_lateral_force_of_a_sticking_tyre_keep_the_friction_circle(vehicle, wound):
    effects = pack_effect_values(STICKING)
    tyre = compute_surface_response(vehicle, "dry", 0.82).tyre
    grip = compute_stick_friction(tyre, effects)
    for slip in (0.0005, 0.003, 1.0):
        along = compute_effective_friction(slip, 4e3, 1.0, tyre, effects, wound)
        across = (
            compute_lateral_hold(
                wound * grip * 4e3 / 1e5, slip, 0.0, 0.0, 1.0, grip * 4e3, 1.0, effects
            ).link_force
            / 0.14
            / 4e3
        )
        assert hypot(along, across) <= grip * (1.0 + 1e-12)
        if hypot(slip / STICK_SLIP / hypot(1.0, slip / STICK_SLIP), wound) >= 1.0:
            assert hypot(along, across) == pytest.approx(grip, rel=1e-12)
        rise = (
            compute_effective_friction(slip * (1 + 1e-5), 4e3, 1.0, tyre, effects, wound)
            - compute_effective_friction(slip * (1 - 1e-5), 4e3, 1.0, tyre, effects, wound)
        ) / (2e-5 * slip)
        slope = compute_effective_slope(slip, 4e3, 1.0, tyre, effects, wound)
        assert slope == pytest.approx(rise, rel=1e-4, abs=1e-6)


def test_a_gentle_stop_gives_up_its_dive_before_it_stands_and_more_of_it_than_a_hard_one(drive, vehicle):
    kept = {}
    for effects in ({}, STICKING):
        for pressure in (1.6, 2.3):
            car = replace(vehicle, effects=effects)
            columns = drive(
                "dry", 0.82, mode="coupled", car=car, brake=command(pressure), duration=7.0
            ).columns
            speed, pitch = columns["speed"], columns["pitch"] - vehicle.static_pitch
            rolling, standing = np.argmax((speed < 3.5)), np.argmax(speed < 0.1)
            held = columns["longitudinal_acceleration"][[rolling, standing]]
            assert held[1] == pytest.approx(held[0], rel=0.02)
            kept[bool(effects), pressure] = pitch[standing] / pitch[rolling]
    assert kept[False, 1.6] > 0.97 and kept[False, 2.3] > 0.97
    assert kept[True, 1.6] < kept[True, 2.3] - 0.1 < 0.8


def test_a_wheel_that_sticks_does_not_dither_about_zero_slip_at_the_end_of_a_stop(drive, vehicle):
    """A step that does not see the sign of the force ahead hangs at walking speed, with force in every sample."""
    car = replace(vehicle, effects={**STICKING, "rolling_coefficient": 0.012}, lock_speed=0.25)
    columns = drive("dry", 0.82, mode="coupled", car=car, brake=command(2.3), duration=5.0).columns
    slow = (columns["speed"] < 0.4) & (columns["speed"] > 0.06)
    lost = -np.gradient(columns["speed"], 1e-3)[slow]
    np.testing.assert_allclose(lost, -columns["longitudinal_acceleration"][slow], rtol=0.2)
