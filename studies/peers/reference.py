"""The models in plain NumPy: slow, short, written from the equations. Tests compare the kernels with them.

Arrays of two hold the front and the rear axle.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tasks.surface.road_profile import RoadHazard, road_elevation, road_slope
from tasks.vehicle.parameters import SurfaceResponse, Vehicle

Array = NDArray[np.float64]
SPEED, STATION, WHEELS, BODY = 0, 1, slice(2, 4), slice(4, 12)
"""Positions of speed [m/s], station [m], wheel speeds [rad/s] and half-car state in the coupled state."""


def compute_reference_friction(
    slip: ArrayLike, vehicle: Vehicle, family: str, response: SurfaceResponse
) -> Array:
    """Return the peak-normalised curve mu_B, odd in slip, with its peak found on a fine grid [1] (paper, Appendix B).

    Parameters
    ----------
    slip : braking slip [1]
    vehicle, family, response : vehicle, kind of weather and surface response, which give the curve
    """
    c1, c2, c3 = vehicle.find_tyre_family(family).burckhardt

    def evaluate_base_curve(kappa: Array) -> Array:
        return c1 * (1 - np.exp(-c2 * kappa)) - c3 * kappa

    slip = np.asarray(slip, float)
    peak = evaluate_base_curve(np.linspace(0, 1, 10_001)).max()
    return (
        np.sign(slip)
        * response.tyre.peak
        / peak
        * evaluate_base_curve(response.slip_stiffness * np.abs(slip))
    )


def compute_abs_scale(
    slip: Array, before: Array, step: float, vehicle: Vehicle, response: SurfaceResponse
) -> Array:
    """Return the ABS torque scale as the paper writes its rate limit: a clipped change is added [1] (Appendix B).

    Parameters
    ----------
    slip : braking slip of the axles [1]
    before : scale before the step [1]
    step : length of the step [s]
    vehicle, response : vehicle and surface response, which give widths, rates and target slip
    """
    target, width = response.tyre.target_slip, vehicle.abs_release_width
    command = np.clip((target * (1 + width) - slip) / (width * target), 0, 1)
    change = np.clip(command - before, -vehicle.abs_release_rate * step, vehicle.abs_build_rate * step)
    return np.clip(before + change, 0, 1)


@dataclass(frozen=True, kw_only=True)
class ReferenceDrive:
    """A drive of the twin.

    Parameters
    ----------
    initial_speed : speed at the start [m/s]
    pressure : brake pressure [MPa] of time [s]
    loads : axle loads [N] of the sample and of the last acceleration [m/s2]
    hazard : road feature
    """

    initial_speed: float
    pressure: Callable[[float], float]
    loads: Callable[[int, float], Array]
    hazard: RoadHazard


def simulate_paper_drive(
    vehicle: Vehicle,
    family: str,
    response: SurfaceResponse,
    drive: ReferenceDrive,
    *,
    steps: int,
    step: float,
) -> dict[str, Array]:
    """Return speed, station and wheel speeds of paper mode by Euler steps, to the stop (paper, Appendix B).

    Parameters
    ----------
    vehicle, family, response : the vehicle on its surface
    drive : speed, brake, loads and road
    steps, step : number and length of the steps [s]
    """
    radius, floor = vehicle.wheel_radius, vehicle.slip_speed_floor
    inertia = np.array([vehicle.wheel_inertia_f, vehicle.wheel_inertia_r])
    share = np.array([vehicle.front_brake_share, 1 - vehicle.front_brake_share])
    speed, station, omega = drive.initial_speed, 0.0, np.full(2, drive.initial_speed / radius)
    scale, acceleration = np.ones(2), 0.0
    history = []
    for n in range(steps + 1):
        slip = np.clip((speed - radius * omega) / max(speed, floor), 0, 1)
        scale = compute_abs_scale(slip, scale, step, vehicle, response)
        load = drive.loads(n, acceleration)
        force = compute_reference_friction(slip, vehicle, family, response) * load
        torque = share * scale * vehicle.brake_gain * drive.pressure(n * step)
        slope = road_slope(station - np.array([0, vehicle.wheelbase]), drive.hazard)
        acceleration = -(force + load * slope).sum() / vehicle.mass - vehicle.coast_deceleration
        history.append([speed, station, *omega, *slip, *force, *load, *scale])
        station += step * (speed + step * acceleration / 2)
        speed += step * acceleration
        omega = omega + step * (radius * force - torque) / inertia
        if speed <= vehicle.stop_speed:
            break
    names = ("speed", "station", "omega", "slip", "force", "load", "scale")
    columns = np.split(np.array(history), [1, 2, 4, 6, 8, 10], axis=1)
    return dict(zip(names, columns, strict=True))


def build_half_car_matrices(vehicle: Vehicle) -> tuple[Array, Array, Array, Array, Array]:
    """Return M, C, K, B_r and B_b of the half-car in contact (paper, Eq. half_car).

    Parameters
    ----------
    vehicle : the vehicle
    """
    lf, lr = vehicle.cg_to_front_axle, vehicle.cg_to_rear_axle
    stroke = np.array([[1, -lf, -1, 0], [1, lr, 0, -1]])  # of the suspensions, per coordinate
    springs = np.diag([vehicle.suspension_stiffness_f, vehicle.suspension_stiffness_r])
    dampers = np.diag([vehicle.suspension_damping_f, vehicle.suspension_damping_r])
    tyres = np.array([vehicle.tyre_stiffness_f, vehicle.tyre_stiffness_r])
    mass = np.diag(
        [vehicle.sprung_mass, vehicle.pitch_inertia, vehicle.unsprung_mass_f, vehicle.unsprung_mass_r]
    )
    stiffness = stroke.T @ springs @ stroke + np.diag([0, 0, *tyres])
    road = np.zeros((4, 2))
    road[2, 0], road[3, 1] = tyres
    return mass, stroke.T @ dampers @ stroke, stiffness, road, np.array([0.0, 1.0, 0.0, 0.0])


def compute_half_car_rates(x: Array, road: Array, moment: float, vehicle: Vehicle) -> Array:
    """Return the rate of the half-car state, with the tyre force that contact leaves it (paper, Appendix B).

    Parameters
    ----------
    x : four coordinates and their rates [m, rad, m/s, rad/s]
    road : road heights [m]
    moment : pitch moment [N m]
    vehicle : the vehicle
    """
    mass, damping, stiffness, road_input, moment_input = build_half_car_matrices(vehicle)
    force = road_input @ road + moment_input * moment - damping @ x[4:] - stiffness @ x[:4]
    tyres = np.diag(stiffness)[2:] - np.array(
        [vehicle.suspension_stiffness_f, vehicle.suspension_stiffness_r]
    )
    lift = -np.array(vehicle.static_axle_loads) - tyres * (road - x[2:4])
    force[2:] += np.maximum(lift, 0)
    return np.concatenate([x[4:], np.linalg.solve(mass, force)])


def compute_coupled_rates(
    state: Array,
    pressure: float,
    vehicle: Vehicle,
    family: str,
    response: SurfaceResponse,
    hazard: RoadHazard,
) -> Array:
    """Return the rate of the coupled model's state while it moves, with the algebraic ABS.

    The pitch moment is written about the body's centre of gravity: the tyre forces at the ground, the slope
    forces at wheel height, less the inertia of axles and wheels.

    Parameters
    ----------
    state : speed, station, wheel speeds, half-car state
    pressure : [MPa]
    vehicle, family, response, hazard : the scenario
    """
    speed, station, omega, x = state[SPEED], state[STATION], state[WHEELS], state[BODY]
    radius = vehicle.wheel_radius
    inertia = np.array([vehicle.wheel_inertia_f, vehicle.wheel_inertia_r])
    share = np.array([vehicle.front_brake_share, 1 - vehicle.front_brake_share])
    axle_mass = np.array([vehicle.unsprung_mass_f, vehicle.unsprung_mass_r])
    tyres = np.array([vehicle.tyre_stiffness_f, vehicle.tyre_stiffness_r])
    stations = station - np.array([0, vehicle.wheelbase])

    road = road_elevation(stations, hazard)
    load = np.maximum(np.array(vehicle.static_axle_loads) + tyres * (road - x[2:4]), 0)
    slip = np.clip((speed - radius * omega) / max(speed, vehicle.slip_speed_floor), -1, 1)
    force = compute_reference_friction(slip, vehicle, family, response) * load
    scale = compute_abs_scale(slip, np.ones(2), np.inf, vehicle, response)
    torque = share * scale * vehicle.brake_gain * pressure * np.clip(omega / vehicle.lock_speed, -1, 1)
    slope_force = load * road_slope(stations, hazard)
    acceleration = -(force + slope_force).sum() / vehicle.mass - vehicle.coast_deceleration
    wheel_rate = (radius * force - torque) / inertia

    body_height = (vehicle.mass * vehicle.cg_height - axle_mass.sum() * radius) / vehicle.sprung_mass
    moment = (
        force.sum() * body_height
        + (slope_force + axle_mass * acceleration).sum() * (body_height - radius)
        - (inertia * wheel_rate).sum()
    )
    return np.concatenate(
        [[acceleration, speed], wheel_rate, compute_half_car_rates(x, road, moment, vehicle)]
    )
