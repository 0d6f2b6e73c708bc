"""The half-car: loads at rest, twin and solve_ivp, superposition, energy, contact."""

import numpy as np
from scipy.integrate import solve_ivp

from studies.peers import reference
from tasks.surface.road_profile import RoadHazard, road_elevation
from tasks.vehicle.half_car import build_half_car, compute_forced_rates, integrate_half_car

STEP = 5e-4
TIME = np.arange(6001) * STEP
HUMP = RoadHazard(center_m=8.0, length_m=3.7, height_m=0.075)


def road(hazard, speed=11.0):
    return road_elevation(speed * TIME, hazard), road_elevation(speed * TIME - 2.7, hazard)


def braking_moment():
    return 4000 * np.clip((TIME - 0.2) / 0.5, 0, 1) * (TIME < 2)


def test_static_loads_are_the_papers(vehicle):
    car = build_half_car(vehicle)
    assert (round(car.static_f, 1), round(car.static_r, 1)) == (7069.7, 5761.7)


def test_nothing_moves_on_a_flat_road_without_brakes(vehicle):
    nothing = np.zeros(2001)
    assert not integrate_half_car(nothing, nothing, nothing, STEP, build_half_car(vehicle)).any()


def test_rates_agree_with_the_matrix_form_in_and_out_of_contact(vehicle):
    rng = np.random.default_rng(1)
    for scale in (0.005, 0.2):  # the larger one opens contacts
        for x, heights in zip(rng.normal(0, scale, (50, 8)), rng.normal(0, scale, (50, 2)), strict=True):
            kernel = compute_forced_rates(tuple(x), *heights, 1000.0, build_half_car(vehicle))
            np.testing.assert_allclose(
                kernel, reference.compute_half_car_rates(x, heights, 1000.0, vehicle), rtol=1e-9, atol=1e-9
            )


def test_response_agrees_with_an_adaptive_solver(vehicle):
    (front, rear), moment = road(HUMP), braking_moment()

    def rates(t, x):
        heights = np.array([np.interp(t, TIME, front), np.interp(t, TIME, rear)])
        return reference.compute_half_car_rates(x, heights, np.interp(t, TIME, moment), vehicle)

    solution = solve_ivp(
        rates, (0, 1.6), np.zeros(8), rtol=1e-7, atol=1e-10, max_step=0.005, t_eval=TIME[:3201:100]
    )
    states = integrate_half_car(front, rear, moment, STEP, build_half_car(vehicle))
    np.testing.assert_allclose(states[:3201:100], solution.y.T, atol=2e-6)


def test_halving_the_step_changes_nothing_visible(vehicle):
    fine_time = np.arange(12001) * STEP / 2
    coarse = integrate_half_car(*road(HUMP), braking_moment(), STEP, build_half_car(vehicle))
    fine = integrate_half_car(
        *(np.interp(fine_time, TIME, signal) for signal in (*road(HUMP), braking_moment())),
        STEP / 2,
        build_half_car(vehicle),
    )
    assert np.abs(coarse - fine[::2]).max() < 1e-7


def test_road_and_brake_response_add_up_in_contact(vehicle):
    car, (front, rear), moment = build_half_car(vehicle), road(HUMP), braking_moment()
    nothing = np.zeros_like(moment)
    together = integrate_half_car(front, rear, moment, STEP, car)
    apart = integrate_half_car(front, rear, nothing, STEP, car) + integrate_half_car(
        nothing, nothing, moment, STEP, car
    )
    assert np.abs(together - apart).max() < 1e-12


def test_a_depression_mirrors_a_hump_in_contact(vehicle):
    car, nothing = build_half_car(vehicle), np.zeros_like(TIME)
    up = integrate_half_car(*road(HUMP), nothing, STEP, car)
    down = integrate_half_car(
        *road(RoadHazard(center_m=8.0, length_m=3.7, height_m=-0.075)), nothing, STEP, car
    )
    np.testing.assert_allclose(up, -down, atol=1e-12)


def test_superposition_and_mirror_break_once_a_wheel_leaves_the_road(vehicle):
    car, nothing = build_half_car(vehicle), np.zeros_like(TIME)
    kerb = road(RoadHazard(center_m=8.0, length_m=0.6, height_m=0.10))
    hole = road(RoadHazard(center_m=8.0, length_m=0.6, height_m=-0.10))
    up, down = (integrate_half_car(*heights, nothing, STEP, car) for heights in (kerb, hole))
    assert (car.tyre_f * (kerb[0] - up[:, 2]) < -car.static_f).any()
    assert np.abs(up + down).max() > 0.01


def test_energy_from_road_and_brake_is_stored_or_damped(vehicle):
    """Power of road and moment = change of kinetic and elastic energy + dampers, from the equations of motion."""
    car, (front, rear), moment = build_half_car(vehicle), road(HUMP), braking_moment()
    x = integrate_half_car(front, rear, moment, STEP, car)
    stroke_f, stroke_r = x[:, 0] - x[:, 2] - 1.2 * x[:, 1], x[:, 0] - x[:, 3] + 1.5 * x[:, 1]
    rate_f, rate_r = x[:, 4] - x[:, 6] - 1.2 * x[:, 5], x[:, 4] - x[:, 7] + 1.5 * x[:, 5]
    squash_f, squash_r = front - x[:, 2], rear - x[:, 3]
    stored = 0.5 * (
        1200 * x[:, 4] ** 2
        + 1800 * x[:, 5] ** 2
        + 54 * (x[:, 6] ** 2 + x[:, 7] ** 2)
        + 27000 * (stroke_f**2 + stroke_r**2)
        + car.tyre_f * (squash_f**2 + squash_r**2)
    )
    given = (
        car.tyre_f * (squash_f * np.gradient(front, STEP) + squash_r * np.gradient(rear, STEP))
        + moment * x[:, 5]
        - 3920 * (rate_f**2 + rate_r**2)
    )
    work = np.concatenate([[0], np.cumsum(0.5 * STEP * (given[1:] + given[:-1]))])
    assert np.abs(stored - work).max() < 2e-3 * stored.max()


def test_a_steady_moment_pitches_the_body_as_its_springs_say(vehicle):
    """Static solution of K x = B_b M by NumPy."""
    states = integrate_half_car(
        np.zeros(20001), np.zeros(20001), np.full(20001, 3000.0), STEP, build_half_car(vehicle)
    )
    _, _, stiffness, _, moment = reference.build_half_car_matrices(vehicle)
    np.testing.assert_allclose(states[-1, :4], np.linalg.solve(stiffness, moment * 3000), rtol=1e-6)


def test_load_is_never_negative(vehicle):
    nothing = np.zeros_like(TIME)
    kerb = road(RoadHazard(center_m=8.0, length_m=0.6, height_m=0.15))
    car = build_half_car(vehicle)
    states = integrate_half_car(*kerb, nothing, STEP, car)
    assert np.isfinite(states).all()
    free_fall = states[car.tyre_f * (kerb[0] - states[:, 2]) < -car.static_f, 6]
    assert len(free_fall) > 10
