"""The one model: a command and its trace drive alike, a run goes on from a stored state, halving the step is small."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.errors import InputError
from tasks.surface.road_profile import RoadGrade, RoadHazard
from tasks.vehicle.brake import compute_brake_pressure
from tasks.vehicle.effects.grown import apply_effects
from tasks.vehicle.effects.ports import AXLE_VARIABLES, VARIABLES
from tasks.vehicle.effects.slots import Slot, pack_slots
from tasks.vehicle.effects.table import EFFECT_TABLE, EFFECT_UNITS, PARAMETERS
from tasks.vehicle.model.axle_ports import collect_form_variables
from tasks.vehicle.model.brake_input import make_command_input, make_trace_input
from tasks.vehicle.model.chassis import Conditions
from tasks.vehicle.model.simulation import Recording, simulate
from tasks.vehicle.model.states import STATE_WIDTH, AxleMemory, Instant, pack_state, unpack_state
from tasks.vehicle.model.vertical_ports import Strut
from tasks.vehicle.parameters import compute_surface_response
from tests.vehicle.conftest import command

HUMP = Conditions(hazard=RoadHazard(center_m=12.0, length_m=3.7, height_m=0.075), disc_rise=80.0)
STOP = command(1.6, onset=0.5, ramp_s=0.4, hold_s=1.0, release_s=0.4).profile
EFFECTS = {"lag": 0.08, "dead_time": 0.03, "relaxation_length": 0.4, "fade": 0.05, "tyre_heating": 0.4}


@pytest.fixture
def run(vehicle):
    def simulated(
        drive=None, *, samples=300, effects=None, conditions=HUMP, substeps=5, keep_states=False, **options
    ):
        return simulate(
            replace(vehicle, effects=effects or {}), compute_surface_response(vehicle, "rain", 0.5),
            drive or make_command_input(STOP), conditions,
            Recording(samples=samples, interval=0.01, substeps=substeps, keep_states=keep_states),
            initial_speed=18.0, **options,
        )  # fmt: skip

    return simulated


def test_a_command_and_its_pressure_at_the_samples_drive_alike(run):
    trace = np.array([compute_brake_pressure(0.01 * n - 0.5, STOP) for n in range(300)])
    for effects in ({}, EFFECTS):
        commanded, measured = run(effects=effects), run(make_trace_input(trace, 0.01), effects=effects)
        np.testing.assert_allclose(measured.history, commanded.history, rtol=1e-9, atol=1e-9)


def test_a_stop_far_beyond_the_grip_under_noisy_pressure_hangs_neither_on_the_step_nor_on_rounding():
    """The anti-lock band of this car is 2 % of slip wide; within 2 ms its brakes swing the wheel by more."""
    car, noise = load("vehicle", "bmw-m8"), np.random.default_rng(3).normal(size=170)
    pressure = np.clip((np.arange(170) - 10) / 90, 0, 1) * 12 * (1 + 0.1 * noise)

    def wheel_speed(substeps: int, friction: float = 0.82):
        stop = simulate(
            car, compute_surface_response(car, "dry", friction), make_trace_input(pressure, 0.01), Conditions(),
            Recording(samples=170, interval=0.01, substeps=substeps), initial_speed=19.0,
        )  # fmt: skip
        return stop.column("wheel_speed_f")[stop.column("speed") > 2]

    found = wheel_speed(5)
    assert np.abs(found - wheel_speed(80)).max() < 0.2
    assert np.abs(found - wheel_speed(5, 0.82 * (1 + 1e-12))).max() < 1e-9


@pytest.mark.parametrize(("axle", "sign"), [("f", -1.0), ("r", 1.0)])
def test_a_struts_travel_is_the_body_over_the_wheel_and_its_rate_is_that_of_the_travel(
    run, vehicle, axle, sign
):
    ride = run()
    arm = vehicle.cg_to_front_axle if axle == "f" else vehicle.cg_to_rear_axle
    travel, rate = (ride.column(f"suspension_{name}_{axle}") for name in ("travel", "rate"))
    body = ride.column("heave") + sign * arm * ride.column("pitch")
    np.testing.assert_allclose(travel, body - ride.column(f"unsprung_heave_{axle}"), atol=1e-12)
    between = 0.5 * (rate[1:] + rate[:-1])
    np.testing.assert_allclose(np.diff(travel) / 0.01, between, atol=0.02 * np.abs(rate).max())


@pytest.mark.parametrize("effects", [{}, EFFECTS], ids=["plain", "states of effects"])
def test_a_run_goes_on_from_a_stored_state_bit_by_bit(run, effects):
    whole = run(effects=effects, keep_states=True)
    assert whole.states.shape == (300, STATE_WIDTH)
    rest = run(effects=effects, samples=170, start=whole.states[130])
    np.testing.assert_array_equal(rest.history, whole.history[130:])
    assert (rest.onset, rest.onset_station, rest.stop) == (whole.onset, whole.onset_station, whole.stop)


def test_a_state_is_its_row(run):
    row = run(effects=EFFECTS, keep_states=True).states[200]
    assert pack_state(unpack_state(row)) == tuple(row)


def test_a_branch_differs_from_where_something_else_acts(run):
    whole = run(keep_states=True)
    pulse = Slot(
        port="longitudinal_force",
        variable="time",
        origin=1.5,
        spacing=0.2,
        values=np.array([0.0, 500.0, 0.0]),
    )
    branch = run(samples=150, start=whole.states[150], slots=(pulse,))
    np.testing.assert_array_equal(branch.history, run(slots=(pulse,)).history[150:])
    assert branch.column("speed")[-1] < whole.column("speed")[-1] - 0.05


@pytest.mark.parametrize(
    ("variable", "origin", "spacing"), [("load_ratio", 0.98, 0.01), ("suspension_travel", 0.0, 0.001)]
)
def test_a_form_of_an_axles_own_variable_acts_on_that_axle_alone(run, variable, origin, spacing):
    """While a car brakes, its rear axle is light and its rear springs are long: the form acts there."""
    values = np.array([0.1, 0.0] if variable == "load_ratio" else [0.0, 0.1])
    form = Slot(port="brake_torque", variable=variable, origin=origin, spacing=spacing, values=values)
    plain, changed = run(conditions=Conditions()), run(conditions=Conditions(), slots=(form,))
    free = (plain.column("abs_scale_f") == 1.0) & (changed.column("abs_scale_r") == 1.0)
    braking = free & (plain.column("brake_pressure_mpa") > 1.0)
    assert np.count_nonzero(braking) > 20
    for axle, more in (("f", 1.0), ("r", 1.1)):
        torque = f"brake_torque_{axle}"
        np.testing.assert_allclose(
            changed.column(torque)[braking], more * plain.column(torque)[braking], rtol=1e-3
        )


def test_what_two_axles_can_differ_in_is_what_a_table_says():
    instant = Instant(1.0, 2.0, 3.0, 4.0, False, False, 0.0, 0.0)
    front = collect_form_variables(20.0, 1.2, Strut(0.01, 0.2, 0.0), AxleMemory(0.0, 0.0, 50.0), instant)
    rear = collect_form_variables(20.0, 0.8, Strut(0.02, 0.3, 0.0), AxleMemory(0.0, 0.0, 30.0), instant)
    differ = [name for name, a, b in zip(VARIABLES, front, rear, strict=True) if a != b]
    assert differ == list(AXLE_VARIABLES)
    flat = [Slot(port="friction", variable=v, origin=0.0, spacing=1.0, values=np.zeros(2)) for v in VARIABLES]
    assert [slot.variable for slot in flat if pack_slots([slot]).by_axle] == differ
    assert pack_slots(flat).by_axle


def test_a_grade_takes_its_share_of_gravity_and_pitches_the_body_as_braking_does(vehicle, run):
    coast = make_trace_input(np.zeros(300), 0.01)
    up, flat, down = (
        run(coast, conditions=Conditions(grade=RoadGrade(rise=(0.03,)), direction=d)) for d in (1, 0, -1)
    )
    turning = (vehicle.wheel_inertia_f + vehicle.wheel_inertia_r) / vehicle.wheel_radius**2
    share = vehicle.mass / (vehicle.mass + turning)
    for hill, sign in ((up, 1.0), (down, -1.0)):
        lost = flat.column("longitudinal_acceleration")[250] - hill.column("longitudinal_acceleration")[250]
        assert lost == pytest.approx(sign * 0.03 * vehicle.gravity * share, rel=1e-3)
    # the tyres feel only the inertia of the wheels, so the body all but rests on the hill
    assert abs(up.column("pitch")[250] - flat.column("pitch")[250]) < np.radians(0.02)


def test_a_car_that_stands_on_a_grade_rests_on_its_lower_axle(vehicle, run):
    """Statics: the weight along the grade, m g i, acts at the height of the centre of gravity on the wheelbase."""
    brake = make_trace_input(np.full(800, 2.0), 0.01)
    up, flat, down = (
        run(brake, samples=800, conditions=Conditions(grade=RoadGrade(rise=(0.1,)), direction=d))
        for d in (1, 0, -1)
    )
    weight = 0.1 * vehicle.mass * vehicle.gravity
    for hill, sign in ((up, 1.0), (down, -1.0)):
        lost = flat.column("axle_load_f")[-1] - hill.column("axle_load_f")[-1]
        assert lost == pytest.approx(sign * weight * vehicle.cg_height / vehicle.wheelbase, rel=2e-3)
        assert hill.column("tyre_force_f")[-1] + hill.column("tyre_force_r")[-1] == pytest.approx(
            -sign * weight
        )
    assert up.column("pitch")[-1] < flat.column("pitch")[-1] - np.radians(0.3)


def test_a_measured_engine_torque_acts_through_the_wheels(vehicle, run):
    """A held torque decelerates the whole inertia; on ice it cannot take more than the tyres pass on."""
    none, torque = np.zeros(300), np.full(300, -600.0)
    coast, dragged = run(make_trace_input(none, 0.01)), run(make_trace_input(none, 0.01, torque))
    turning = (vehicle.wheel_inertia_f + vehicle.wheel_inertia_r) / vehicle.wheel_radius**2
    lost = coast.column("longitudinal_acceleration")[250] - dragged.column("longitudinal_acceleration")[250]
    assert lost == pytest.approx(600.0 / vehicle.wheel_radius / (vehicle.mass + turning), rel=5e-3)
    assert dragged.column("wheel_speed_f")[250] < dragged.column("speed")[250] / vehicle.wheel_radius
    hard = make_trace_input(none, 0.01, np.full(300, -40000.0))
    assert -run(hard).column("longitudinal_acceleration").min() < 1.05 * 0.5 * vehicle.gravity


def test_inference_may_take_steps_of_2_ms(run):
    """The longest step that stays below the noise of a campaign: 0.03 m/s, 0.015 deg."""
    coarse, fine = run(substeps=5), run(substeps=40)
    assert np.abs(coarse.column("speed") - fine.column("speed")).max() < 0.003
    assert np.abs(np.degrees(coarse.column("pitch") - fine.column("pitch"))).max() < 0.005


class TestEffectsOfAVehicle:
    def test_each_kind_acts_on_its_fields(self, vehicle):
        grown = apply_effects(
            replace(vehicle, effects={"lag": 0.02}),
            {"lag": 0.03, "mass": 0.1, "wheel_inertia": 1.5, "friction": -0.2, "drag_area": 0.7},
        )
        assert grown.effects == {"lag": 0.05, "drag_area": 0.7}
        assert grown.sprung_mass == vehicle.sprung_mass * 1.1
        assert grown.wheel_inertia_f == vehicle.wheel_inertia_f + 1.5
        for kind in ("dry", "snow", "ice"):
            peaks = [compute_surface_response(car, kind, 0.2).tyre.peak for car in (grown, vehicle)]
            assert peaks[0] == pytest.approx(0.8 * peaks[1])

    @pytest.mark.parametrize(("name", "of"), [("wet_friction", "rain"), ("snow_friction", "snow")])
    def test_the_friction_of_one_kind_of_weather_leaves_the_others(self, vehicle, name, of):
        grown = apply_effects(vehicle, {name: -0.2})
        for kind in ("dry", "rain", "snow", "ice"):
            peaks = [compute_surface_response(car, kind, 0.2).tyre.peak for car in (grown, vehicle)]
            assert peaks[0] == pytest.approx((0.8 if kind == of else 1.0) * peaks[1]), kind

    def test_a_grade_and_an_instrument_are_no_part_of_it(self, vehicle):
        with pytest.raises(InputError, match="speed_scale: no vehicle carries it"):
            apply_effects(vehicle, {"slope": 0.01, "speed_scale": 0.02})


class TestTheTableOfEffects:
    def test_names_are_unique_and_bounds_leave_room_for_a_step(self):
        assert len(PARAMETERS) == len(EFFECT_TABLE)
        for row in EFFECT_TABLE:
            assert row.lower <= row.start <= row.upper and 0.0 < row.step < row.upper - row.lower, row.name

    def test_fields_exist(self, vehicle):
        family = next(iter(vehicle.families.values()))
        for row in EFFECT_TABLE:
            for field in row.fields:
                owner = family if field.startswith("families.") else vehicle
                assert row.kind == "added" or hasattr(owner, field.split(".")[-1]), row.name

    def test_fade_is_per_100_kelvin(self):
        assert EFFECT_UNITS["fade"] == "(100 K)-1"
