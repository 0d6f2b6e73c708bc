"""The 4-DOF half-car with unilateral tyre contact, and its RK4 integration.

Its state is (z_s, theta, z_u,f, z_u,r) and then the rates of these, about static equilibrium.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from tasks.vehicle.parameters import Vehicle

HalfCarState = tuple[float, float, float, float, float, float, float, float]


class HalfCar(NamedTuple):
    """The half-car's values in the form that the kernels take; symbols as in the paper's Appendix B.

    Parameters
    ----------
    sprung_mass, unsprung_f, unsprung_r : [kg]
    pitch_inertia : [kg m2]
    to_front, to_rear : l_f, l_r [m]
    spring_f, spring_r : k_s [N/m]
    damper_f, damper_r : c_s [N s/m]
    tyre_f, tyre_r : k_t [N/m]
    static_f, static_r : axle loads at rest [N]
    """

    sprung_mass: float
    unsprung_f: float
    unsprung_r: float
    pitch_inertia: float
    to_front: float
    to_rear: float
    spring_f: float
    spring_r: float
    damper_f: float
    damper_r: float
    tyre_f: float
    tyre_r: float
    static_f: float
    static_r: float


def build_half_car(vehicle: Vehicle) -> HalfCar:
    """Return the half-car of a vehicle."""
    static_f, static_r = vehicle.static_axle_loads
    return HalfCar(
        sprung_mass=vehicle.sprung_mass,
        unsprung_f=vehicle.unsprung_mass_f,
        unsprung_r=vehicle.unsprung_mass_r,
        pitch_inertia=vehicle.pitch_inertia,
        to_front=vehicle.cg_to_front_axle,
        to_rear=vehicle.cg_to_rear_axle,
        spring_f=vehicle.suspension_stiffness_f,
        spring_r=vehicle.suspension_stiffness_r,
        damper_f=vehicle.suspension_damping_f,
        damper_r=vehicle.suspension_damping_r,
        tyre_f=vehicle.tyre_stiffness_f,
        tyre_r=vehicle.tyre_stiffness_r,
        static_f=static_f,
        static_r=static_r,
    )


@register_jitable(cache=True, forceinline=True)
def compute_contact_load(
    road_height: float, unsprung_height: float, stiffness: float, static_load: float
) -> float:
    """Return the load of one axle on the road, never negative [N] (paper, Eq. app_unilateral_contact).

    Parameters
    ----------
    road_height, unsprung_height : about static equilibrium [m]
    stiffness : k_t [N/m]
    static_load : F_z^0 [N]
    """
    return static_load + max(stiffness * (road_height - unsprung_height), -static_load)


@register_jitable(cache=True, forceinline=True)
def compute_suspension_forces(x: HalfCarState, car: HalfCar) -> tuple[float, float]:
    """Return the spring and damper forces of the front and rear axle, F_s,f and F_s,r [N] (paper, Appendix B).

    Parameters
    ----------
    x : half-car state [m, rad, m/s, rad/s]
    car : the half-car's values
    """
    heave, pitch, unsprung_f, unsprung_r, heave_rate, pitch_rate, unsprung_rate_f, unsprung_rate_r = x
    force_f = car.spring_f * (heave - unsprung_f - car.to_front * pitch) + car.damper_f * (
        heave_rate - unsprung_rate_f - car.to_front * pitch_rate
    )
    force_r = car.spring_r * (heave - unsprung_r + car.to_rear * pitch) + car.damper_r * (
        heave_rate - unsprung_rate_r + car.to_rear * pitch_rate
    )
    return force_f, force_r


@njit(cache=True, nogil=True, forceinline=True)
def compute_half_car_rates(
    x: HalfCarState,
    load_f: float,
    load_r: float,
    force_f: float,
    force_r: float,
    moment: float,
    lift: float,
    car: HalfCar,
) -> HalfCarState:
    """Return the rate of the half-car state (paper, Eq. app_half_car_complete).

    Parameters
    ----------
    x : half-car state [m, rad, m/s, rad/s]
    load_f, load_r : contact loads [N]
    force_f, force_r : suspension forces [N]
    moment : pitch moment on the body, nose-down positive [N m]
    lift : further upward force on the body's centre of gravity, such as aerodynamic lift [N]
    car : the half-car's values
    """
    return (
        x[4],
        x[5],
        x[6],
        x[7],
        (-force_f - force_r + lift) / car.sprung_mass,
        (car.to_front * force_f - car.to_rear * force_r + moment) / car.pitch_inertia,
        (force_f + load_f - car.static_f) / car.unsprung_f,
        (force_r + load_r - car.static_r) / car.unsprung_r,
    )


@register_jitable(cache=True, forceinline=True)
def advance_half_car(x: HalfCarState, rate: HalfCarState, step: float) -> HalfCarState:
    """Return the half-car state after a step [s] at a constant rate."""
    return (
        x[0] + step * rate[0],
        x[1] + step * rate[1],
        x[2] + step * rate[2],
        x[3] + step * rate[3],
        x[4] + step * rate[4],
        x[5] + step * rate[5],
        x[6] + step * rate[6],
        x[7] + step * rate[7],
    )


@register_jitable(cache=True)
def compute_forced_rates(
    x: HalfCarState, road_f: float, road_r: float, moment: float, car: HalfCar
) -> HalfCarState:
    """Return the rate of the half-car state for given road heights and a pitch moment.

    Parameters
    ----------
    x : half-car state [m, rad, m/s, rad/s]
    road_f, road_r : road height under each axle [m]
    moment : pitch moment on the body, nose-down positive [N m]
    car : the half-car's values
    """
    load_f = compute_contact_load(road_f, x[2], car.tyre_f, car.static_f)
    load_r = compute_contact_load(road_r, x[3], car.tyre_r, car.static_r)
    force_f, force_r = compute_suspension_forces(x, car)
    return compute_half_car_rates(x, load_f, load_r, force_f, force_r, moment, 0.0, car)


@register_jitable(cache=True, forceinline=True)
def step_half_car(
    x: HalfCarState,
    road_f: tuple[float, float],
    road_r: tuple[float, float],
    moment: tuple[float, float],
    step: float,
    car: HalfCar,
) -> HalfCarState:
    """Return the half-car state after one RK4 step, with inputs linear within it (paper, Appendix B).

    Parameters
    ----------
    x : half-car state [m, rad, m/s, rad/s]
    road_f, road_r : road height under each axle, before and after the step [m]
    moment : pitch moment, before and after the step [N m]
    step : length of the step [s]
    car : the half-car's values
    """
    middle_f = 0.5 * (road_f[0] + road_f[1])
    middle_r = 0.5 * (road_r[0] + road_r[1])
    middle_moment = 0.5 * (moment[0] + moment[1])
    k1 = compute_forced_rates(x, road_f[0], road_r[0], moment[0], car)
    k2 = compute_forced_rates(advance_half_car(x, k1, 0.5 * step), middle_f, middle_r, middle_moment, car)
    k3 = compute_forced_rates(advance_half_car(x, k2, 0.5 * step), middle_f, middle_r, middle_moment, car)
    k4 = compute_forced_rates(advance_half_car(x, k3, step), road_f[1], road_r[1], moment[1], car)
    return advance_half_car(
        advance_half_car(advance_half_car(advance_half_car(x, k1, step / 6), k2, step / 3), k3, step / 3),
        k4,
        step / 6,
    )


AT_REST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@njit(cache=True, nogil=True)
def integrate_half_car(
    road_f: NDArray[np.float64],
    road_r: NDArray[np.float64],
    moment: NDArray[np.float64],
    step: float,
    car: HalfCar,
) -> NDArray[np.float64]:
    """Return the half-car's response from rest by RK4, with inputs linear between samples (paper, Appendix B).

    Parameters
    ----------
    road_f, road_r : road height under each axle, shape (n,) [m]
    moment : pitch moment, shape (n,) [N m]
    step : sample interval [s]
    car : the half-car

    Returns
    -------
    States, shape (n, 8) [m, rad, m/s, rad/s].
    """
    states = np.empty((len(moment), 8))
    x = AT_REST
    for n in range(len(moment)):
        for column in range(8):
            states[n, column] = x[column]
        if n + 1 == len(moment):
            break
        x = step_half_car(
            x, (road_f[n], road_f[n + 1]), (road_r[n], road_r[n + 1]), (moment[n], moment[n + 1]), step, car
        )
    return states


@njit(cache=True, nogil=True)
def integrate_superposed(
    road_f: NDArray[np.float64],
    road_r: NDArray[np.float64],
    moment: NDArray[np.float64],
    step: float,
    car: HalfCar,
) -> NDArray[np.float64]:
    """Return the sum of the responses to the road alone and to the moment alone, x_road + x_brake (paper, Appendix B).

    The two do not feel each other, so one loop advances both at little more than the cost of one.

    Parameters
    ----------
    road_f, road_r, moment, step, car : as in `integrate_half_car`

    Returns
    -------
    States, shape (n, 8) [m, rad, m/s, rad/s].
    """
    states = np.empty((len(moment), 8))
    brake, bump = AT_REST, AT_REST
    level = (0.0, 0.0)
    for n in range(len(moment)):
        for column in range(8):
            states[n, column] = brake[column] + bump[column]
        if n + 1 == len(moment):
            break
        brake = step_half_car(brake, level, level, (moment[n], moment[n + 1]), step, car)
        bump = step_half_car(bump, (road_f[n], road_f[n + 1]), (road_r[n], road_r[n + 1]), level, step, car)
    return states


@njit(cache=True, nogil=True)
def compute_contact_loads(
    states: NDArray[np.float64], road_f: NDArray[np.float64], road_r: NDArray[np.float64], car: HalfCar
) -> NDArray[np.float64]:
    """Return the contact loads of both axles along a run, shape (n, 2) [N] (paper, Eq. app_unilateral_contact).

    Parameters
    ----------
    states : half-car states, shape (n, 8) [m, rad, m/s, rad/s]
    road_f, road_r : road height under each axle, shape (n,) [m]
    car : the half-car
    """
    loads = np.empty((len(states), 2))
    for n in range(len(states)):
        loads[n, 0] = compute_contact_load(road_f[n], states[n, 2], car.tyre_f, car.static_f)
        loads[n, 1] = compute_contact_load(road_r[n], states[n, 3], car.tyre_r, car.static_r)
    return loads
