from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from tasks.errors import InputError
from tasks.vehicle.effects.chassis import (
    average_over_footprint,
    compute_effective_friction,
    compute_effective_slope,
    compute_lateral_reserve,
    compute_stick_share,
    find_contact,
)
from tasks.vehicle.effects.equations import AIR_DENSITY
from tasks.vehicle.effects.table import pack_effect_values
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.road import compute_road_height, make_road_feature
from tests.vehicle.conftest import HUMP, command

COAST = command(0.0, onset=None)


@pytest.fixture
def coupled(drive, vehicle):
    def run(*surface, effects=None, **scenario):
        car = replace(vehicle, effects=effects or {})
        return drive(*surface, mode="coupled", car=car, **scenario)

    return run


def test_an_effect_that_is_none_is_named_and_those_that_exist_are_listed():
    with pytest.raises(InputError, match=r"effect turbo: a vehicle has no such number.*drag_area"):
        pack_effect_values({"turbo": 1.0})


def test_coasting_loses_what_air_and_rolling_resistance_take(vehicle, coupled):
    effects = {"drag_area": 0.7, "rolling_coefficient": 0.012}
    car = coupled(brake=COAST, duration=1.0, effects=effects).columns
    plain = coupled(brake=COAST, duration=1.0).columns
    v = car["speed"][500]
    turning = (vehicle.wheel_inertia_f + vehicle.wheel_inertia_r) / vehicle.wheel_radius**2
    force = 0.5 * AIR_DENSITY * 0.7 * v**2 + 0.012 * vehicle.mass * vehicle.gravity
    extra = plain["longitudinal_acceleration"][500] - car["longitudinal_acceleration"][500]
    assert extra == pytest.approx(force / (vehicle.mass + turning), rel=2e-3)


def test_brakes_lock_the_wheels_below_the_cut_off_and_not_above(coupled):
    car = coupled("rain", 0.4, effects={"abs_cutoff": 2.0}).columns
    fast, slow = car["speed"] > 2.05, (car["speed"] < 1.5) & (car["speed"] > 0.6)
    assert car["braking_slip_f"][fast].max() < 0.2
    assert car["braking_slip_f"][slow].min() > 0.9
    assert coupled("rain", 0.4).columns["braking_slip_f"][slow].max() < 0.2


def test_a_sticking_tyre_has_its_own_friction_below_one_speed_and_the_curve_above_the_other(vehicle):
    effects = pack_effect_values({"stick_ratio": 0.7, "stick_below": 1.0, "stick_above": 3.0})
    tyre = compute_surface_response(vehicle, "rain", 0.4).tyre
    shares = [compute_stick_share(v, effects) for v in (0.1, 1.0, 2.0, 3.0, 20.0)]
    assert shares == [1.0, 1.0, pytest.approx(0.5), 0.0, 0.0]
    assert compute_effective_friction(1.0, 4e3, 1.0, tyre, effects) == pytest.approx(
        0.7 * tyre.peak, rel=1e-4
    )
    assert compute_effective_friction(tyre.target_slip, 4e3, 0.0, tyre, effects) == pytest.approx(tyre.peak)
    for slip in (0.003, 0.02, 0.3):
        rise = (compute_effective_friction(slip + 1e-6, 4e3, 0.4, tyre, effects)
                - compute_effective_friction(slip - 1e-6, 4e3, 0.4, tyre, effects)) / 2e-6  # fmt: skip
        assert compute_effective_slope(slip, 4e3, 0.4, tyre, effects) == pytest.approx(rise, rel=1e-5)


def test_sticking_tyres_do_not_chatter_once_the_brake_is_released(coupled):
    sticking = {"stick_ratio": 0.777, "stick_below": 1.0, "stick_above": 3.0, "rolling_coefficient": 0.012}
    brake = command(2.2, onset=0.2, ramp_s=0.0, hold_s=0.333, release_s=0.0)
    ticks = coupled(brake=brake, speed_km_h=9.53, duration=2.0, effects=sticking).columns
    rate = np.gradient(ticks["speed"], 1e-3)
    after = slice(560, 2000)
    assert np.abs(ticks["longitudinal_acceleration"] - rate)[after].max() < 1e-3
    assert rate[after] == pytest.approx(-0.12, abs=0.01)


def test_the_footprint_feels_the_mean_of_the_road(vehicle):
    road, effects = make_road_feature(HUMP), pack_effect_values({"enveloping_length": 0.2})
    for station in (18.2, 18.9, 20.0, 21.3):
        at = np.linspace(station - 0.1, station + 0.1, 2001)
        heights = np.array([compute_road_height(s, road) for s in at])
        height, slope = average_over_footprint(station, road, effects)
        assert height == pytest.approx(np.trapezoid(heights, at) / 0.2, abs=2e-5)
        assert slope == pytest.approx((heights[-1] - heights[0]) / 0.2, rel=1e-9)


def test_a_tread_gives_every_surface_one_slope_at_no_slip_and_leaves_the_peak_where_it_is(vehicle):
    effects, plain = pack_effect_values({"tread_stiffness": 18.0}), pack_effect_values({})
    for surface in (("dry", 0.82), ("rain", 0.4), ("snow", 0.24)):
        tyre = compute_surface_response(vehicle, *surface).tyre

        def friction(slip, effects=effects, tyre=tyre):
            return compute_effective_friction(slip, 4e3, 0.0, tyre, effects)

        def slope(slip, effects=effects, tyre=tyre):
            return compute_effective_slope(slip, 4e3, 0.0, tyre, effects)

        peak = tyre.target_slip
        assert slope(0.0) == pytest.approx(18.0)
        assert friction(peak * (1 - 1e-9)) == pytest.approx(tyre.peak)
        assert slope(peak * (1 - 1e-9)) == pytest.approx(0.0, abs=1e-6)
        assert friction(2 * peak) == friction(2 * peak, plain)
        # the curve at half the slip of the peak
        steepness = 18.0 * peak / tyre.peak
        assert friction(peak / 2) == pytest.approx(tyre.peak * steepness / (0.5 + steepness), rel=1e-12)
        for slip in (0.1 * peak, 0.7 * peak):
            rise = (friction(slip + 1e-7) - friction(slip - 1e-7)) / 2e-7
            assert slope(slip) == pytest.approx(rise, rel=1e-5)


@pytest.mark.parametrize("station", [18.5, 19.0, 20.6, 21.4])
def test_a_wheel_with_a_radius_feels_the_height_of_a_disc_that_rolls_over_the_road(station):
    road, radius = make_road_feature(HUMP), 0.3
    height, slope = find_contact(station, road, pack_effect_values({"contact_radius": radius}))
    reach = np.linspace(-0.99 * radius, 0.99 * radius, 20001)
    disc = np.array([compute_road_height(station + u, road) for u in reach]) + np.sqrt(radius**2 - reach**2)
    assert abs(disc.max() - radius - compute_road_height(station, road)) > 5e-5
    assert height == pytest.approx(disc.max() - radius, abs=2e-5)
    at = station + reach[np.argmax(disc)]
    assert slope == pytest.approx(
        (compute_road_height(at + 1e-5, road) - compute_road_height(at - 1e-5, road)) / 2e-5, abs=2e-3
    )


def test_a_tilted_tyre_force_loads_a_braked_wheel_that_climbs_and_leaves_the_vertical_force_on_the_axle(
    coupled,
):
    brake, place = command(1.5), {"speed_km_h": 40, "hazard": HUMP, "duration": 3.5}
    plain, tilted = (coupled(brake=brake, effects=e, **place).columns for e in ({}, {"force_tilt": 1.0}))
    front = (tilted["station"] > 18.3) & (tilted["station"] < 21.7) & (tilted["tyre_force_f"] > 1e3)
    assert front.sum() > 100
    pulled = (tilted["tyre_load_f"] - tilted["axle_load_f"])[front] / tilted["tyre_force_f"][front]
    at = np.array(
        [
            find_contact(s, make_road_feature(HUMP), pack_effect_values({}))[1]
            for s in tilted["station"][front]
        ]
    )
    np.testing.assert_allclose(pulled, at, atol=1e-9)
    assert np.all(plain["axle_load_f"] == plain["tyre_load_f"])
    climbing = np.argmax(at)
    assert (tilted["tyre_load_f"] - plain["tyre_load_f"])[front][climbing] > 50


def test_with_a_slope_moment_the_whole_ground_force_turns_the_wheels(vehicle, coupled):
    car = coupled(speed_km_h=40, hazard=HUMP, duration=2.8, effects={"slope_moment": 1.0}).columns
    ground = car["tyre_force_f"] + car["tyre_force_r"] - car["road_force"]
    turned = vehicle.wheel_inertia_f * (car["wheel_speed_f"] + car["wheel_speed_r"])
    rate = np.gradient(turned, 1e-3)
    moment = vehicle.wheel_radius * ground - car["brake_torque_f"] - car["brake_torque_r"]
    climbing = (car["station"] > 18.3) & (car["station"] < 20) & (car["abs_scale_f"] == 1)
    assert climbing.sum() > 50
    np.testing.assert_allclose(moment[climbing], rate[climbing], atol=2.0)
    assert np.abs(car["road_force"][climbing]).max() * vehicle.wheel_radius > 100


def test_anti_dive_and_anti_lift_take_their_share_of_the_load_from_the_springs(vehicle, coupled):
    plain, anti = (
        coupled(brake=command(1.5), duration=3.9, effects=effects).columns
        for effects in ({}, {"anti_dive": 0.4, "anti_lift": 0.4})
    )
    # half of the load transfer at either axle, 0.4 of the brake force of both: the springs lose a fifth
    spring, tyre = 1 / vehicle.suspension_stiffness_f, 1 / vehicle.tyre_stiffness_f
    expected = 1 - 0.2 * spring / (spring + tyre)
    assert anti["pitch"][-1] / plain["pitch"][-1] == pytest.approx(expected, rel=0.01)
    assert anti["axle_load_f"][-1] == pytest.approx(plain["axle_load_f"][-1], rel=2e-3)


def test_the_friction_circle_leaves_all_grip_free_and_none_at_the_peak():
    assert [compute_lateral_reserve(f, 0.8) for f in (0.0, 0.48, 0.8, 0.9)] == pytest.approx(
        [1.0, 0.8, 0.0, 0.0]
    )
    assert compute_lateral_reserve(0.4, 0.8) == pytest.approx(sqrt(0.75))
