"""A hill is felt: the grade takes its share of gravity, moves the load, and gives back what it took."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from catalogs.entries import load
from tasks.errors import InputError
from tasks.surface.road_profile import FLAT_ROAD, RoadGrade
from tasks.surface.state import SurfaceState
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import MODES, Controls, Rollout, simulate_scenario
from tests.vehicle.conftest import command

DRY = SurfaceState(kind="dry", friction=0.82)
UP, DOWN = RoadGrade(rise=(0.08,)), RoadGrade(rise=(-0.08,))


def drive(
    car: Vehicle, mode: str, grade: RoadGrade, *, peak: float = 2.3, duration: float = 8.0, hold: bool = True
) -> Rollout:
    """Hold 60 km/h for a second on a dry road, then brake."""
    controls = Controls(initial_speed=60 / 3.6, brake=command(peak), hold_speed_until_brake=hold)
    return simulate_scenario(
        car,
        DRY,
        controls,
        FLAT_ROAD,
        mode=mode,
        duration_s=duration,
        steady=load("low-speed rule"),
        grade=grade,
    )


def integrate_point(car: Vehicle, grade: float) -> float:
    """Stop of a point with the car's mass and its wheels' inertia; the pressure is too low for the tyres' peak [m]."""
    turning = car.mass + (car.wheel_inertia_f + car.wheel_inertia_r) / car.wheel_radius**2

    def rates(time: float, state: np.ndarray) -> list[float]:
        pressed = car.brake_gain * 2.3 * min(time / 0.5, 1.0) / car.wheel_radius
        against = car.mass * (car.coast_deceleration + car.gravity * grade)
        return [state[1], -(pressed + against) / turning]

    def stands(time: float, state: np.ndarray) -> float:
        return float(state[1])

    stands.terminal = True  # type: ignore[attr-defined]
    solved = solve_ivp(rates, (0.0, 20.0), [0.0, 60 / 3.6], events=stands, rtol=1e-9, max_step=0.01)
    return float(solved.y[0, -1])


@pytest.mark.parametrize(("grade", "stop"), [(UP, 26.5), (DOWN, 35.4)], ids=["up", "down"])
@pytest.mark.parametrize("mode", MODES)
def test_a_stop_on_a_hill_is_as_long_as_gravity_makes_it(vehicle, mode, grade, stop):
    found = drive(vehicle, mode, grade).stopping_distance
    assert found == pytest.approx(stop, abs=0.05)
    assert found == pytest.approx(integrate_point(vehicle, grade.rise[0]), abs=0.15)


@pytest.mark.parametrize("mode", MODES)
def test_a_hill_gives_back_what_it_took_and_its_column_is_the_road_s(vehicle, mode):
    """Up 2 m and down again without drag: height times m g is what the car and its wheels lose in between."""
    car = replace(vehicle, coast_deceleration=0.0)
    hill = RoadGrade(rise=(0.0, 0.0, 0.1, 0.1, 0.0, -0.1, -0.1, 0.0, 0.0), spacing_m=10.0)
    columns = drive(car, mode, hill, peak=0.0, hold=False).columns
    station, speed = columns["station"], columns["speed"]
    np.testing.assert_array_equal(columns["road_grade"], hill.at(station))
    fine = np.linspace(0.0, 100.0, 100_001)
    height = np.concatenate([[0.0], np.cumsum(hill.at((fine[1:] + fine[:-1]) / 2)) * 1e-3])
    energy = 0.5 * car.mass * speed**2
    if mode == "coupled":
        energy = energy + sum(
            0.5 * getattr(car, f"wheel_inertia_{x}") * columns[f"wheel_speed_{x}"] ** 2 for x in "fr"
        )
    climbed = np.interp(station, fine, height)
    np.testing.assert_allclose(energy[0] - energy, car.mass * car.gravity * climbed, atol=0.002 * energy[0])
    assert climbed.max() > 1.9 and station[-1] > 80


@pytest.mark.parametrize("mode", MODES)
def test_what_holds_a_car_on_a_hill_moves_its_load_whether_it_stands_or_keeps_its_speed(vehicle, mode):
    moved = vehicle.mass * vehicle.gravity * 0.08 * vehicle.cg_height / vehicle.wheelbase
    level, up, down = (drive(vehicle, mode, grade).columns for grade in (RoadGrade(), UP, DOWN))
    for tick in (999, -1):
        np.testing.assert_allclose(
            [ride["tyre_load_r"][tick] - level["tyre_load_r"][tick] for ride in (up, down)],
            [moved, -moved],
            rtol=0.03,
        )
        assert up["pitch"][tick] < level["pitch"][tick] - 0.005 < down["pitch"][tick] - 0.01
    assert np.ptp(up["speed"][:1000]) == np.ptp(down["speed"][:1000]) == 0.0
    assert up["speed"][-1] == up["longitudinal_acceleration"][-1] == 0.0


@pytest.mark.parametrize("mode", MODES)
def test_a_coasting_car_climbs_without_pitching(vehicle, mode):
    """Gravity acts at the centre of gravity, and nothing at the ground."""
    ride = drive(vehicle, mode, UP, peak=0.0, duration=2.0, hold=False).columns
    assert np.abs(ride["pitch"]).max() < np.deg2rad(0.02)
    assert ride["speed"][-1] < 60 / 3.6 - 1.4


@pytest.mark.parametrize("mode", MODES)
def test_a_road_of_grade_zero_is_the_level_road_bit_for_bit(vehicle, mode):
    level, flat = (
        drive(vehicle, mode, grade).columns
        for grade in (RoadGrade(), RoadGrade(rise=(0.0, 0.0), spacing_m=7.0))
    )
    assert all(level[name].tobytes() == flat[name].tobytes() for name in level)


def test_a_grade_that_no_road_has_is_refused():
    with pytest.raises(InputError, match=r"above -1 and below 1; it is 1.2"):
        RoadGrade(rise=(0.0, 1.2))
