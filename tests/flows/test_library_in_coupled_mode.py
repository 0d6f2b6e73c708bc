"""Every effect of the library and every kind of form: found, written as a vehicle, driven in coupled mode.

The closure's rollout is another implementation of the same equations (midpoint rule, wheels linearly implicit).
What an effect changes must be the same in both, on five manoeuvres: to 10 % of the change, and to the floors below.
"""

from dataclasses import replace

import numpy as np
import pytest
import yaml

from catalogs.effects import LIBRARY_FILE, load_effects
from catalogs.surfaces import load_surface
from catalogs.vehicles import load_vehicle, vehicle_provenance
from flows.measured.grown_vehicle import grown_vehicle
from tasks.campaign.campaign import Run
from tasks.identification.decision.excitation import reached
from tasks.identification.decision.forms import PORT_STEP, RANGE, form_in_range
from tasks.identification.inference.forward import roll, run_model
from tasks.surface.road_profile import RoadHazard
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand, brake_pressure
from tasks.vehicle.effects.forms import Form
from tasks.vehicle.effects.library import parameter_vector
from tasks.vehicle.effects.ports import PORTS, VARIABLES
from tasks.vehicle.rollout import Controls, rollout
from tests.flows.findings import found_effect, found_form, grown_file, verdict_of

VEHICLE, SURFACE = load_vehicle("paper-reference"), load_surface("dense-asphalt")
TIME = np.arange(300) * 0.01
MANOEUVRES = {
    "dry": (Weather(kind="dry"), 25.0, 1.6, 0.0),
    "rain, ABS": (Weather(kind="rain", precipitation_mm_h=25.0), 22.0, 2.3, 0.0),
    "snow": (Weather(kind="snow", precipitation_mm_h=1.0, snow_accumulation_h=1.0), 15.0, 0.9, 0.0),
    "hump": (Weather(kind="dry"), 12.0, 0.8, 0.075),
    "slow": (Weather(kind="dry"), 4.5, 0.0, 0.0),
}
"""Weather, first speed [m/s], peak pressure [MPa] and height of a hump [m]."""
FLOOR = np.array([0.002, 0.01, 0.01, 0.015])
"""Of speed, wheel speeds times radius [m/s] and pitch [deg]: none above the noise of a measured campaign."""
SHARE = 0.1
TRUTHS = yaml.safe_load(LIBRARY_FILE.with_name("truths.yaml").read_text())["library"]
LIBRARY = [e for e in load_effects() if e.effect_class != "sensor"]
OF_THE_ROAD = {"retuned_grade"}
"""A grade belongs to the proving ground and not to the vehicle."""
OWN_PITCH = {"longitudinal_force", "wheel", "parameter"}
"""Where the closure's pitch follows the deceleration by rule, and coupled mode's the forces at the ground: a force at
the centre of gravity pitches nothing, and turning wheels take a share of the brake's moment."""
ON_THE_WHEELS = {"rolling_resistance", "rolling_resistance_speed"}
"""A force on the body there, a moment on the wheels here, which ABS takes off the brake's."""


def drive(manoeuvre, car, theta, slots=()):
    """Speed, wheel speeds times radius and pitch of coupled mode and of the closure's model, shape (300, 4) each."""
    weather, speed, peak, height = MANOEUVRES[manoeuvre]
    brake = BrakeCommand(
        peak_pressure_mpa=peak, ramp_s=0.4, onset_s=0.5, onset_station_m=None, hold_s=1.0, release_s=0.4
    )
    response = np.zeros((300, 7))
    response[:, 0] = speed
    run = Run(
        name=manoeuvre, held_out=False, weather=weather.kind, precipitation_mm_h=weather.precipitation_mm_h,
        snow_accumulation_h=weather.snow_accumulation_h, direction=1, disc_rise=0.0, hazard_center=12.0,
        hazard_length=3.7, hazard_height=height, interval=0.01,
        pressure=np.array([brake_pressure(t - 0.5, brake.profile) for t in TIME]), response=response,
    )  # fmt: skip
    model = run_model(run, VEHICLE, SURFACE)
    there = roll(model, theta, slots=slots, substeps=40)[0]
    here = rollout(
        car, surface_state(weather, SURFACE),
        Controls(initial_speed=speed, brake=brake, hold_speed_until_brake=False),
        RoadHazard(center_m=12.0, length_m=3.7, height_m=height), mode="coupled", duration_s=3.0,
    ).columns  # fmt: skip
    names, scale = (
        ("speed", "wheel_speed_f", "wheel_speed_r", "pitch"),
        (1.0, VEHICLE.wheel_radius, VEHICLE.wheel_radius, np.degrees(1.0)),
    )
    coupled = np.column_stack([here[name][:3000:10] for name in names]) * scale
    return coupled, there[:, [0, 2, 3, 4]] * scale, model


PLAIN = parameter_vector({})


@pytest.fixture(scope="module")
def plain():
    return {name: drive(name, VEHICLE, PLAIN)[:2] for name in MANOEUVRES}


def changes(plain, manoeuvre, car, theta, slots=()):
    """RMS of what the closure's model changes, and of what coupled mode changes beyond it, shape (4,) each."""
    coupled, closure, _ = drive(manoeuvre, car, theta, slots)
    here, there = coupled - plain[manoeuvre][0], closure - plain[manoeuvre][1]
    return tuple(np.sqrt(np.mean(np.square(change), axis=0)) for change in (there, here - there))


def sizes(effect):
    """Where there is no size of a truth, three steps of the first parameter, and the second where it starts."""
    values = {p.name: p.start for p in effect.parameters}
    return values | TRUTHS.get(effect.name, {effect.parameters[0].name: 3.0 * effect.parameters[0].step})


def test_the_plain_models_agree(plain):
    for coupled, closure in plain.values():
        rms = np.sqrt(np.mean(np.square(coupled - closure), axis=0))
        assert np.all(rms < (0.001, 0.01, 0.01, 0.05)), rms


@pytest.mark.parametrize("effect", [e for e in LIBRARY if e.name not in OF_THE_ROAD], ids=lambda e: e.name)
def test_every_effect_of_the_library_does_in_coupled_mode_what_it_does_to_the_closures_model(
    effect, plain, tmp_path
):
    values = sizes(effect)
    car = load_vehicle(grown_file(tmp_path / "grown.yaml", found_effect(effect, values), reached={}))
    seen = []
    for manoeuvre in MANOEUVRES:
        size, miss = changes(plain, manoeuvre, car, parameter_vector(values))
        seen.append(size / FLOOR)
        channels = slice(3) if effect.port in OWN_PITCH else slice(4)
        if effect.name in ON_THE_WHEELS and "ABS" in manoeuvre:
            continue
        allowed = np.maximum(SHARE * size, FLOOR)[channels]
        assert np.all(miss[channels] <= allowed), f"{manoeuvre}: {miss[channels]} against {allowed}"
    assert np.max(seen) > 0.5, "no manoeuvre shows it"


def test_a_grade_belongs_to_the_road():
    (grade,) = (e for e in LIBRARY if e.name in OF_THE_ROAD)
    found = verdict_of(found_effect(grade, {"slope": 0.01}))
    assert grown_vehicle("paper-reference", found, {}) == (None, ["retuned_grade: slope"])


@pytest.mark.parametrize("port", PORTS)
def test_a_form_at_any_port_over_any_variable_does_what_it_does_to_the_closures_model(port, plain):
    for variable in VARIABLES:
        low, high = {**RANGE, "time": (0.0, 3.0)}[variable]
        form = Form(
            port=port, variable=variable, shape="a x", coefficients=(5.0 * PORT_STEP[port],),
            scale=0.5 * max(-low, high), low=low, high=high,
        )  # fmt: skip
        car = replace(VEHICLE, forms=(form,))
        for manoeuvre in ("dry", "hump"):
            size, miss = changes(plain, manoeuvre, car, PLAIN, (form.slot,))
            channels = slice(3) if port in OWN_PITCH else slice(4)
            allowed = np.maximum(SHARE * size, FLOOR)[channels]
            assert np.all(miss[channels] <= allowed), f"{variable}, {manoeuvre}: {miss} against {allowed}"


def test_a_form_that_was_found_is_in_the_vehicle_with_its_range_and_where_it_comes_from(plain, tmp_path):
    found = found_form("brake_torque", "pressure", "a + b x", 3.6, 0.05, 0.2)
    _, _, model = drive("dry", VEHICLE, PLAIN)
    low, high = reached([model], PLAIN, (), "pressure")
    assert low == 0.0 and high == pytest.approx(1.6)
    path = grown_file(tmp_path / "grown.yaml", found, reached={"pressure": (low, high)})
    (form,) = load_vehicle(path).forms
    assert form == form_in_range(found.name, (0.05, 0.2), low, high) and form.name == found.name
    provenance = vehicle_provenance(path)
    assert provenance is not None and f"{found.name}: b" in provenance.bounds
    assert "95 % interval 0.18 to 0.22" in " ".join(path.read_text().split())
    size, miss = changes(plain, "dry", load_vehicle(path), PLAIN, (form.slot,))
    assert size[0] > 0.1 and miss[0] < 0.01 * size[0]


def test_the_range_that_runs_reach_is_that_of_the_model():
    models = [drive(name, VEHICLE, PLAIN)[2] for name in ("dry", "hump")]
    ranges = {variable: reached(models, PLAIN, (), variable) for variable in VARIABLES}
    assert ranges["speed"][1] == pytest.approx(25.0) and ranges["time"] == (0.0, 2.99)
    assert ranges["pressure_rate"] == pytest.approx((-4.0, 4.0))
    assert 0.1 < ranges["load_ratio"][0] < 0.9 and 1.2 < ranges["load_ratio"][1] < 2.0
    assert ranges["suspension_travel"][0] < -0.01 and ranges["suspension_speed"][1] > 0.1
    assert ranges["disc_temperature"][0] == 0.0 and ranges["disc_temperature"][1] > 10.0
    assert 3.6 < ranges["deceleration"][1] < 3.8
