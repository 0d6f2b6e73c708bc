"""State of the model: motion along the road, half-car, memory of tyres, discs and brake line, and events."""

from math import inf
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from tasks.vehicle.half_car import HalfCarState


class Motion(NamedTuple):
    """Longitudinal state: station [m], speed [m/s], wheel speeds of the axles [rad/s]."""

    station: float
    speed: float
    omega_f: float
    omega_r: float


class AxleMemory(NamedTuple):
    """Slip state, sliding energy and disc temperature of an axle, which depend on the earlier motion.

    Parameters
    ----------
    slip : slip that builds up the force where the tyre has a relaxation length, else 0 [1]
    slip_heat : energy of sliding since the start [J]
    disc_rise : temperature of the discs above ambient [K]
    lateral : lateral deflection of the tyres where they have a lateral stiffness, else 0 [m]
    """

    slip: float
    slip_heat: float
    disc_rise: float
    lateral: float = 0.0


class Memory(NamedTuple):
    """Memory of both axles."""

    front: AxleMemory
    rear: AxleMemory


class Instant(NamedTuple):
    """Inputs of the equations of motion at one instant.

    Parameters
    ----------
    time : time since the start [s]
    pressure, pressure_rate : pressure at the pads and its rate [MPa, MPa/s]
    deceleration : -dv/dt of the evaluation before, for forms that depend on it [m/s2]
    standing : the vehicle has come to rest
    held : the driver holds its speed
    engine : torque of the engine at the wheels, driving positive [N m]
    climb : deceleration that the grade of the road causes [m/s2]
    """

    time: float
    pressure: float
    pressure_rate: float
    deceleration: float
    standing: bool
    held: bool
    engine: float
    climb: float


STATE_WIDTH = 29
"""Number of values in a state's row."""


class VehicleState(NamedTuple):
    """Complete state of a run at one instant, from which the run can continue.

    Parameters
    ----------
    time : time since the start of the run [s]
    motion, memory, body : states that are integrated
    line : pressure at the pads [MPa]
    scale_f, scale_r : ABS scales one step before [1]
    deceleration : -dv/dt of the evaluation before [m/s2]
    standing : the vehicle has come to rest
    onset, onset_station, stop : brake onset [s], the station there [m], and the stop [s]; infinite before they come
    """

    time: float
    motion: Motion
    memory: Memory
    body: HalfCarState
    line: float
    scale_f: float
    scale_r: float
    deceleration: float
    standing: bool
    onset: float
    onset_station: float
    stop: float


@register_jitable(cache=True)
def pack_state(state: VehicleState) -> tuple[float, ...]:
    """Return a state as a row of numbers; `unpack_state` is the inverse."""
    motion, front, rear, x = state.motion, state.memory.front, state.memory.rear, state.body
    return (
        state.time, motion.station, motion.speed, motion.omega_f, motion.omega_r, front.slip, front.slip_heat,
        front.disc_rise, rear.slip, rear.slip_heat, rear.disc_rise, x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7],
        state.line, state.scale_f, state.scale_r, state.deceleration, 1.0 if state.standing else 0.0, state.onset,
        state.onset_station, state.stop, front.lateral, rear.lateral,
    )  # fmt: skip


@register_jitable
def unpack_state(row: NDArray[np.float64]) -> VehicleState:
    """Return the state that `pack_state` wrote into a row.

    Parameters
    ----------
    row : float64 [STATE_WIDTH]
    """
    v = row
    return VehicleState(
        v[0], Motion(v[1], v[2], v[3], v[4]),
        Memory(AxleMemory(v[5], v[6], v[7], v[27]), AxleMemory(v[8], v[9], v[10], v[28])),
        (v[11], v[12], v[13], v[14], v[15], v[16], v[17], v[18]), v[19], v[20], v[21], v[22], bool(v[23]), v[24],
        v[25], v[26],
    )  # fmt: skip


@register_jitable
def make_rolling_state(speed: float, wheel_radius: float, disc_rise: float, onset: float) -> VehicleState:
    """Return the state of a car whose wheels roll freely and whose body is at rest.

    Parameters
    ----------
    speed : [m/s]
    wheel_radius : [m]
    disc_rise : temperature of the discs above ambient [K]
    onset : brake onset; infinite before it is known [s]
    """
    rolling, cold = speed / wheel_radius, AxleMemory(0.0, 0.0, disc_rise, 0.0)
    return VehicleState(
        0.0, Motion(0.0, speed, rolling, rolling), Memory(cold, cold), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0,
        1.0, 1.0, 0.0, False, onset, inf, inf,
    )  # fmt: skip


@register_jitable(cache=True, forceinline=True)
def advance_motion(motion: Motion, rate: Motion, step: float) -> Motion:
    """Return the longitudinal state after a step [s] at a constant rate."""
    return Motion(
        motion.station + step * rate.station,
        motion.speed + step * rate.speed,
        motion.omega_f + step * rate.omega_f,
        motion.omega_r + step * rate.omega_r,
    )


@register_jitable(cache=True, forceinline=True)
def advance_axle(memory: AxleMemory, rate: AxleMemory, step: float) -> AxleMemory:
    """Return the memory of an axle after a step [s] at constant rates."""
    return AxleMemory(
        memory.slip + step * rate.slip,
        memory.slip_heat + step * rate.slip_heat,
        memory.disc_rise + step * rate.disc_rise,
        memory.lateral + step * rate.lateral,
    )


@register_jitable(cache=True, forceinline=True)
def clear_slip(memory: Memory) -> Memory:
    """Return the memory with slip 0, as at rest; tyres and discs stay warm, and tyres keep their deflection."""
    front, rear = memory.front, memory.rear
    return Memory(
        AxleMemory(0.0, front.slip_heat, front.disc_rise, front.lateral),
        AxleMemory(0.0, rear.slip_heat, rear.disc_rise, rear.lateral),
    )
