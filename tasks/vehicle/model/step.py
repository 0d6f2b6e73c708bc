"""One step of the model, by a W-method of second order.

The method is ROS2 (Verwer et al. 1999, doi:10.1137/S1064827597326651), which keeps its order for any matrix in
the place of the Jacobian. Here that matrix holds only the stiff coupling of speed and wheel speeds through slip, so
that wheel speeds do not oscillate near standstill. For all other states (body, axles, road, heat) the method is Heun's.
"""

from numba import njit
from numba.extending import register_jitable

from tasks.vehicle.effects.brake_line import DISC_CAPACITY_F, DISC_CAPACITY_R, compute_disc_temperature_rate
from tasks.vehicle.effects.slots import SlotTables
from tasks.vehicle.half_car import HalfCarState, advance_half_car, compute_half_car_rates
from tasks.vehicle.model.axle_ports import AxlePorts, compute_relaxation_rate, compute_vertical_force
from tasks.vehicle.model.chassis import Chassis
from tasks.vehicle.model.ports import Ports, compute_ports
from tasks.vehicle.model.slip_matrix import GAMMA, compute_axle_slope, drop_speed_coupling, solve_slip
from tasks.vehicle.model.states import AxleMemory, Instant, Memory, Motion, advance_axle, advance_motion
from tasks.vehicle.paper.wheels import Axle
from tasks.vehicle.road import RoadFeature
from tasks.vehicle.tyres.contract import Tyre


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def compute_wheel_rate(ports: AxlePorts, axle: Axle) -> float:
    """Return the angular acceleration of an axle's wheels [rad/s2].

    Parameters
    ----------
    ports : ports of the axle
    axle : wheels of the axle
    """
    torque = ports.lever * ports.tyre_force - ports.brake_torque - ports.ground_moment - ports.shaft_torque
    return torque / axle.inertia


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_axle_memory_rate(
    memory: AxleMemory, ports: AxlePorts, speed: float, omega: float, disc_capacity: float, chassis: Chassis
) -> AxleMemory:
    """Return the rates of an axle's slip state, sliding energy, disc temperature and lateral deflection.

    Parameters
    ----------
    memory, ports : memory and ports of the axle
    speed : speed of the vehicle [m/s]
    omega : wheel speed [rad/s]
    disc_capacity : heat capacity of the axle's discs [J/K]
    chassis : the vehicle on its surface
    """
    following = compute_relaxation_rate(speed, chassis.wheels.speed_floor, chassis.effects.relaxation_length)
    return AxleMemory(
        following * (ports.slip - memory.slip),
        abs(ports.tyre_force * ports.force_slip) * speed,
        compute_disc_temperature_rate(memory.disc_rise, ports.brake_torque * omega, disc_capacity),
        ports.hold.rate,
    )


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_motion_rates(motion: Motion, ports: Ports, standing: bool, chassis: Chassis) -> Motion:
    """Return the rates of station, speed and wheel speeds (paper, Eq. app_longitudinal_complete).

    Parameters
    ----------
    motion : longitudinal state
    ports : forces and moments in that state
    standing : the vehicle has come to rest
    chassis : the vehicle on its surface
    """
    if standing:
        return Motion(0.0, 0.0, 0.0, 0.0)
    wheels = chassis.wheels
    return Motion(
        motion.speed,
        ports.acceleration,
        compute_wheel_rate(ports.front, wheels.front),
        compute_wheel_rate(ports.rear, wheels.rear),
    )


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_memory_rates(memory: Memory, motion: Motion, ports: Ports, chassis: Chassis) -> Memory:
    """Return the rates of both axles' slip states, sliding energies, disc temperatures and lateral deflections.

    Parameters
    ----------
    memory, motion : memory of the axles and longitudinal state
    ports : forces and moments in that state
    chassis : the vehicle on its surface
    """
    front, rear, speed = ports.front, ports.rear, motion.speed
    return Memory(
        compute_axle_memory_rate(memory.front, front, speed, motion.omega_f, DISC_CAPACITY_F, chassis),
        compute_axle_memory_rate(memory.rear, rear, speed, motion.omega_r, DISC_CAPACITY_R, chassis),
    )


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_body_rates(x: HalfCarState, ports: Ports, chassis: Chassis) -> HalfCarState:
    """Return the rate of the half-car state under the forces of the ports (paper, Eq. app_half_car_complete).

    Parameters
    ----------
    x : half-car state [m, rad, m/s, rad/s]
    ports : forces and moments in that state
    chassis : the vehicle on its surface
    """
    return compute_half_car_rates(
        x,
        compute_vertical_force(ports.front, chassis.effects),
        compute_vertical_force(ports.rear, chassis.effects),
        ports.front.suspension_force,
        ports.rear.suspension_force,
        ports.pitch_moment,
        ports.lift,
        chassis.body,
    )


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def take_step(
    motion: Motion,
    memory: Memory,
    x: HalfCarState,
    ports: Ports,
    instant: Instant,
    next_instant: Instant,
    step: float,
    forms: SlotTables | None,
    chassis: Chassis,
    tyre: Tyre,
    road: RoadFeature,
) -> tuple[Motion, Memory, HalfCarState]:
    """Take one ROS2 step from a state whose ports are known.

    Parameters
    ----------
    motion, memory, x : longitudinal state, memory of tyres and discs, half-car state
    ports : forces and moments in that state
    instant, next_instant : inputs before and after the step
    step : length of the step [s]
    forms : forms outside the library of effects, or None
    chassis, tyre, road : the vehicle on its surface, and the road feature

    Returns
    -------
    The three states after the step.
    """
    wheels = chassis.wheels
    front = compute_axle_slope(ports.front, motion, motion.omega_f, step, wheels.front, chassis, tyre)
    rear = compute_axle_slope(ports.rear, motion, motion.omega_r, step, wheels.rear, chassis, tyre)
    if instant.held:
        front, rear = drop_speed_coupling(front), drop_speed_coupling(rear)
    f1 = compute_motion_rates(motion, ports, instant.standing, chassis)
    k1, m1 = solve_slip(f1, compute_memory_rates(memory, motion, ports, chassis), front, rear, GAMMA * step)
    h1 = compute_body_rates(x, ports, chassis)
    ahead, x_ahead = advance_motion(motion, k1, step), advance_half_car(x, h1, step)
    memory_ahead = Memory(
        advance_axle(memory.front, m1.front, step), advance_axle(memory.rear, m1.rear, step)
    )
    later = compute_ports(
        ahead, memory_ahead, x_ahead, next_instant, ports.front.abs_scale, ports.rear.abs_scale, step, forms,
        chassis, tyre, road,
    )  # fmt: skip
    f2 = compute_motion_rates(ahead, later, instant.standing, chassis)
    g2 = compute_memory_rates(memory_ahead, ahead, later, chassis)
    k2, m2 = solve_slip(
        advance_motion(f2, k1, -2.0),
        Memory(advance_axle(g2.front, m1.front, -2.0), advance_axle(g2.rear, m1.rear, -2.0)),
        front,
        rear,
        GAMMA * step,
    )
    h2 = compute_body_rates(x_ahead, later, chassis)
    after = Motion(
        motion.station + step * (1.5 * k1.station + 0.5 * k2.station),
        motion.speed + step * (1.5 * k1.speed + 0.5 * k2.speed),
        motion.omega_f + step * (1.5 * k1.omega_f + 0.5 * k2.omega_f),
        motion.omega_r + step * (1.5 * k1.omega_r + 0.5 * k2.omega_r),
    )
    remembered = Memory(
        _advance_axle_twice(memory.front, m1.front, m2.front, step),
        _advance_axle_twice(memory.rear, m1.rear, m2.rear, step),
    )
    return after, remembered, advance_half_car(advance_half_car(x, h1, 0.5 * step), h2, 0.5 * step)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def _advance_axle_twice(memory: AxleMemory, k1: AxleMemory, k2: AxleMemory, step: float) -> AxleMemory:
    """Return the memory after both stages of ROS2, with their weights 3/2 and 1/2."""
    return advance_axle(advance_axle(memory, k1, 1.5 * step), k2, 0.5 * step)
