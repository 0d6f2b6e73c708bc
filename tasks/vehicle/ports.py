"""Coupled mode's physics at one instant: every force where it meets the vehicle, each with its own function.

The ports are, in the order they are worked out: road, load, slip, friction, tyre force, brake torque,
suspension force, drag, pitch moment. An effect that the model lacks acts on exactly one of them.
"""

from typing import NamedTuple

from numba import njit

from tasks.vehicle.brake import abs_command, abs_update
from tasks.vehicle.half_car import HalfCar, HalfCarState, contact_load, half_car, suspension_forces
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.road import RoadFeature, height_at, slope_at
from tasks.vehicle.tyre import TyreCurve, tyre_friction
from tasks.vehicle.wheels import Axle, Wheels, wheels_of


class Chassis(NamedTuple):
    """The whole vehicle as the coupled kernel takes it.

    Parameters
    ----------
    body : the half-car
    wheels : wheels, brakes and longitudinal values
    lever : height of the body's centre of gravity above the wheel centres [m]
    lock_speed : wheel speed below which brake friction is proportional to it [rad/s]
    """

    body: HalfCar
    wheels: Wheels
    lever: float
    lock_speed: float


def chassis_of(vehicle: Vehicle) -> Chassis:
    """The coupled model's values of a vehicle.

    ``cg_height`` is that of the whole vehicle; the axles' centres of gravity are at wheel height.
    """
    axles = vehicle.unsprung_mass_f + vehicle.unsprung_mass_r
    body_height = (vehicle.mass * vehicle.cg_height - axles * vehicle.wheel_radius) / vehicle.sprung_mass
    return Chassis(
        body=half_car(vehicle),
        wheels=wheels_of(vehicle),
        lever=body_height - vehicle.wheel_radius,
        lock_speed=vehicle.lock_speed,
    )


class Motion(NamedTuple):
    """Longitudinal state: station [m], speed [m/s], wheel speeds of the axles [rad/s]."""

    station: float
    speed: float
    omega_f: float
    omega_r: float


class Ground(NamedTuple):
    """Road height [m] and slope [m/m] under an axle, and its contact load, never negative [N]."""

    height: float
    slope: float
    load: float


class AxlePorts(NamedTuple):
    """What acts at one axle.

    Parameters
    ----------
    ground : road and load
    slip : signed braking slip; negative where the tyre drives the vehicle [1]
    tyre_force : braking force at the contact, rearward positive [N]
    abs_scale : share of the brake torque let through [1]
    brake_torque : against the wheel's rotation [N m]
    suspension_force : spring and damper [N]
    """

    ground: Ground
    slip: float
    tyre_force: float
    abs_scale: float
    brake_torque: float
    suspension_force: float


class Ports(NamedTuple):
    """What acts on the vehicle at one instant.

    Parameters
    ----------
    front, rear : the axles
    road_force : horizontal part of the contact loads on the slope, forward positive [N]
    drag : coast drag, rearward positive [N]
    acceleration : dv/dt [m/s2]
    pitch_moment : on the body, nose-down positive [N m]
    """

    front: AxlePorts
    rear: AxlePorts
    road_force: float
    drag: float
    acceleration: float
    pitch_moment: float


@njit(cache=True, nogil=True)
def signed_slip(speed: float, rim_speed: float, speed_floor: float) -> float:
    """Braking slip that is negative for a driven wheel, within [-1, 1]; ISO 8855's is its negative [1].

    Parameters
    ----------
    speed : v [m/s]
    rim_speed : R omega [m/s]
    speed_floor : v_epsilon [m/s]
    """
    return min(max((speed - rim_speed) / max(speed, speed_floor), -1.0), 1.0)


@njit(cache=True, nogil=True)
def signed_friction(slip: float, tyre: TyreCurve) -> float:
    """Friction of the tyre curve, continued oddly to driving slip [1].

    Parameters
    ----------
    slip : signed braking slip [1]
    tyre : the scaled curve
    """
    return tyre_friction(slip, tyre) if slip >= 0.0 else -tyre_friction(-slip, tyre)


@njit(cache=True, nogil=True)
def lock_share(omega: float, lock_speed: float) -> float:
    """Share of the brake torque that friction gives at a wheel speed: all of it, save around standstill [1].

    Parameters
    ----------
    omega : [rad/s]
    lock_speed : [rad/s]
    """
    return min(max(omega / lock_speed, -1.0), 1.0)


@njit(cache=True, nogil=True)
def ground_at(
    station: float, unsprung_height: float, stiffness: float, static_load: float, road: RoadFeature
) -> Ground:
    """Road and load under one axle.

    Parameters
    ----------
    station : of the axle [m]
    unsprung_height : [m]
    stiffness : of the tyre [N/m]
    static_load : half-car's load at rest [N]
    road : the feature
    """
    height = height_at(station, road)
    return Ground(
        height, slope_at(station, road), contact_load(height, unsprung_height, stiffness, static_load)
    )


@njit(cache=True, nogil=True)
def rolling_axle(
    ground: Ground,
    speed: float,
    omega: float,
    suspension_force: float,
    pressure: float,
    scale: float,
    step: float,
    axle: Axle,
    chassis: Chassis,
    tyre: TyreCurve,
) -> AxlePorts:
    """Slip, tyre force and brake torque of one axle.

    Parameters
    ----------
    ground : road and load under it
    speed : [m/s]
    omega : wheel speed [rad/s]
    suspension_force : [N]
    pressure : brake pressure [MPa]
    scale : ABS scale one step before, from which its rate is limited [1]
    step : [s]
    axle, chassis, tyre : the values
    """
    wheels = chassis.wheels
    slip = signed_slip(speed, wheels.radius * omega, wheels.speed_floor)
    tyre_force = signed_friction(slip, tyre) * ground.load
    wanted = abs_command(slip, tyre.target_slip, wheels.release_width)
    abs_scale = abs_update(wanted, scale, wheels.build_rate * step, wheels.release_rate * step)
    brake_torque = axle.brake_gain * pressure * abs_scale * lock_share(omega, chassis.lock_speed)
    return AxlePorts(ground, slip, tyre_force, abs_scale, brake_torque, suspension_force)


@njit(cache=True, nogil=True)
def standing_axle(ground: Ground, suspension_force: float, wheels: Wheels) -> AxlePorts:
    """The ports of an axle at rest: the tyre holds the vehicle on the slope, the brake holds the wheel.

    Parameters
    ----------
    ground : road and load under it
    suspension_force : [N]
    wheels : the values
    """
    tyre_force = -ground.load * ground.slope
    return AxlePorts(ground, 0.0, tyre_force, 1.0, wheels.radius * tyre_force, suspension_force)


@njit(cache=True, nogil=True)
def ports_at(
    motion: Motion,
    x: HalfCarState,
    pressure: float,
    scale_f: float,
    scale_r: float,
    step: float,
    standing: bool,
    held: bool,
    chassis: Chassis,
    tyre: TyreCurve,
    road: RoadFeature,
) -> Ports:
    """All that acts on the vehicle in one state.

    The body's pitch moment follows from the forces at the ground: each axle passes its longitudinal link force
    on at wheel height, and its brake torque. With F_x at the ground this is the same as F_x on the height of
    the body's centre of gravity less the inertia of axles and wheels.

    Parameters
    ----------
    motion, x : longitudinal and half-car state
    pressure : [MPa]
    scale_f, scale_r : ABS scales one step before [1]
    step : [s]
    standing : the vehicle has come to rest
    held : its speed is held from outside
    chassis, tyre, road : the values
    """
    body, wheels = chassis.body, chassis.wheels
    ground_f = ground_at(motion.station, x[2], body.tyre_f, body.static_f, road)
    ground_r = ground_at(motion.station - wheels.wheelbase, x[3], body.tyre_r, body.static_r, road)
    suspension_f, suspension_r = suspension_forces(x, body)
    if standing:
        front = standing_axle(ground_f, suspension_f, wheels)
        rear = standing_axle(ground_r, suspension_r, wheels)
    else:
        front = rolling_axle(
            ground_f, motion.speed, motion.omega_f, suspension_f, pressure, scale_f, step,
            wheels.front, chassis, tyre,
        )  # fmt: skip
        rear = rolling_axle(
            ground_r, motion.speed, motion.omega_r, suspension_r, pressure, scale_r, step,
            wheels.rear, chassis, tyre,
        )  # fmt: skip
    slope_f, slope_r = ground_f.load * ground_f.slope, ground_r.load * ground_r.slope
    drag = wheels.mass * wheels.coast
    acceleration = 0.0
    if not (standing or held):
        acceleration = -(front.tyre_force + rear.tyre_force + slope_f + slope_r + drag) / wheels.mass
    link_f = front.tyre_force + slope_f + body.unsprung_f * acceleration
    link_r = rear.tyre_force + slope_r + body.unsprung_r * acceleration
    pitch_moment = (link_f + link_r) * chassis.lever + front.brake_torque + rear.brake_torque
    return Ports(front, rear, -slope_f - slope_r, drag, acceleration, pitch_moment)
