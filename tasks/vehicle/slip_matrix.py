"""The stiff part of coupled mode: how speed and wheel speeds answer to each other through slip."""

from typing import NamedTuple

from numba import njit

from tasks.vehicle.effects.chassis import effective_slope, stick_share
from tasks.vehicle.ports import AxlePorts, Chassis, Motion, lock_share
from tasks.vehicle.tyre import TyreCurve
from tasks.vehicle.wheels import Axle


class AxleSlope(NamedTuple):
    """How one axle's wheel and the vehicle's speed answer to each other, per wheel speed and per speed [1/s].

    Parameters
    ----------
    speed_by_speed, speed_by_wheel : change of dv/dt
    wheel_by_speed, wheel_by_wheel : change of domega/dt
    """

    speed_by_speed: float
    speed_by_wheel: float
    wheel_by_speed: float
    wheel_by_wheel: float


@njit(cache=True, nogil=True)
def axle_slope(
    ports: AxlePorts,
    motion: Motion,
    omega: float,
    pressure: float,
    step: float,
    axle: Axle,
    chassis: Chassis,
    tyre: TyreCurve,
) -> AxleSlope:
    """Derivatives of speed and wheel rate through the slip of one axle.

    The brake friction of a standing wheel counts as soon as the wheel can come to stand within the step.

    Parameters
    ----------
    ports : of the axle
    motion : longitudinal state
    omega : wheel speed of the axle [rad/s]
    pressure : [MPa]
    step : [s]
    axle, chassis, tyre : the values
    """
    wheels = chassis.wheels
    slip_per_wheel = -wheels.radius / max(motion.speed, wheels.speed_floor)
    slip_per_speed = (
        (1.0 - ports.slip) / motion.speed if motion.speed > wheels.speed_floor else 1.0 / wheels.speed_floor
    )
    full_torque = axle.brake_gain * pressure
    force, torque, locking = 0.0, 0.0, 0.0
    if abs(ports.slip) < 1.0:
        share = stick_share(motion.speed, chassis.effects)
        force = effective_slope(abs(ports.slip), share, tyre, chassis.effects) * ports.ground.load
        if 0.0 < ports.abs_scale < 1.0:
            turning = lock_share(omega, chassis.lock_speed)
            torque = -full_torque * turning / (wheels.release_width * tyre.target_slip)
    change = step * abs(ports.lever * ports.tyre_force - ports.brake_torque) / axle.inertia
    if abs(omega) < chassis.lock_speed + change:
        locking = full_torque * ports.abs_scale / chassis.lock_speed
    moment = wheels.radius * force - torque
    return AxleSlope(
        -force * slip_per_speed / wheels.mass,
        -force * slip_per_wheel / wheels.mass,
        moment * slip_per_speed / axle.inertia,
        (moment * slip_per_wheel - locking) / axle.inertia,
    )


@njit(cache=True, nogil=True)
def without_speed(slope: AxleSlope) -> AxleSlope:
    """The same derivatives while the speed is held from outside."""
    return AxleSlope(0.0, 0.0, slope.wheel_by_speed, slope.wheel_by_wheel)


@njit(cache=True, nogil=True)
def solve_slip(rates: Motion, front: AxleSlope, rear: AxleSlope, g: float) -> Motion:
    """Solve (1 - g J) k = rates, where J couples only speed and wheel speeds.

    Parameters
    ----------
    rates : right-hand side
    front, rear : the entries of J
    g : step times gamma [s]
    """
    pivot_f = 1.0 - g * front.wheel_by_wheel
    pivot_r = 1.0 - g * rear.wheel_by_wheel
    to_f, to_r = g * front.speed_by_wheel / pivot_f, g * rear.speed_by_wheel / pivot_r
    pivot_v = 1.0 - g * (front.speed_by_speed + rear.speed_by_speed)
    pivot_v -= g * (to_f * front.wheel_by_speed + to_r * rear.wheel_by_speed)
    speed = (rates.speed + to_f * rates.omega_f + to_r * rates.omega_r) / pivot_v
    return Motion(
        rates.station,
        speed,
        (rates.omega_f + g * front.wheel_by_speed * speed) / pivot_f,
        (rates.omega_r + g * rear.wheel_by_speed * speed) / pivot_r,
    )
