"""The stepped car: the rollout of the same pressures bit for bit, at any rate, from any start, and its refusals."""

import time

import numpy as np
import pytest

from catalogs.entries import load
from tasks.driving.stepped import DriveSettings, SteppedDrive, simulate_pressures
from tasks.errors import InputError
from tasks.surface.road_profile import RoadGrade, RoadHazard
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.rollout import Controls, simulate_scenario

ASPHALT = load("wet friction").apply(load("surface", "dense-asphalt"))
STORM = surface_state(Weather(kind="rain", precipitation_mm_h=50.0), ASPHALT)
CAR = load("vehicle", "bmw-320i")
ROAD = {
    "hazard": RoadHazard(center_m=30.0, length_m=3.6, height_m=0.08),
    "grade": RoadGrade(rise=(0.0, 0.03), spacing_m=40.0),
}


@pytest.mark.parametrize("name", ["bmw-320i", "multibody-grown", "bmw-m8"])
@pytest.mark.parametrize(("rate", "holds"), [(20, True), (100, False), (1000, True)])
def test_the_stepped_car_is_the_rollout_of_its_pressures_bit_for_bit(name, rate, holds):
    car, steps = load("vehicle", name), 3 * rate
    pressures = np.random.default_rng(rate).uniform(0.0, 5.0, steps) * (np.arange(steps) > steps // 5)
    settings = DriveSettings(initial_speed=22.0, duration_s=3.0, rate_hz=rate, hold_speed=holds, **ROAD)
    drive = SteppedDrive(car, STORM, settings)
    for _ in range(2):
        drive.begin()
        for pressure in pressures:
            drive.advance(pressure)
    whole = simulate_pressures(car, STORM, settings, pressures)
    ride = drive.describe()
    assert set(ride.columns) == set(whole.columns)
    for column, values in whole.columns.items():
        np.testing.assert_array_equal(ride.columns[column], values, err_msg=column)
    assert (ride.brake_onset_time, ride.stop_time) == pytest.approx(
        (whole.brake_onset_time, whole.stop_time), nan_ok=True
    )


def test_a_ramp_told_each_millisecond_is_the_command_but_for_the_millisecond():
    car, command = load("vehicle", "bmw-320i"), BrakeCommand(
        peak_pressure_mpa=4.0, ramp_s=0.3, onset_s=0.1, onset_station_m=None, hold_s=None, release_s=0.5
    )  # fmt: skip
    controls = Controls(initial_speed=20.0, brake=command, hold_speed_until_brake=False)
    own = simulate_scenario(car, STORM, controls, ROAD["hazard"], mode="coupled", duration_s=6.0)
    ramp = 4.0 * np.clip((np.arange(6000) / 1000 + 0.001 - 0.1) / 0.3, 0.0, 1.0)
    settings = DriveSettings(initial_speed=20.0, duration_s=6.0, rate_hz=1000, hazard=ROAD["hazard"])
    told = simulate_pressures(car, STORM, settings, ramp)
    assert told.stopping_distance == pytest.approx(own.stopping_distance, abs=0.03)
    assert np.abs(told.columns["speed"] - own.columns["speed"]).max() < 0.01


def test_a_stepped_drive_is_hundreds_of_times_faster_than_real_time():
    drive = SteppedDrive(CAR, STORM, DriveSettings(initial_speed=25.0, duration_s=10.0, rate_hz=20))
    shortest = np.inf
    for _ in range(5):
        drive.begin()
        began = time.process_time()
        for _ in range(drive.steps):
            drive.advance(1.0)
        shortest = min(shortest, time.process_time() - began)
    assert shortest < 10.0 / 300


@pytest.mark.parametrize("pressure", [float("nan"), -0.1, float("inf"), 60.0])
def test_a_pressure_that_no_brake_has_is_refused_and_the_drive_goes_on(pressure):
    drive = SteppedDrive(CAR, STORM, DriveSettings(initial_speed=25.0, duration_s=0.1, rate_hz=20))
    with pytest.raises(InputError, match="brake pressure must be a number within 0 to 50 MPa"):
        drive.advance(pressure)
    drive.advance(1.0)
    drive.advance(1.0)
    with pytest.raises(InputError, match=r"the drive has ended after 0\.1 s"):
        drive.advance(1.0)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"rate_hz": 30}, "steps of whole milliseconds"),
        ({"rate_hz": float("nan")}, "steps of whole milliseconds"),
        ({"duration_s": 0.93}, "duration_s must be whole steps of 0.05 s"),
        ({"initial_speed": 0.0}, "initial_speed must be a positive number"),
    ],
)
def test_what_is_no_drive_is_refused(given, sentence):
    kept = {"initial_speed": 20.0, "duration_s": 1.0, "rate_hz": 20} | given
    with pytest.raises(InputError, match=sentence):
        DriveSettings(**kept)
