"""The states of coupled mode beside the half-car's: motion along the road, and what tyres and discs remember."""

from typing import NamedTuple

from numba import njit


class Motion(NamedTuple):
    """Longitudinal state: station [m], speed [m/s], wheel speeds of the axles [rad/s]."""

    station: float
    speed: float
    omega_f: float
    omega_r: float


class AxleMemory(NamedTuple):
    """What an axle's tyres and discs carry on from before.

    Parameters
    ----------
    slip : that builds up the force where the tyre has a relaxation length, else 0 [1]
    slip_heat : energy of sliding so far [J]
    disc_rise : temperature of the discs above ambient [K]
    """

    slip: float
    slip_heat: float
    disc_rise: float


class Memory(NamedTuple):
    """What both axles carry on from before."""

    front: AxleMemory
    rear: AxleMemory


class Instant(NamedTuple):
    """What acts from outside at one instant.

    Parameters
    ----------
    time : since the start [s]
    pressure, pressure_rate : at the pads [MPa, MPa/s]
    deceleration : -dv/dt of the evaluation before, which forms of it read [m/s2]
    standing : the vehicle has come to rest
    held : its speed is held from outside
    """

    time: float
    pressure: float
    pressure_rate: float
    deceleration: float
    standing: bool
    held: bool


AT_REST = AxleMemory(0.0, 0.0, 0.0)
"""No slip, tyres and discs at ambient temperature."""


@njit(cache=True, nogil=True)
def moved_motion(motion: Motion, rate: Motion, step: float) -> Motion:
    """The longitudinal state after going along a rate for a step [s]."""
    return Motion(
        motion.station + step * rate.station,
        motion.speed + step * rate.speed,
        motion.omega_f + step * rate.omega_f,
        motion.omega_r + step * rate.omega_r,
    )


@njit(cache=True, nogil=True)
def moved_axle(memory: AxleMemory, rate: AxleMemory, step: float) -> AxleMemory:
    """What an axle remembers after going along a rate for a step [s]."""
    return AxleMemory(
        memory.slip + step * rate.slip,
        memory.slip_heat + step * rate.slip_heat,
        memory.disc_rise + step * rate.disc_rise,
    )


@njit(cache=True, nogil=True)
def without_slip(memory: Memory) -> Memory:
    """The same with tyres that have come to rest; what is warm stays warm."""
    front, rear = memory.front, memory.rear
    return Memory(
        AxleMemory(0.0, front.slip_heat, front.disc_rise), AxleMemory(0.0, rear.slip_heat, rear.disc_rise)
    )
