"""A vehicle as an FMU: another simulator that loads it drives as muSync's own rollout does."""

import ctypes
import re
import shlex
import shutil
import zipfile

import numpy as np
import pytest

from catalogs.entries import entry_names, load
from flows.exporting.fmu import write_fmu
from manifests.provenance import SOURCE_ROOT
from tasks.errors import InputError
from tasks.surface.road_profile import FLAT_ROAD, RoadHazard, road_elevation, road_slope
from tasks.surface.state import SurfaceState
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand, compute_brake_pressure
from tasks.vehicle.model.brake_input import make_trace_input
from tasks.vehicle.model.chassis import Conditions
from tasks.vehicle.model.embedded_variables import INPUTS, OUTPUTS
from tasks.vehicle.model.simulation import COLUMNS, INTERNAL_STEP_S, Recording, simulate
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.rollout import Controls, simulate_scenario
from tests.flows.exporting.fmu_car import Car
from tests.flows.shell import run_command

fmpy = pytest.importorskip("fmpy", reason="FMPy, which loads FMUs, is not installed: pip install fmpy")
from fmpy.validation import validate_fmu  # noqa: E402

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
CAR = """\
extends: multibody-grown
effects:
  dead_time: {value: 0.0337, unit: s, source: test}
  lag: {value: 0.06, unit: s, source: test}
"""
"""A vehicle file: one that was fitted, with a brake line."""
PAGE = (SOURCE_ROOT / "docs" / "how-to" / "drive-the-car-in-another-simulator.md").read_text()
SNOW = {"weather": 3, "road_friction": 0.3, "snow_depth": 12.0}
HUMP = RoadHazard(center_m=5.0, length_m=3.6, height_m=0.08)


@pytest.fixture(scope="module")
def car_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("fmu") / "my-car.yaml"
    path.write_text(CAR)
    return path


@pytest.fixture(scope="module")
def vehicle(car_file):
    return load("vehicle", car_file)


@pytest.fixture(scope="module")
def fmu(car_file):
    """Made by the command of the page."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(car_file.parent)
        command = re.findall(r"^```\nmusync (.*?)\n```$", PAGE, flags=re.M)[0]
        assert run_command(patch, *shlex.split(command)) == 0
    return car_file.with_suffix(".fmu")


@pytest.fixture
def drive(fmu, tmp_path):
    cars = []

    def start(**given: float) -> Car:
        cars.append(Car(fmu, tmp_path / str(len(cars)), **given))
        return cars[-1]

    yield start
    for car in cars:
        car.slave.freeInstance()


def test_fmpy_finds_nothing_wrong_and_each_variable_has_its_unit(fmu):
    assert validate_fmu(str(fmu)) == []
    variables = fmpy.read_model_description(str(fmu)).modelVariables
    assert {v.type for v in variables} == {"Real", "Integer", "Boolean"}, "all that plain importers know"
    units = {v.name: v.unit for v in variables}
    assert [*units] == [row.name for row in (*INPUTS, *OUTPUTS)] and len({*units}) == len(variables)
    assert (units["speed"], units["brake_torque_f"], units["snow_depth"]) == ("m/s", "N.m", "mm")
    with zipfile.ZipFile(fmu) as packed:
        kept = packed.read("resources/vehicle.yaml")
        assert {name.split("/")[0] for name in packed.namelist()} == {
            "modelDescription.xml",
            "resources",
            "binaries",
        }
    assert b"dead_time" in kept


@pytest.mark.parametrize("hazard", [FLAT_ROAD, HUMP], ids=["flat", "hump"])
def test_a_stop_on_snow_is_the_own_rollout(drive, vehicle, hazard):
    """The rollout takes its command at both ends of a step, so the FMU is told the pressure at the end of each.

    A row has the inputs of the step that ends there: at the moment when the speed is no longer held it still is.
    """
    command = BrakeCommand(
        peak_pressure_mpa=1.6, ramp_s=0.3, onset_s=0.2, onset_station_m=None, hold_s=None, release_s=0.5
    )
    own = simulate_scenario(
        vehicle, SurfaceState(kind="snow", friction=0.3, snow_depth_mm=12.0),
        Controls(initial_speed=9.0, brake=command, hold_speed_until_brake=True), hazard, mode="coupled", duration_s=1.5,
    )  # fmt: skip
    car = drive(
        initial_speed=9.0, hold_speed=1, road_feature_center=hazard.center_m,
        road_feature_height=hazard.height_m, **SNOW,
    )  # fmt: skip
    rows = [car.read_row()]
    for n in range(3000):
        car.set_inputs(
            brake_pressure=compute_brake_pressure((n + 1) * INTERNAL_STEP_S - 0.2, command.profile),
            hold_speed=int(n < 400),
        )
        car.take_step(INTERNAL_STEP_S)
        if n % 2:
            rows.append(car.read_row())
    assert own.columns["speed"][-1] < 7.0
    compared = np.delete(np.array(rows), 200, axis=0)
    for name, column in zip(COLUMNS, compared.T, strict=True):
        if name in own.columns:
            np.testing.assert_allclose(
                column, np.delete(own.columns[name], 200), rtol=1e-6, atol=1e-6, err_msg=name
            )


def test_a_storm_that_grips_by_speed_is_the_own_rollout(drive, vehicle):
    storm = surface_state(
        Weather(kind="rain", precipitation_mm_h=50.0),
        load("wet friction").apply(load("surface", "dense-asphalt")),
    )
    command = BrakeCommand(
        peak_pressure_mpa=4.0, ramp_s=0.2, onset_s=0.0, onset_station_m=None, hold_s=None, release_s=0.5
    )
    own = simulate_scenario(
        vehicle, storm, Controls(initial_speed=28.0, brake=command, hold_speed_until_brake=False), FLAT_ROAD,
        mode="coupled", duration_s=1.0,
    )  # fmt: skip
    wet = {"weather": 2, "road_friction": storm.friction, "film_depth": storm.film_depth_mm}
    ends = []
    for by_speed in (1, 0):
        car = drive(initial_speed=28.0, wet_friction_by_speed=by_speed, **wet)
        for n in range(2000):
            car.set_inputs(brake_pressure=compute_brake_pressure((n + 1) * INTERNAL_STEP_S, command.profile))
            car.take_step(INTERNAL_STEP_S)
        ends.append(car.read_row()[COLUMNS.index("speed")])
    assert ends[0] == pytest.approx(own.columns["speed"][-1], abs=1e-6) and ends[1] < ends[0] - 0.3


def test_held_inputs_give_the_same_at_any_step_and_equal_a_trace_that_holds_them(drive, vehicle):
    pressures = np.linspace(0.0, 2.0, 60)
    runs = {}
    for length in (0.001, 0.01):
        car = drive(initial_speed=15.0, **SNOW)
        runs[length] = []
        for pressure in pressures:
            car.set_inputs(brake_pressure=pressure)
            for _ in range(round(0.01 / length)):
                car.take_step(length)
            runs[length].append(car.read_row())
    np.testing.assert_array_equal(runs[0.001], runs[0.01])
    trace = np.concatenate([[0.0], np.repeat(pressures, 20)])
    own = simulate(
        vehicle, compute_surface_response(vehicle, "snow", 0.3), make_trace_input(trace, INTERNAL_STEP_S),
        Conditions(snow_depth_mm=12.0), Recording(samples=len(pressures) + 1, interval=0.01, substeps=20),
        initial_speed=15.0,
    )  # fmt: skip
    np.testing.assert_allclose(runs[0.01], own.history[1:], rtol=1e-9, atol=1e-9)


def test_a_road_told_under_the_axles_is_the_road_feature(drive, vehicle):
    """But for what this car's tyres feel beside the point that was told, where the road is taken for straight."""
    known = drive(
        initial_speed=9.0, road_feature_center=3.0, road_feature_length=3.6, road_feature_height=0.08
    )
    rows = []
    for _ in range(900):
        known.take_step(0.001)
        rows.append(known.read_row())
    told, seen = drive(initial_speed=9.0), []
    hazard = RoadHazard(center_m=3.0, length_m=3.6, height_m=0.08)
    for _ in range(900):
        front = told.read_row()[COLUMNS.index("station")]
        for axle, s in (("f", front), ("r", front - vehicle.wheelbase)):
            told.set_inputs(**{
                f"ground_height_{axle}": float(road_elevation(np.array([s]), hazard)[0]),
                f"ground_slope_{axle}": float(road_slope(np.array([s]), hazard)[0]),
            })  # fmt: skip
        told.take_step(0.001)
        seen.append(told.read_row())
    pitch, heave = COLUMNS.index("pitch"), COLUMNS.index("heave")
    for place in (pitch, heave):
        one, other = np.array(rows)[:, place], np.array(seen)[:, place]
        assert np.abs(one).max() > 0.01 and np.abs(one - other).max() < 0.01 * np.abs(one).max()


def test_a_kept_state_is_gone_back_to_and_a_reset_begins_anew(drive):
    car = drive(initial_speed=12.0, brake_pressure=1.0)
    first = car.read_row()
    car.take_step(0.1)
    state, time = car.slave.getFMUState(), car.time
    car.take_step(0.2)
    once = car.read_row()
    bytes_of_it = car.slave.serializeFMUState(state)
    car.slave.setFMUState(car.slave.deserializeFMUState(bytes_of_it))
    car.time = time
    car.take_step(0.2)
    np.testing.assert_array_equal(car.read_row(), once)
    car.slave.reset()
    car.begin_drive(initial_speed=12.0, brake_pressure=1.0)
    np.testing.assert_array_equal(car.read_row(), first)


@pytest.mark.parametrize(
    ("act", "sentence"),
    [
        (lambda car: car.take_step(0.0013), "the step must be a whole multiple of 0.0005 s; it is 0.0013 s"),
        (
            lambda car: car.slave.doStep(1.0, 0.001),
            "must begin where the last one ended, at 0 s; it begins at 1 s",
        ),
        (
            lambda car: car.set_inputs(road_friction=0.0),
            "road_friction must be a number within 0.01 to 2; it is 0",
        ),
        (
            lambda car: car.set_inputs(initial_speed=30.0),
            "initial_speed is a parameter: it is set before the start",
        ),
    ],
)
def test_what_is_wrong_is_an_error_with_a_sentence_and_the_drive_goes_on(drive, act, sentence):
    car = drive()
    with pytest.raises(Exception, match="status 3"):
        act(car)
    assert len(car.said) == 1 and sentence in car.said[0]
    car.take_step(0.001)


def test_a_library_shows_the_standards_functions_alone_so_that_two_cars_can_share_a_process(fmu, tmp_path):
    fmpy.extract(str(fmu), str(tmp_path))
    library = ctypes.CDLL(str(next((tmp_path / "binaries").glob("*/*"))))
    assert library.fmi2DoStep
    for inner in ("musync_advance", "NRT_Allocate"):
        assert not hasattr(library, inner), inner


def test_the_example_of_the_page_stops_on_snow(fmu, monkeypatch, capsys):
    monkeypatch.chdir(fmu.parent)
    (example,) = re.findall(r"^```python\n(import fmpy.*?|from fmpy.*?)^```$", PAGE, flags=re.M | re.S)
    exec(compile(example, "page", "exec"), {})  # noqa: S102
    speed, pitch = map(float, re.findall(r"[\d.]+", capsys.readouterr().out))
    assert 2.0 < speed < 8.0 and 0.3 < pitch < 3.0


def test_all_that_is_wrong_with_the_command_is_told_at_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert (
        run_command(monkeypatch, "vehicle", "fmu", "tractor", "--out", "car.zip", "--platform", "win32") == 2
    )
    said = capsys.readouterr().err
    assert "tractor: no such vehicle" in said and "must end in .fmu" in said and "win64" in said
    assert run_command(monkeypatch, "vehicle", "fmu", "multibody-staged", "--out", "car.fmu") == 2
    assert "was fitted in paper mode" in capsys.readouterr().err
    (tmp_path / "car.fmu").write_text("mine")
    with pytest.raises(InputError, match=r"car\.fmu"):
        write_fmu("multibody-grown", out="car.fmu")
    monkeypatch.setattr("flows.exporting.fmu_binary.find_spec", lambda name: None)
    monkeypatch.setattr("shutil.which", lambda name: None)
    with pytest.raises(InputError, match="needs a C compiler"):
        write_fmu("multibody-grown", out="other.fmu", platforms=["win64"])


@pytest.mark.minutes
@pytest.mark.parametrize("name", [name for name in entry_names("vehicle") if name != "multibody-staged"])
def test_every_vehicle_of_the_catalogue_stops_in_every_weather_as_in_its_own_rollout(name, tmp_path):
    write_fmu(name, out=str(tmp_path / "car.fmu"))
    vehicle = load("vehicle", name)
    for number, weather in enumerate(("dry", "rain", "snow", "ice"), 1):
        car = Car(
            tmp_path / "car.fmu", tmp_path / weather, weather=number, road_friction=0.37, brake_pressure=2.0
        )
        for _ in range(300):
            car.take_step(0.01)
        own = simulate(
            vehicle, compute_surface_response(vehicle, weather, 0.37),
            make_trace_input(np.array([2.0]), INTERNAL_STEP_S), Conditions(),
            Recording(samples=2, interval=3.0, substeps=6000), initial_speed=20.0,
        )  # fmt: skip
        np.testing.assert_allclose(car.read_row(), own.history[1], rtol=1e-9, atol=1e-9)
        car.slave.freeInstance()
