"""Coupled mode's physics at one instant: every force where it meets the vehicle, each with its own function.

The ports are, in the order they are worked out: road, load, slip, friction, tyre force, brake torque,
suspension force, drag, pitch moment. An effect that the model lacks acts on exactly one of them.
"""

from typing import NamedTuple

from numba import njit

from tasks.vehicle.brake import abs_command, abs_update
from tasks.vehicle.effects.chassis import (
    ChassisEffects,
    added_strut_force,
    air_drag,
    chassis_effects,
    effective_friction,
    footprint,
    grip_reserve,
    grip_share,
    link_lift,
    stick_share,
)
from tasks.vehicle.half_car import HalfCar, HalfCarState, contact_load, half_car, suspension_forces
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.road import RoadFeature
from tasks.vehicle.tyre import TyreCurve
from tasks.vehicle.wheels import Axle, Wheels, wheels_of


class Chassis(NamedTuple):
    """The whole vehicle as the coupled kernel takes it.

    Parameters
    ----------
    body : the half-car
    wheels : wheels, brakes and longitudinal values
    lever : height of the body's centre of gravity above the wheel centres [m]
    lock_speed : wheel speed below which brake friction is proportional to it [rad/s]
    transfer : height of the centre of gravity over the wheelbase [1]
    effects : what is added to the paper's model
    """

    body: HalfCar
    wheels: Wheels
    lever: float
    lock_speed: float
    transfer: float
    effects: ChassisEffects


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
        transfer=vehicle.cg_height / vehicle.wheelbase,
        effects=chassis_effects(vehicle.effects),
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
    suspension_force : spring, damper and what the links pass on [N]
    lever : of the tyre force about the wheel centre [m]
    ground_moment : of the ground's load, against the wheel's rotation [N m]
    """

    ground: Ground
    slip: float
    tyre_force: float
    abs_scale: float
    brake_torque: float
    suspension_force: float
    lever: float
    ground_moment: float


class Ports(NamedTuple):
    """What acts on the vehicle at one instant.

    Parameters
    ----------
    front, rear : the axles
    road_force : horizontal part of the contact loads on the slope, forward positive [N]
    drag : of coasting and of the air, rearward positive [N]
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
def signed_friction(slip: float, share: float, tyre: TyreCurve, effects: ChassisEffects) -> float:
    """Friction of the tyre, continued oddly to driving slip [1].

    Parameters
    ----------
    slip : signed braking slip [1]
    share : of the tyre that sticks [1]
    tyre : the scaled curve
    effects : the numbers
    """
    friction = effective_friction(abs(slip), share, tyre, effects)
    return friction if slip >= 0.0 else -friction


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
    station: float,
    speed: float,
    unsprung_height: float,
    unsprung_rate: float,
    stiffness: float,
    static_load: float,
    road: RoadFeature,
    effects: ChassisEffects,
) -> Ground:
    """Road and load under one axle.

    Parameters
    ----------
    station : of the axle [m]
    speed : of the vehicle [m/s]
    unsprung_height, unsprung_rate : of the axle [m, m/s]
    stiffness : of the tyre [N/m]
    static_load : half-car's load at rest [N]
    road : the feature
    effects : the numbers
    """
    height, slope = footprint(station, road, effects)
    load = contact_load(height, unsprung_height, stiffness, static_load)
    if load > 0.0:
        load = max(load + effects.tyre_damping * (speed * slope - unsprung_rate), 0.0)
    return Ground(height, slope, load)


@njit(cache=True, nogil=True)
def rolling_axle(
    ground: Ground,
    speed: float,
    omega: float,
    suspension_force: float,
    pressure: float,
    scale: float,
    step: float,
    static_load: float,
    stiffness: float,
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
    pressure : brake pressure as it acts [MPa]
    scale : ABS scale one step before, from which its rate is limited [1]
    step : [s]
    static_load, stiffness : of the tyre [N, N/m]
    axle, chassis, tyre : the values
    """
    wheels, effects = chassis.wheels, chassis.effects
    slip = signed_slip(speed, wheels.radius * omega, wheels.speed_floor)
    grip = grip_share(speed, ground.load / static_load, effects)
    tyre_force = signed_friction(slip, stick_share(speed, effects), tyre, effects) * grip * ground.load
    wanted = abs_command(slip, tyre.target_slip, wheels.release_width) if speed >= effects.abs_cutoff else 1.0
    abs_scale = abs_update(wanted, scale, wheels.build_rate * step, wheels.release_rate * step)
    turning = lock_share(omega, chassis.lock_speed)
    rubbing = effects.pad_drag / (wheels.front.brake_gain + wheels.rear.brake_gain)
    brake_torque = axle.brake_gain * (pressure * abs_scale + rubbing) * turning
    lever = wheels.radius - effects.radius_by_load * (ground.load - static_load) / stiffness
    rolling = effects.rolling_coefficient + effects.rolling_speed * speed
    offset = rolling * turning - effects.slope_moment * ground.slope
    ground_moment = ground.load * lever * offset
    return AxlePorts(
        ground, slip, tyre_force, abs_scale, brake_torque, suspension_force, lever, ground_moment
    )


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
    return AxlePorts(
        ground, 0.0, tyre_force, 1.0, wheels.radius * tyre_force, suspension_force, wheels.radius, 0.0
    )


@njit(cache=True, nogil=True)
def with_links(ports: AxlePorts, force: float) -> AxlePorts:
    """The same ports with a force of the links in parallel to spring and damper.

    Parameters
    ----------
    ports : of the axle
    force : pulls body and wheel together where positive [N]
    """
    return AxlePorts(
        ports.ground, ports.slip, ports.tyre_force, ports.abs_scale, ports.brake_torque,
        ports.suspension_force + force, ports.lever, ports.ground_moment,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def reserve_of(ports: AxlePorts, tyre: TyreCurve) -> float:
    """Sideways grip that an axle has left; none off the road [1].

    Parameters
    ----------
    ports : of the axle
    tyre : the scaled curve
    """
    if ports.ground.load <= 0.0:
        return 0.0
    return grip_reserve(ports.tyre_force / ports.ground.load, tyre.peak)


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
    body, wheels, effects = chassis.body, chassis.wheels, chassis.effects
    ground_f = ground_at(motion.station, motion.speed, x[2], x[6], body.tyre_f, body.static_f, road, effects)
    behind = motion.station - wheels.wheelbase
    ground_r = ground_at(behind, motion.speed, x[3], x[7], body.tyre_r, body.static_r, road, effects)
    suspension_f, suspension_r = suspension_forces(x, body)
    travel_f, rate_f = x[0] - x[2] - body.to_front * x[1], x[4] - x[6] - body.to_front * x[5]
    travel_r, rate_r = x[0] - x[3] + body.to_rear * x[1], x[4] - x[7] + body.to_rear * x[5]
    suspension_f += added_strut_force(travel_f, rate_f, body.damper_f, effects)
    suspension_r += added_strut_force(travel_r, rate_r, body.damper_r, effects)
    if standing:
        front = standing_axle(ground_f, suspension_f, wheels)
        rear = standing_axle(ground_r, suspension_r, wheels)
    else:
        front = rolling_axle(
            ground_f, motion.speed, motion.omega_f, suspension_f, pressure, scale_f, step,
            body.static_f, body.tyre_f, wheels.front, chassis, tyre,
        )  # fmt: skip
        rear = rolling_axle(
            ground_r, motion.speed, motion.omega_r, suspension_r, pressure, scale_r, step,
            body.static_r, body.tyre_r, wheels.rear, chassis, tyre,
        )  # fmt: skip
    share = 0.0 if standing else stick_share(motion.speed, effects)
    lift_f = link_lift(front.tyre_force, chassis.transfer, effects.anti_dive, effects.stick_anti_dive, share)
    lift_r = link_lift(rear.tyre_force, chassis.transfer, effects.anti_lift, effects.stick_anti_lift, share)
    if effects.scrub_stiffness != 0.0 and not standing:
        scrub = effects.scrub_stiffness * (1.0 - share)
        lift_f -= scrub * body.spring_f * travel_f * reserve_of(front, tyre)
        lift_r += scrub * body.spring_r * travel_r * reserve_of(rear, tyre)
    front, rear = with_links(front, -lift_f), with_links(rear, lift_r)
    slope_f, slope_r = ground_f.load * ground_f.slope, ground_r.load * ground_r.slope
    drag = wheels.mass * wheels.coast + air_drag(motion.speed, effects)
    acceleration = 0.0
    if not (standing or held):
        acceleration = -(front.tyre_force + rear.tyre_force + slope_f + slope_r + drag) / wheels.mass
    link_f = front.tyre_force + slope_f + body.unsprung_f * acceleration
    link_r = rear.tyre_force + slope_r + body.unsprung_r * acceleration
    pitch_moment = (link_f + link_r) * chassis.lever + front.brake_torque + rear.brake_torque
    return Ports(front, rear, -slope_f - slope_r, drag, acceleration, pitch_moment)
