"""Slip, tyre force and torques of one axle at one instant, each by its own function."""

from typing import NamedTuple

from numba import njit
from numba.extending import register_jitable

from tasks.vehicle.brake import compute_abs_command, limit_abs_rate
from tasks.vehicle.effects.brake_line import compute_acting_pressure
from tasks.vehicle.effects.chassis import (
    compute_effective_friction,
    compute_lateral_reserve,
    compute_stick_share,
)
from tasks.vehicle.effects.equations import compute_friction_factor, compute_rolling_resistance
from tasks.vehicle.effects.lateral_force import NO_HOLD, LateralHold, compute_lateral_hold
from tasks.vehicle.effects.slots import PortSums
from tasks.vehicle.effects.table import EffectValues
from tasks.vehicle.model.chassis import Chassis
from tasks.vehicle.model.states import AxleMemory, Instant
from tasks.vehicle.model.vertical_ports import Ground, Strut
from tasks.vehicle.paper.wheels import Wheels
from tasks.vehicle.tyres.contract import Tyre

FormVariables = tuple[float, float, float, float, float, float, float, float, float]
"""Variables that a form can depend on, in the order of `VARIABLES`."""


class AxlePorts(NamedTuple):
    """Forces and torques at one axle.

    Parameters
    ----------
    ground : road height, slope and contact load
    slip : signed braking slip; negative where the tyre drives the vehicle [1]
    force_slip : slip that builds up the tyre's force; another one where the tyre has a relaxation length [1]
    tyre_force : braking force at the contact, rearward positive [N]
    abs_scale : share of the brake torque let through [1]
    full_torque : brake torque that the pressure gives to a turning wheel without ABS [N m]
    brake_torque : against the wheel's rotation [N m]
    shaft_torque : torque of the engine, against the wheel's rotation [N m]
    suspension_force : force of spring, damper and links [N]
    lever : lever of the tyre force about the wheel centre [m]
    ground_moment : moment of the contact load, against the wheel's rotation [N m]
    hold : hold of the tyres on the road, sideways
    """

    ground: Ground
    slip: float
    force_slip: float
    tyre_force: float
    abs_scale: float
    full_torque: float
    brake_torque: float
    shaft_torque: float
    suspension_force: float
    lever: float
    ground_moment: float
    hold: LateralHold = NO_HOLD


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def compute_signed_slip(speed: float, rim_speed: float, speed_floor: float) -> float:
    """Return the braking slip, negative for a driven wheel, within [-1, 1]; ISO 8855's slip is its negative [1].

    Parameters
    ----------
    speed : v [m/s]
    rim_speed : R omega [m/s]
    speed_floor : v_epsilon [m/s]
    """
    return min(max((speed - rim_speed) / max(speed, speed_floor), -1.0), 1.0)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_signed_friction(
    slip: float, load: float, share: float, tyre: Tyre, effects: EffectValues
) -> float:
    """Return the friction of the tyre, continued as an odd function to driving slip [1].

    Parameters
    ----------
    slip : signed braking slip [1]
    load : load of the axle [N]
    share : share of the tyre that sticks [1]
    tyre : the tyre on the surface
    effects : numbers of the vehicle's effects
    """
    friction = compute_effective_friction(abs(slip), load, share, tyre, effects)
    return friction if slip >= 0.0 else -friction


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_lock_share(omega: float, lock_speed: float) -> float:
    """Return the share of the brake torque that pad friction gives at a wheel speed: 1, but near standstill [1].

    Parameters
    ----------
    omega : wheel speed [rad/s]
    lock_speed : wheel speed below which pad friction is proportional to it [rad/s]
    """
    return min(max(omega / lock_speed, -1.0), 1.0)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def collect_form_variables(
    speed: float, load_ratio: float, strut: Strut, memory: AxleMemory, instant: Instant
) -> FormVariables:
    """Return the variables that a form at an axle can depend on, in the order of `VARIABLES`.

    Parameters
    ----------
    speed : speed of the vehicle [m/s]
    load_ratio : contact load over that at rest [1]
    strut, memory, instant : strut and memory of the axle, and inputs at this instant
    """
    return (
        instant.time, speed, instant.pressure, memory.disc_rise, instant.pressure_rate, load_ratio, strut.travel,
        strut.rate, instant.deceleration,
    )  # fmt: skip


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_relaxation_rate(speed: float, speed_floor: float, length: float) -> float:
    """Return the rate at which the slip that builds up force follows the slip, v / length; 0 without relaxation [1/s].

    Parameters
    ----------
    speed : speed of the vehicle [m/s]
    speed_floor : v_epsilon, the lowest speed that counts [m/s]
    length : relaxation length (Pacejka 2012, doi:10.1016/C2010-0-68548-8); 0 for none [m]
    """
    return max(speed, speed_floor) / length if length > 0.0 else 0.0


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_rolling_axle(
    ground: Ground,
    strut: Strut,
    speed: float,
    omega: float,
    memory: AxleMemory,
    scale: float,
    gain: float,
    shaft_torque: float,
    static_load: float,
    stiffness: float,
    step: float,
    instant: Instant,
    forms: PortSums,
    chassis: Chassis,
    tyre: Tyre,
) -> AxlePorts:
    """Return slip, tyre force and torques of one axle of a moving vehicle.

    Parameters
    ----------
    ground, strut : ground under the axle and strut above it
    speed : speed of the vehicle [m/s]
    omega : wheel speed [rad/s]
    memory : slip state, sliding energy and disc temperature of the axle
    scale : ABS scale one step before, from which its rate is limited [1]
    gain : brake torque per pressure [N m/MPa]
    shaft_torque : torque of the engine on turning wheels [N m]
    static_load, stiffness : load at rest and vertical stiffness of the tyre [N, N/m]
    step : length of the step [s]
    instant : inputs at this instant
    forms : what forms outside the library of effects add at the axle
    chassis, tyre : the vehicle on its surface
    """
    wheels, effects = chassis.wheels, chassis.effects
    slip = compute_signed_slip(speed, wheels.radius * omega, wheels.speed_floor)
    force_slip = memory.slip if effects.relaxation_length > 0.0 else slip
    load_ratio = ground.load / static_load
    grip = compute_friction_factor(effects, speed, load_ratio, memory.slip_heat, chassis.wet, chassis.grip)
    grip *= max(1.0 + forms.friction, 0.0)
    pressure = compute_acting_pressure(instant.pressure, speed, memory.disc_rise, effects)
    pressure *= max(1.0 + forms.brake_torque, 0.0)
    sticking = compute_stick_share(speed, effects)
    tyre_force = (
        compute_signed_friction(force_slip, ground.load, sticking, tyre, effects) * grip * ground.load
    )
    limit = tyre.peak * grip * ground.load
    hold = compute_lateral_hold(
        memory.lateral, tyre_force, strut.travel, strut.rate, speed, limit, sticking, effects
    )
    wanted = (
        compute_abs_command(slip, tyre.target_slip, wheels.release_width)
        if speed >= effects.abs_cutoff
        else 1.0
    )
    abs_scale = limit_abs_rate(wanted, scale, wheels.build_rate * step, wheels.release_rate * step)
    turning = compute_lock_share(omega, chassis.lock_speed)
    rubbing = effects.pad_drag / (wheels.front.brake_gain + wheels.rear.brake_gain)
    brake_torque = gain * (pressure * abs_scale + rubbing) * turning
    lever = wheels.radius - effects.radius_by_load * (ground.load - static_load) / stiffness
    offset = compute_rolling_resistance(effects, speed) * turning - effects.slope_moment * ground.slope
    ground_moment = ground.load * lever * offset
    return AxlePorts(
        ground, slip, force_slip, tyre_force, abs_scale, gain * pressure, brake_torque, shaft_torque * turning,
        strut.force, lever, ground_moment, hold,
    )  # fmt: skip


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_standing_axle(
    ground: Ground,
    strut: Strut,
    memory: AxleMemory,
    wheels: Wheels,
    pull: float,
    effects: EffectValues,
    tyre: Tyre,
) -> AxlePorts:
    """Return the ports of an axle at rest: the tyre holds the vehicle on the slope, the brake holds the wheel.

    Parameters
    ----------
    ground, strut : ground under the axle and strut above it
    memory : lateral deflection of the axle
    wheels : wheels, brakes and longitudinal values
    pull : part of the weight along the grade that the axle holds, rearward positive [N]
    effects : numbers of the vehicle's effects
    tyre : the tyre on the surface
    """
    tyre_force = -ground.load * ground.slope - pull
    hold = compute_lateral_hold(
        memory.lateral, tyre_force, strut.travel, strut.rate, 0.0, tyre.peak * ground.load, 1.0, effects
    )
    return AxlePorts(
        ground,
        0.0,
        0.0,
        tyre_force,
        1.0,
        0.0,
        wheels.radius * tyre_force,
        0.0,
        strut.force,
        wheels.radius,
        0.0,
        hold,
    )


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def add_link_force(ports: AxlePorts, force: float) -> AxlePorts:
    """Return the ports with a force of the links in parallel to spring and damper.

    Parameters
    ----------
    ports : ports of the axle
    force : force of the links; it pulls body and wheel together where positive [N]
    """
    return AxlePorts(
        ports.ground, ports.slip, ports.force_slip, ports.tyre_force, ports.abs_scale, ports.full_torque,
        ports.brake_torque, ports.shaft_torque, ports.suspension_force + force, ports.lever, ports.ground_moment,
        ports.hold,
    )  # fmt: skip


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_vertical_force(ports: AxlePorts, effects: EffectValues) -> float:
    """Return the force that the road passes to the axle upwards [N].

    On a slope the braking force points along the road: it pulls a climbing wheel down and lifts a descending one.

    Parameters
    ----------
    ports : ports of the axle
    effects : numbers of the vehicle's effects
    """
    return ports.ground.load - effects.force_tilt * ports.tyre_force * ports.ground.slope


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_axle_lateral_reserve(ports: AxlePorts, tyre: Tyre) -> float:
    """Return the lateral friction that an axle has left; 0 off the road [1].

    Parameters
    ----------
    ports : ports of the axle
    tyre : the tyre on the surface
    """
    if ports.ground.load <= 0.0:
        return 0.0
    return compute_lateral_reserve(ports.tyre_force / ports.ground.load, tyre.peak)
