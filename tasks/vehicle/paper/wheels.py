"""Wheels and brakes of paper mode, and stops by explicit Euler steps (paper, Appendix B).

One step function serves the logged rollout and the lean stopping run. It multiplies by reciprocals because they
leave the loop, where divisions would stay in it.

The published step is too long for the wheels below about 4 m/s, where they chatter around the target slip: there
the last bit of a sum moves a stop by millimetres, up to 14 mm on light snow. Runs repeat bit by bit all the same;
`tasks.vehicle.paper.wheel_step` is the step that does not chatter.
"""

from math import nan
from typing import NamedTuple

from numba import njit
from numba.extending import register_jitable

from tasks.vehicle.brake import PressureProfile, compute_abs_command, compute_brake_pressure, limit_abs_rate
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.tyres.contract import Tyre, compute_braking_slip, compute_tyre_friction


class Axle(NamedTuple):
    """The wheels of one axle.

    Parameters
    ----------
    inertia : I_w [kg m2]
    brake_gain : brake torque per pressure, b_a K_p [N m/MPa]
    static_load : load without acceleration, by the analytic load transfer [N]
    """

    inertia: float
    brake_gain: float
    static_load: float


class Wheels(NamedTuple):
    """Longitudinal values of a vehicle in the form that the kernels take.

    Parameters
    ----------
    front, rear : the axles
    mass : m [kg]
    radius : R [m]
    wheelbase : L_w [m]
    transfer : load moved to the front per deceleration, m h_cg / L_w [N s2/m]
    release_width : delta_a of the ABS, relative to the target slip [1]
    build_rate, release_rate : largest rates of the ABS torque scale [1/s]
    coast : a_coast [m/s2]
    speed_floor, stop_speed : v_epsilon, and speed at or below which the vehicle stands [m/s]
    """

    front: Axle
    rear: Axle
    mass: float
    radius: float
    wheelbase: float
    transfer: float
    release_width: float
    build_rate: float
    release_rate: float
    coast: float
    speed_floor: float
    stop_speed: float


def build_wheels(vehicle: Vehicle) -> Wheels:
    """Return the longitudinal values of a vehicle."""
    share = vehicle.front_brake_share
    load_per_lever = vehicle.mass * vehicle.gravity / vehicle.wheelbase
    return Wheels(
        front=Axle(
            inertia=vehicle.wheel_inertia_f,
            brake_gain=share * vehicle.brake_gain,
            static_load=load_per_lever * vehicle.cg_to_rear_axle,
        ),
        rear=Axle(
            inertia=vehicle.wheel_inertia_r,
            brake_gain=(1 - share) * vehicle.brake_gain,
            static_load=load_per_lever * vehicle.cg_to_front_axle,
        ),
        mass=vehicle.mass,
        radius=vehicle.wheel_radius,
        wheelbase=vehicle.wheelbase,
        transfer=vehicle.mass * vehicle.cg_height / vehicle.wheelbase,
        release_width=vehicle.abs_release_width,
        build_rate=vehicle.abs_build_rate,
        release_rate=vehicle.abs_release_rate,
        coast=vehicle.coast_deceleration,
        speed_floor=vehicle.slip_speed_floor,
        stop_speed=vehicle.stop_speed,
    )


class AxleStep(NamedTuple):
    """One axle in one step: slip [1], tyre force [N], brake torque [N m], ABS scale [1], wheel rate [rad/s2]."""

    slip: float
    force: float
    torque: float
    scale: float
    rate: float


@register_jitable(cache=True)
def compute_axle_step(
    speed: float,
    omega: float,
    load: float,
    pressure: float,
    scale: float,
    step: float,
    axle: Axle,
    wheels: Wheels,
    tyre: Tyre,
) -> AxleStep:
    """Return slip, ABS scale, tyre force and wheel acceleration of one axle (paper, from Eq. app_abs_command on).

    Parameters
    ----------
    speed : v [m/s]
    omega : wheel speed [rad/s]
    load : load of the axle [N]
    pressure : brake pressure [MPa]
    scale : ABS scale before the step [1]
    step : Euler step [s]
    axle, wheels, tyre : the axle's wheels, the vehicle's longitudinal values, its tyre on the surface
    """
    slip = compute_braking_slip(speed, wheels.radius * omega, wheels.speed_floor)
    wanted = compute_abs_command(slip, tyre.target_slip, wheels.release_width)
    scale = limit_abs_rate(wanted, scale, wheels.build_rate * step, wheels.release_rate * step)
    force = compute_tyre_friction(slip, load, tyre) * load
    torque = scale * (axle.brake_gain * pressure)
    return AxleStep(slip, force, torque, scale, (wheels.radius * force - torque) * (1.0 / axle.inertia))


@njit(cache=True, nogil=True)
def compute_transferred_loads(acceleration: float, wheels: Wheels) -> tuple[float, float]:
    """Return the axle loads by longitudinal load transfer, F_z^long [N] (paper, Appendix B).

    Parameters
    ----------
    acceleration : dv/dt [m/s2]
    wheels : static loads and transfer
    """
    moved = wheels.transfer * acceleration
    return max(wheels.front.static_load - moved, 0.0), max(wheels.rear.static_load + moved, 0.0)


@njit(cache=True, nogil=True)
def simulate_stop(
    initial_speed: float, step: float, longest: int, profile: PressureProfile, wheels: Wheels, tyre: Tyre
) -> tuple[float, float]:
    """Brake on a flat road from t = 0 to the stop, without a log.

    Parameters
    ----------
    initial_speed : speed at the brake onset [m/s]
    step : Euler step [s]
    longest : largest number of steps [1]
    profile : brake command with its onset at 0
    wheels, tyre : the vehicle on its surface

    Returns
    -------
    Stopping distance [m] and time [s]; NaN when it does not stop.
    """
    speed, omega_f, omega_r = initial_speed, initial_speed / wheels.radius, initial_speed / wheels.radius
    scale_f, scale_r, acceleration, distance = 1.0, 1.0, 0.0, 0.0
    for n in range(longest):
        pressure = compute_brake_pressure(n * step, profile)
        load_f, load_r = compute_transferred_loads(acceleration, wheels)
        f = compute_axle_step(speed, omega_f, load_f, pressure, scale_f, step, wheels.front, wheels, tyre)
        r = compute_axle_step(speed, omega_r, load_r, pressure, scale_r, step, wheels.rear, wheels, tyre)
        scale_f, scale_r = f.scale, r.scale
        acceleration = -(f.force + r.force) * (1.0 / wheels.mass) - wheels.coast
        after = speed + step * acceleration
        distance += 0.5 * step * (speed + after)
        speed = after
        omega_f += step * f.rate
        omega_r += step * r.rate
        if speed <= wheels.stop_speed:
            return distance, (n + 1) * step
    return nan, nan
