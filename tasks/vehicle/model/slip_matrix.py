"""The stiff part of the coupled model: derivatives that tie speed and wheel speeds to each other through slip."""

from math import sqrt
from typing import NamedTuple

from numba.extending import register_jitable

from tasks.vehicle.effects.chassis import compute_effective_slope, compute_stick_share
from tasks.vehicle.model.axle_ports import AxlePorts, compute_lock_share, compute_relaxation_rate
from tasks.vehicle.model.chassis import Chassis
from tasks.vehicle.model.states import AxleMemory, Memory, Motion
from tasks.vehicle.paper.wheels import Axle
from tasks.vehicle.tyres.contract import Tyre

GAMMA = 1.0 - sqrt(0.5)
"""Coefficient of ROS2 with which it damps stiff modes (L-stability)."""


class AxleSlope(NamedTuple):
    """Derivatives of the vehicle's acceleration and one axle's wheel acceleration by speed and wheel speed.

    A tyre with a relaxation length has its slip as a further state. That state is eliminated: the first four entries
    hold the coupling that remains, and the last five restore the slip afterwards.

    Parameters
    ----------
    speed_by_speed, speed_by_wheel : derivatives of dv/dt [1/s, m/s]
    wheel_by_speed, wheel_by_wheel : derivatives of domega/dt [1/(m s), 1/s]
    speed_by_slip, wheel_by_slip : derivatives of both by the rate of the eliminated slip; 0 without one [m/s, 1/s]
    slip_by_speed, slip_by_wheel : derivatives of that rate by dv/dt and domega/dt [s/m, s]
    slip_share : share of that rate that remains [1]
    """

    speed_by_speed: float
    speed_by_wheel: float
    wheel_by_speed: float
    wheel_by_wheel: float
    speed_by_slip: float
    wheel_by_slip: float
    slip_by_speed: float
    slip_by_wheel: float
    slip_share: float


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_axle_slope(
    ports: AxlePorts,
    motion: Motion,
    omega: float,
    step: float,
    axle: Axle,
    chassis: Chassis,
    tyre: Tyre,
) -> AxleSlope:
    """Return the derivatives of speed and wheel rate through the slip of one axle.

    What is stiff counts as soon as the wheel can reach it within the step: the pad friction of a locked wheel, the
    anti-lock brake, which takes all torque away within a few percent of slip, and the turn of a sticking tyre's force
    at slip 0. A wheel that is only met there after a step has swung through it, and swings on; its motion then hangs
    on rounding. The chord from slip 0, divided by gamma, ends the first stage short of slip 0.

    Parameters
    ----------
    ports : ports of the axle
    motion : longitudinal state
    omega : wheel speed of the axle [rad/s]
    step : length of the step [s]
    axle, chassis, tyre : the axle's wheels, and the vehicle on its surface
    """
    wheels = chassis.wheels
    slip_per_wheel = -wheels.radius / max(motion.speed, wheels.speed_floor)
    slip_per_speed = (
        (1.0 - ports.slip) / motion.speed if motion.speed > wheels.speed_floor else 1.0 / wheels.speed_floor
    )
    following = compute_relaxation_rate(motion.speed, wheels.speed_floor, chassis.effects.relaxation_length)
    force, torque, locking = 0.0, 0.0, 0.0
    change = step * (ports.lever * ports.tyre_force - ports.brake_torque) / axle.inertia
    if abs(ports.slip) < 1.0:
        share = compute_stick_share(motion.speed, chassis.effects)
        load = ports.ground.load
        force = compute_effective_slope(abs(ports.force_slip), load, share, tyre, chassis.effects) * load
        width = wheels.release_width * tyre.target_slip
        ahead = ports.slip + slip_per_wheel * change
        if share > 0.0 and ports.force_slip * ahead < 0.0:
            force = max(force, ports.tyre_force / ports.force_slip / GAMMA)
        enters = (
            max(ports.slip, ahead) > tyre.target_slip and min(ports.slip, ahead) < tyre.target_slip + width
        )
        if enters and motion.speed >= chassis.effects.abs_cutoff:
            turning = compute_lock_share(omega, chassis.lock_speed)
            torque = -ports.full_torque * turning / width
    if abs(omega) < chassis.lock_speed + abs(change):
        locking = (ports.full_torque * ports.abs_scale + abs(ports.shaft_torque)) / chassis.lock_speed
    slip_share, pushed, followed = 0.0, 0.0, 1.0
    if following > 0.0:
        slip_share = 1.0 / (1.0 + GAMMA * step * following)
        pushed = GAMMA * step * slip_share
        followed = pushed * following
    felt = force * followed
    moment = wheels.radius * felt - torque
    return AxleSlope(
        -felt * slip_per_speed / wheels.mass,
        -felt * slip_per_wheel / wheels.mass,
        moment * slip_per_speed / axle.inertia,
        (moment * slip_per_wheel - locking) / axle.inertia,
        -force * pushed / wheels.mass,
        wheels.radius * force * pushed / axle.inertia,
        followed * slip_per_speed,
        followed * slip_per_wheel,
        slip_share,
    )


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def drop_speed_coupling(slope: AxleSlope) -> AxleSlope:
    """Return the same derivatives for a speed that the driver holds constant."""
    return AxleSlope(
        0.0, 0.0, slope.wheel_by_speed, slope.wheel_by_wheel, 0.0, slope.wheel_by_slip, slope.slip_by_speed,
        slope.slip_by_wheel, slope.slip_share,
    )  # fmt: skip


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def solve_slip(
    rates: Motion, memory: Memory, front: AxleSlope, rear: AxleSlope, g: float
) -> tuple[Motion, Memory]:
    """Solve (1 - g J) k = rates, where J couples only speed, wheel speeds and the slip behind a relaxation length.

    Parameters
    ----------
    rates, memory : right-hand side, in motion and in memory
    front, rear : entries of J
    g : step times gamma [s]
    """
    pivot_f = 1.0 - g * front.wheel_by_wheel
    pivot_r = 1.0 - g * rear.wheel_by_wheel
    to_f, to_r = g * front.speed_by_wheel / pivot_f, g * rear.speed_by_wheel / pivot_r
    pivot_v = 1.0 - g * (front.speed_by_speed + rear.speed_by_speed)
    pivot_v -= g * (to_f * front.wheel_by_speed + to_r * rear.wheel_by_speed)
    omega_f = rates.omega_f + front.wheel_by_slip * memory.front.slip
    omega_r = rates.omega_r + rear.wheel_by_slip * memory.rear.slip
    pulled = front.speed_by_slip * memory.front.slip + rear.speed_by_slip * memory.rear.slip
    speed = (rates.speed + pulled + to_f * omega_f + to_r * omega_r) / pivot_v
    omega_f = (omega_f + g * front.wheel_by_speed * speed) / pivot_f
    omega_r = (omega_r + g * rear.wheel_by_speed * speed) / pivot_r
    return Motion(rates.station, speed, omega_f, omega_r), Memory(
        _restore_slip(memory.front, front, speed, omega_f), _restore_slip(memory.rear, rear, speed, omega_r)
    )


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def _restore_slip(memory: AxleMemory, slope: AxleSlope, speed: float, omega: float) -> AxleMemory:
    """Return the memory with its eliminated slip restored from the solved speed and wheel speed."""
    if slope.slip_share == 0.0:
        return memory
    slip = slope.slip_share * memory.slip + slope.slip_by_speed * speed + slope.slip_by_wheel * omega
    return AxleMemory(slip, memory.slip_heat, memory.disc_rise, memory.lateral)
