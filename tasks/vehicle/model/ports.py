"""Forces and moments of the coupled model at one instant, each computed by its own function.

A port is a place where a force or moment enters the equations of motion. The ports are, in the order of computation:
road, load, suspension force, slip, friction, tyre force, brake torque, drag, pitch moment, lift. An effect that the
model lacks acts on exactly one of them.
"""

from typing import NamedTuple

from numba.extending import register_jitable

from tasks.vehicle.effects.chassis import compute_link_force, compute_stick_share
from tasks.vehicle.effects.equations import compute_engine_torque, compute_resistance
from tasks.vehicle.effects.slots import NO_SUMS, SlotTables, sum_slots
from tasks.vehicle.half_car import HalfCarState
from tasks.vehicle.model.axle_ports import (
    AxlePorts,
    add_link_force,
    collect_form_variables,
    compute_axle_lateral_reserve,
    compute_rolling_axle,
    compute_standing_axle,
)
from tasks.vehicle.model.chassis import Chassis
from tasks.vehicle.model.states import Instant, Memory, Motion
from tasks.vehicle.model.vertical_ports import compute_ground, compute_struts
from tasks.vehicle.road import RoadFeature
from tasks.vehicle.tyres.contract import Tyre


class Ports(NamedTuple):
    """Forces and moments on the vehicle at one instant.

    Parameters
    ----------
    front, rear : the axles
    road_force : horizontal part of the contact loads on the slope, forward positive [N]
    drag : force of coasting, air, snow and grade, rearward positive [N]
    acceleration : dv/dt [m/s2]
    pitch_moment : pitch moment on the body, nose-down positive [N m]
    lift : aerodynamic lift on the body's centre of gravity [N]
    """

    front: AxlePorts
    rear: AxlePorts
    road_force: float
    drag: float
    acceleration: float
    pitch_moment: float
    lift: float


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_brake_gains(pressure: float, chassis: Chassis) -> tuple[float, float]:
    """Return the brake torque per pressure of the front and the rear axle, never negative [N m/MPa].

    Parameters
    ----------
    pressure : pressure at the pads, which changes the front axle's share [MPa]
    chassis : the vehicle on its surface
    """
    front, rear = chassis.wheels.front.brake_gain, chassis.wheels.rear.brake_gain
    moved = min(max(chassis.effects.bias_pressure * pressure * (front + rear), -front), rear)
    return front + moved, rear - moved


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_ports(
    motion: Motion,
    memory: Memory,
    x: HalfCarState,
    instant: Instant,
    scale_f: float,
    scale_r: float,
    step: float,
    forms: SlotTables | None,
    chassis: Chassis,
    tyre: Tyre,
    road: RoadFeature,
) -> Ports:
    """Return all forces and moments that act on the vehicle in one state.

    The body's pitch moment follows from the forces at the ground: each axle passes its longitudinal link force
    on at wheel height, and its brake and shaft torques. This equals F_x at the ground times the height of the body's
    centre of gravity, less the inertia of axles and wheels. A measured engine torque is divided between the axles as
    the brake torque is, because no vehicle file names the driven axle.

    Parameters
    ----------
    motion, memory, x : longitudinal state, memory of tyres and discs, half-car state
    instant : inputs at this instant
    scale_f, scale_r : ABS scales one step before [1]
    step : length of the step [s]
    forms : forms outside the library of effects, or None
    chassis, tyre, road : the vehicle on its surface, and the road feature
    """
    body, wheels, effects = chassis.body, chassis.wheels, chassis.effects
    speed, standing = motion.speed, instant.standing
    ground_f = compute_ground(motion.station, speed, x[2], x[6], body.tyre_f, body.static_f, road, effects)
    behind = motion.station - wheels.wheelbase
    ground_r = compute_ground(behind, speed, x[3], x[7], body.tyre_r, body.static_r, road, effects)
    strut_f, strut_r = compute_struts(x, chassis)
    forms_f = forms_r = NO_SUMS
    if forms is not None:
        forms_f = sum_slots(
            collect_form_variables(speed, ground_f.load / body.static_f, strut_f, memory.front, instant),
            forms,
        )
        forms_r = forms_f
        if forms.by_axle:
            forms_r = sum_slots(
                collect_form_variables(speed, ground_r.load / body.static_r, strut_r, memory.rear, instant),
                forms,
            )
    if standing:
        pull = wheels.mass * instant.climb / (body.static_f + body.static_r)
        front, rear = (
            compute_standing_axle(
                ground_f, strut_f, memory.front, wheels, body.static_f * pull, effects, tyre
            ),
            compute_standing_axle(
                ground_r, strut_r, memory.rear, wheels, body.static_r * pull, effects, tyre
            ),
        )
    else:
        gain_f, gain_r = compute_brake_gains(instant.pressure, chassis)
        share = gain_f / (gain_f + gain_r)
        engine = compute_engine_torque(effects, motion.omega_f, wheels.radius) - share * instant.engine
        engine_r = -(1.0 - share) * instant.engine
        front = compute_rolling_axle(
            ground_f, strut_f, speed, motion.omega_f, memory.front, scale_f, gain_f, engine, body.static_f,
            body.tyre_f, step, instant, forms_f, chassis, tyre,
        )  # fmt: skip
        rear = compute_rolling_axle(
            ground_r, strut_r, speed, motion.omega_r, memory.rear, scale_r, gain_r, engine_r, body.static_r,
            body.tyre_r, step, instant, forms_r, chassis, tyre,
        )  # fmt: skip
    share = 0.0 if standing else compute_stick_share(speed, effects)
    lift_f = compute_link_force(
        front.tyre_force, chassis.transfer, effects.anti_dive, effects.stick_anti_dive, share
    )
    lift_r = compute_link_force(
        rear.tyre_force, chassis.transfer, effects.anti_lift, effects.stick_anti_lift, share
    )
    if effects.scrub_stiffness != 0.0 and not standing:
        scrub = effects.scrub_stiffness * (1.0 - share)
        lift_f -= scrub * body.spring_f * strut_f.travel * compute_axle_lateral_reserve(front, tyre)
        lift_r += scrub * body.spring_r * strut_r.travel * compute_axle_lateral_reserve(rear, tyre)
    slope_f, slope_r = ground_f.load * ground_f.slope, ground_r.load * ground_r.slope
    drag = wheels.mass * wheels.coast + compute_resistance(
        effects, speed, chassis.direction, chassis.snow_depth_mm
    )
    drag += wheels.mass * instant.climb
    moment = effects.aero_pitch * speed * speed
    lift_f -= front.hold.link_force + forms_f.suspension_force
    lift_r += rear.hold.link_force + forms_r.suspension_force
    drag += forms_f.longitudinal_force
    moment += forms_f.pitch_moment
    front, rear = add_link_force(front, -lift_f), add_link_force(rear, lift_r)
    acceleration = 0.0
    if not (standing or instant.held):
        acceleration = -(front.tyre_force + rear.tyre_force + slope_f + slope_r + drag) / wheels.mass
    link_f = front.tyre_force + slope_f + body.unsprung_f * (acceleration + instant.climb)
    link_r = rear.tyre_force + slope_r + body.unsprung_r * (acceleration + instant.climb)
    braking = (link_f + link_r) * chassis.lever + front.brake_torque + rear.brake_torque
    braking += front.shaft_torque + rear.shaft_torque
    if (
        instant.held
    ):  # what holds the speed drives at the ground, as the tyres of a standing car hold it there
        braking -= wheels.mass * instant.climb * (chassis.lever + wheels.radius)
    moment += braking * (1.0 + effects.pitch_gain)
    return Ports(
        front, rear, -slope_f - slope_r, drag, acceleration, moment, effects.aero_lift * speed * speed
    )
