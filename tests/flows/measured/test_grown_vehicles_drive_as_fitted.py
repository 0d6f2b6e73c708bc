"""Every effect of the library and every kind of form: found, written as a vehicle, driven in a dataset.

A fit and a dataset simulate one model, so a grown vehicle drives as it was fitted, to rounding, on five manoeuvres.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import yaml

from catalogs.entries import load
from catalogs.vehicles import open_vehicle
from flows.measured.grown_vehicle import grown_vehicle
from studies.closing_benchmark.truths import load_truths
from tasks.campaign.campaign import Run
from tasks.identification.decision.excitation import find_reached_range
from tasks.identification.decision.forms import PORT_STEP, RANGE, make_form_in_range
from tasks.identification.inference.forward import prepare_run, simulate_run
from tasks.surface.road_profile import RoadHazard
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand, compute_brake_pressure
from tasks.vehicle.effects.forms import Form
from tasks.vehicle.effects.ports import PORTS, VARIABLES
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.rollout import Controls, simulate_scenario
from tests.flows.measured.findings import found_effect, found_form, grown_file, verdict_of

VEHICLE, SURFACE = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
TIME = np.arange(300) * 0.01
MANOEUVRES = {
    "dry": (Weather(kind="dry"), 25.0, 1.6, 0.0),
    "rain, ABS": (Weather(kind="rain", precipitation_mm_h=25.0), 22.0, 2.3, 0.0),
    "snow": (Weather(kind="snow", precipitation_mm_h=1.0, snow_accumulation_h=1.0), 15.0, 0.9, 0.0),
    "hump": (Weather(kind="dry"), 12.0, 0.8, 0.075),
    "slow": (Weather(kind="dry"), 4.5, 0.0, 0.0),
}
"""Weather, first speed [m/s], peak pressure [MPa] and height of a hump [m]."""
TRUTHS = {truth.name: truth.values for truth in load_truths() if truth.in_library}
LIBRARY = [e for e in load("library of effects") if e.effect_class != "sensor"]
OF_THE_ROAD = {"retuned_grade"}
"""A grade belongs to the proving ground and not to the vehicle."""
CHANNELS = ("speed", "wheel_speed_f", "wheel_speed_r", "pitch")
NOISE = np.array([0.002, 0.03, 0.03, 0.0002])
"""Readings of a measured campaign, of `CHANNELS` [m/s, rad/s, rad/s, rad]."""
ROUNDING = 1e-9


def fitted_run(manoeuvre, theta, slots=(), vehicle=VEHICLE):
    """The fit's run of a manoeuvre, as a model and as a simulation at the datasets' step."""
    weather, speed, peak, height = MANOEUVRES[manoeuvre]
    response = np.zeros((300, 7))
    response[:, 0] = speed
    run = Run(
        name=manoeuvre, held_out=False, weather=weather.kind, precipitation_mm_h=weather.precipitation_mm_h,
        snow_accumulation_h=weather.snow_accumulation_h, direction=1, disc_rise=0.0, hazard_center=12.0,
        hazard_length=3.7, hazard_height=height, interval=0.01,
        pressure=np.array([compute_brake_pressure(t - 0.5, brake_of(peak).profile) for t in TIME]), response=response,
    )  # fmt: skip
    model = prepare_run(run, vehicle, SURFACE)
    return model, simulate_run(model, theta, slots=slots, refinement=4)


def brake_of(peak):
    return BrakeCommand(
        peak_pressure_mpa=peak, ramp_s=0.4, onset_s=0.5, onset_station_m=None, hold_s=1.0, release_s=0.4
    )


def difference(manoeuvre, car, fitted):
    """Largest difference between a dataset's run of a car and the channels of the fit's run, by channel."""
    weather, speed, peak, height = MANOEUVRES[manoeuvre]
    state = surface_state(weather, SURFACE)
    made = simulate_scenario(
        car, state,
        Controls(initial_speed=speed, brake=brake_of(peak), hold_speed_until_brake=False),
        RoadHazard(center_m=12.0, length_m=3.7, height_m=height), mode="coupled", duration_s=3.0,
    ).columns  # fmt: skip
    driven = np.array([made[name][:3000:10] for name in CHANNELS])
    return np.abs(driven - fitted).max(axis=1)


PLAIN = build_parameter_vector({})


def sizes(effect):
    """Where there is no size of a truth, three steps of the first parameter, and the second where it starts."""
    values = {p.name: p.start for p in effect.parameters}
    return values | TRUTHS.get(effect.name, {effect.parameters[0].name: 3.0 * effect.parameters[0].step})


def channels_of(manoeuvre, theta, slots=()):
    fitted = fitted_run(manoeuvre, theta, slots)[1]
    return np.array([fitted.column(name) for name in CHANNELS])


@cache
def plain_channels(manoeuvre):
    return channels_of(manoeuvre, PLAIN)


@pytest.mark.parametrize("effect", [e for e in LIBRARY if e.name not in OF_THE_ROAD], ids=lambda e: e.name)
def test_every_effect_of_the_library_drives_in_a_dataset_as_it_was_fitted(effect, tmp_path):
    values = sizes(effect)
    car = load("vehicle", grown_file(tmp_path / "grown.yaml", found_effect(effect, values), reached={}))
    theta, changes = build_parameter_vector(values), []
    for manoeuvre in MANOEUVRES:
        fitted = channels_of(manoeuvre, theta)
        assert np.all(difference(manoeuvre, car, fitted) < ROUNDING), manoeuvre
        changes.append(np.abs(fitted - plain_channels(manoeuvre)).max(axis=1))
    assert np.max(np.array(changes) / NOISE) > 0.5, "no manoeuvre shows it"


def test_a_friction_of_one_kind_of_weather_has_its_source_in_that_tyre_family_alone(tmp_path):
    (wet,) = (e for e in LIBRARY if e.name == "retuned_wet_friction")
    path = grown_file(tmp_path / "grown.yaml", found_effect(wet, {"wet_friction": -0.2}), reached={})
    families = yaml.safe_load(path.read_text())["families"]
    told = {
        kind: "retuned_wet_friction" in family["efficiency"]["source"] for kind, family in families.items()
    }
    assert told == {kind: kind == "rain" for kind in VEHICLE.families}


def test_a_grade_belongs_to_the_road():
    (grade,) = (e for e in LIBRARY if e.name in OF_THE_ROAD)
    found = verdict_of(found_effect(grade, {"slope": 0.01}))
    assert grown_vehicle(open_vehicle("paper-reference"), found, {}) == (None, ["retuned_grade: slope"])


def test_a_vehicle_that_calibration_grew_grows_further_and_keeps_what_it_had(tmp_path):
    (lag,) = (e for e in LIBRARY if e.name == "brake_lag")
    (rolling,) = (e for e in LIBRARY if e.name == "rolling_resistance")
    base = load("vehicle", "multibody-grown")
    found = verdict_of(
        found_effect(lag, {"lag": 0.08}), found_effect(rolling, {"rolling_coefficient": 0.004})
    )
    text, missing = grown_vehicle(open_vehicle("multibody-grown"), found, {})
    assert text is not None and missing == []
    path = tmp_path / "grown.yaml"
    path.write_text(text)
    car = load("vehicle", path)
    rolls = base.effects["rolling_coefficient"] + 0.004
    assert car.effects == {**base.effects, "lag": 0.08, "rolling_coefficient": rolls}
    kept, before = open_vehicle(path).provenance, open_vehicle("multibody-grown").provenance
    assert kept.bounds["stick_above"] == before.bounds["stick_above"]
    assert difference("hump", car, channels_of("hump", build_parameter_vector({"lag": 0.08})))[0] > 0.01
    model, fitted = fitted_run(
        "hump", build_parameter_vector({"lag": 0.08, "rolling_coefficient": 0.004}), (), base
    )
    again = simulate_run(replace(model, vehicle=car), PLAIN, refinement=4)
    np.testing.assert_allclose(again.history, fitted.history, atol=ROUNDING)


@pytest.mark.parametrize("port", PORTS)
def test_a_form_at_any_port_over_any_variable_drives_in_a_dataset_as_it_was_fitted(port):
    for variable in VARIABLES:
        low, high = {**RANGE, "time": (0.0, 3.0)}[variable]
        form = Form(
            port=port, variable=variable, shape="a x", coefficients=(5.0 * PORT_STEP[port],),
            scale=0.5 * max(-low, high), low=low, high=high,
        )  # fmt: skip
        for manoeuvre in ("dry", "hump"):
            missed = difference(
                manoeuvre, replace(VEHICLE, forms=(form,)), channels_of(manoeuvre, PLAIN, (form.slot,))
            )
            assert np.all(missed < ROUNDING), f"{variable}, {manoeuvre}: {missed}"


def test_a_form_that_was_found_is_in_the_vehicle_with_its_range_and_where_it_comes_from(tmp_path):
    found = found_form("brake_torque", "pressure", "a + b x", 3.6, 0.05, 0.2)
    model, _ = fitted_run("dry", PLAIN)
    low, high = find_reached_range([model], PLAIN, (), "pressure")
    assert low == 0.0 and high == pytest.approx(1.6)
    path = grown_file(tmp_path / "grown.yaml", found, reached={"pressure": (low, high)})
    (form,) = load("vehicle", path).forms
    assert form == make_form_in_range(found.name, (0.05, 0.2), low, high) and form.name == found.name
    provenance = open_vehicle(path).provenance
    assert provenance is not None and f"{found.name}: b" in provenance.bounds
    assert "95 % interval 0.18 to 0.22" in " ".join(path.read_text().split())
    assert np.all(
        difference("dry", load("vehicle", path), channels_of("dry", PLAIN, (form.slot,))) < ROUNDING
    )


def test_the_range_that_runs_reach_is_that_of_the_model():
    models = [fitted_run(name, PLAIN)[0] for name in ("dry", "hump")]
    ranges = {variable: find_reached_range(models, PLAIN, (), variable) for variable in VARIABLES}
    assert ranges["speed"][1] == pytest.approx(25.0) and ranges["time"] == (0.0, 2.99)
    assert ranges["pressure_rate"] == pytest.approx((-4.0, 4.0))
    assert 0.1 < ranges["load_ratio"][0] < 0.9 and 1.2 < ranges["load_ratio"][1] < 2.0
    assert ranges["suspension_travel"][0] < -0.01 and ranges["suspension_speed"][1] > 0.1
    assert ranges["disc_temperature"][0] == 0.0 and ranges["disc_temperature"][1] > 10.0
    assert 3.6 < ranges["deceleration"][1] < 3.8
