"""Additions of a vehicle to the plain model: nothing where off, its own signature where on, second order."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceState
from tasks.vehicle.effects.forms import SHAPES, Form, count_coefficients
from tasks.vehicle.effects.ports import PORTS, VARIABLES
from tasks.vehicle.effects.table import EFFECT_UNITS
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.rollout import Controls, simulate_scenario
from tasks.vehicle.tyres.contract import compute_tyre_friction
from tests.vehicle.conftest import HUMP, command

STOP = command(1.5, onset=0.5)
WET = ("rain", 0.37)


@pytest.fixture
def coupled(drive, vehicle):
    def run(effects=None, forms=(), surface=("dry", 0.82), **scenario):
        car = replace(vehicle, effects=effects or {}, forms=tuple(forms))
        scenario = {"brake": STOP, "duration": 3.0, "speed_km_h": 72.0} | scenario
        return drive(*surface, mode="coupled", car=car, **scenario).columns

    return run


def form(port, variable, *coefficients, shape="a x", scale=1.0, low=-1e3, high=1e3):
    return Form(
        port=port, variable=variable, shape=shape, coefficients=coefficients, scale=scale, low=low, high=high
    )


def same(one, other):
    return all(np.array_equal(one[name], other[name]) for name in one)


@pytest.mark.parametrize("scenario", [{}, {"surface": WET, "hazard": HUMP}])
def test_numbers_and_forms_of_zero_are_the_plain_model_bit_for_bit(coupled, scenario):
    plain = coupled(**scenario)
    assert same(coupled(dict.fromkeys(EFFECT_UNITS, 0.0), **scenario), plain)
    nothing = [form(port, variable, 0.0) for port in PORTS for variable in VARIABLES]
    assert same(coupled(forms=nothing, **scenario), plain)


def test_snow_and_water_act_only_where_they_lie(vehicle, coupled):
    thing = {"wet_speed": 0.01, "ploughing": 20.0}
    assert same(coupled(thing), coupled())
    assert same(coupled(thing, surface=("snow", 0.42)), coupled(surface=("snow", 0.42)))
    assert coupled(thing, surface=WET)["speed"][-1] > coupled(surface=WET)["speed"][-1] + 0.1
    coast = Controls(initial_speed=15.0, brake=command(0.0, onset=None), hold_speed_until_brake=False)
    deep, bare = (
        simulate_scenario(
            replace(vehicle, effects=thing), SurfaceState(kind="snow", friction=0.42, snow_depth_mm=depth), coast,
            FLAT_ROAD, mode="coupled", duration_s=1.0,
        ).columns["longitudinal_acceleration"][500]
        for depth in (12.0, 0.0)
    )  # fmt: skip
    turning = (vehicle.wheel_inertia_f + vehicle.wheel_inertia_r) / vehicle.wheel_radius**2
    assert (bare - deep) * (vehicle.mass + turning) == pytest.approx(20.0 * 12.0, rel=1e-3)


def test_the_slip_that_builds_up_force_follows_over_the_relaxation_length(vehicle, coupled):
    """d kappa'/dt = v (kappa - kappa') / L (Pacejka 2012), with kappa' read from the curve at the logged force."""
    tyre = compute_surface_response(vehicle, "dry", 0.82).tyre
    columns = coupled({"relaxation_length": 0.8}, brake=command(1.0, onset=0.2, ramp_s=0.4), duration=1.2)
    slips = np.linspace(0.0, tyre.target_slip, 2001)
    curve = np.array([compute_tyre_friction(slip, 4e3, tyre) for slip in slips])
    felt = np.interp(columns["tyre_force_f"] / columns["tyre_load_f"], curve, slips)
    rate = np.gradient(felt, 1e-3)[250:1150]
    expected = (columns["speed"] * (columns["braking_slip_f"] - felt) / 0.8)[250:1150]
    np.testing.assert_allclose(rate, expected, atol=0.02 * np.abs(expected).max())
    assert columns["braking_slip_f"][400] > 1.1 * felt[400]


def test_a_relaxation_length_that_goes_to_zero_is_the_plain_model(coupled):
    plain, short = (coupled(effects, surface=WET) for effects in ({}, {"relaxation_length": 1e-6}))
    np.testing.assert_allclose(short["speed"], plain["speed"], atol=1e-3)


def test_sliding_heats_the_tyre_and_heat_takes_its_grip(vehicle, coupled):
    tyre = compute_surface_response(vehicle, *WET).tyre
    columns = coupled({"tyre_heating": 2.0}, surface=WET)
    slip = columns["braking_slip_f"]
    heat = np.cumsum(np.abs(columns["tyre_force_f"] * slip) * columns["speed"]) * 1e-3
    cold = np.array([compute_tyre_friction(k, 4e3, tyre) for k in slip]) * columns["tyre_load_f"]
    assert heat[2500] > 8e3
    np.testing.assert_allclose(
        columns["tyre_force_f"][:2500], ((1.0 - 2.0 * heat / 1e5) * cold)[:2500], atol=5.0
    )


def test_an_engine_drags_at_the_front_wheels_and_pitches_the_body_as_a_brake_does(vehicle, coupled):
    coast = command(0.0, onset=None)
    engine = coupled({"engine_torque": 100.0}, brake=coast)
    turning = vehicle.wheel_inertia_f + vehicle.wheel_inertia_r
    mass = vehicle.mass + turning / vehicle.wheel_radius**2
    gained = coupled(brake=coast)["longitudinal_acceleration"][-1] - engine["longitudinal_acceleration"][-1]
    assert gained * mass == pytest.approx(100.0 / vehicle.wheel_radius, rel=1e-3)
    rubbing = coupled({"pad_drag": 100.0}, brake=coast)
    assert engine["pitch"][-1] == pytest.approx(rubbing["pitch"][-1], rel=1e-3)
    assert np.all(engine["brake_torque_f"] == 0.0) and engine["tyre_force_r"][-1] < 0.0


def test_a_bias_that_moves_with_pressure_keeps_the_torque_and_ends_at_all_of_it(coupled):
    moved, plain = (coupled(e, brake=command(1.5, onset=0.5)) for e in ({"bias_pressure": 0.1}, {}))
    torque = [c["brake_torque_f"][1900] + c["brake_torque_r"][1900] for c in (moved, plain)]
    assert torque[0] == pytest.approx(torque[1])
    share = moved["brake_torque_f"][1900] / torque[0] - plain["brake_torque_f"][1900] / torque[1]
    assert share == pytest.approx(0.1 * 1.5)
    beyond = coupled({"bias_pressure": 0.9}, brake=command(1.5, onset=0.5))
    assert np.all(beyond["brake_torque_r"] >= 0.0)


def test_lift_raises_the_body_and_takes_load_from_the_tyres(vehicle, coupled):
    coast = command(0.0, onset=None)
    lifted = coupled({"aero_lift": 0.5}, brake=coast)
    load = vehicle.mass * vehicle.gravity - lifted["axle_load_f"][-1] - lifted["axle_load_r"][-1]
    assert load == pytest.approx(0.5 * lifted["speed"][-1] ** 2, rel=0.01)
    assert lifted["heave"][-1] > 0.0
    nosed = coupled({"aero_pitch": 0.5}, brake=coast)
    assert nosed["pitch"][-1] > coupled(brake=coast)["pitch"][-1]


def test_a_form_beyond_its_range_is_held_at_its_end(coupled):
    held = coupled(forms=[form("brake_torque", "speed", 0.5, scale=20.0, low=5.0, high=10.0)])
    constant = coupled(forms=[form("brake_torque", "speed", 0.25, shape="a")])
    np.testing.assert_allclose(held["brake_torque_f"][:900], constant["brake_torque_f"][:900], rtol=1e-12)


def test_forms_add_up(coupled):
    half, whole = (
        form("brake_torque", "speed", 0.1, scale=20.0),
        form("brake_torque", "speed", 0.2, scale=20.0),
    )
    twice, once = coupled(forms=[half, half]), coupled(forms=[whole])
    np.testing.assert_allclose(twice["speed"], once["speed"], rtol=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_table_follows_its_shape(shape):
    coefficients = (0.3, -0.2)[: count_coefficients(shape)]
    made = form("friction", "speed", *coefficients, shape=shape, scale=30.0, low=0.0, high=30.0)
    slot = made.slot
    x = (slot.origin + slot.spacing * np.arange(len(slot.values))) / 30.0
    np.testing.assert_allclose(slot.values, SHAPES[shape](x) @ np.array(coefficients), atol=1e-12)
    assert made.name.startswith(f"friction ~ {shape}, x = speed/30 m/s")


@pytest.mark.parametrize(
    "added",
    [{"effects": {name: value}} for name, value in (
        ("relaxation_length", 0.5), ("relaxation_length", 0.05), ("tyre_heating", 3.0), ("fade", 0.3), ("lag", 0.1),
        ("bias_pressure", 0.05), ("engine_viscous", 2.0), ("aero_pitch", 1.0), ("pad_speed", 0.006),
    )] + [{"forms": [form("brake_torque", "pressure_rate", 0.2, scale=12.0)]},
          {"forms": [form("longitudinal_force", "speed", 300.0, scale=30.0)]}],
    ids=str,
)  # fmt: skip
def test_the_method_keeps_its_second_order(coupled, added):
    slow = command(1.2, onset=0.0, ramp_s=1.0)
    runs = [coupled(brake=slow, duration=1.5, step=1e-3 / 2**k, **added) for k in (0, 1, 5)]
    for name in ("speed", "wheel_speed_f"):
        coarse, fine = (np.abs(run[name] - runs[2][name]).max() for run in runs[:2])
        assert coarse / fine == pytest.approx(4.0, rel=0.15), name


def test_a_form_of_deceleration_reads_it_one_evaluation_late_and_converges_at_first_order(coupled):
    late = [form("longitudinal_force", "deceleration", 500.0, scale=9.0)]
    slow = command(1.2, onset=0.0, ramp_s=1.0)
    runs = [coupled(forms=late, brake=slow, duration=1.5, step=1e-3 / 2**k)["speed"] for k in (0, 1, 6)]
    coarse, fine = (np.abs(run - runs[2]).max() for run in runs[:2])
    assert 1.8 < coarse / fine < 2.3 and fine < 1e-4
