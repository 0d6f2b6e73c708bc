"""Slots: piecewise-linear tables of one state variable at one port, for any form that no library effect has."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from tasks.vehicle.effects.ports import AXLE_VARIABLES, PORTS, VARIABLES


@dataclass(frozen=True, kw_only=True)
class Slot:
    """A piecewise-linear table of one variable at one port.

    Parameters
    ----------
    port, variable : one of `PORTS` and `VARIABLES`
    origin, spacing : first point and spacing of the grid [unit of the variable]
    values : float64 [K] at the grid points [unit of the port]
    """

    port: str
    variable: str
    origin: float
    spacing: float
    values: NDArray[np.float64]


class SlotTables(NamedTuple):
    """Slots in the form that the kernels take.

    Parameters
    ----------
    keys : int64 [N, 2] place of port and variable in `PORTS` and `VARIABLES`
    grids : float64 [N, 2] origin and spacing [unit of the variable]
    tables : float64 [N, K] values; short tables go on with their last one [unit of the port]
    by_axle : whether a variable is an axle's own, so that the sums differ between the axles
    """

    keys: NDArray[np.int64]
    grids: NDArray[np.float64]
    tables: NDArray[np.float64]
    by_axle: bool


def pack_slots(slots: Sequence[Slot]) -> SlotTables:
    """Return slots in the form that the kernels take.

    Parameters
    ----------
    slots : none or more
    """
    keys = np.array([(PORTS.index(s.port), VARIABLES.index(s.variable)) for s in slots], dtype=np.int64)
    grids = np.array([(s.origin, s.spacing) for s in slots])
    width = max((len(s.values) for s in slots), default=1)
    tables = np.zeros((len(slots), width))
    for table, slot in zip(tables, slots, strict=True):
        table[:] = slot.values[-1]
        table[: len(slot.values)] = slot.values
    by_axle = any(s.variable in AXLE_VARIABLES for s in slots)
    return SlotTables(keys.reshape(-1, 2), grids.reshape(-1, 2), tables, by_axle)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def interpolate_table(table: NDArray[np.float64], origin: float, spacing: float, x: float) -> float:
    """Return the value of a piecewise-linear table on a uniform grid, constant beyond its ends [unit of the port].

    Parameters
    ----------
    table : float64 [K] values
    origin, spacing : first point and spacing of the grid [unit of the variable]
    x : value of the variable [unit of the variable]
    """
    last = table.shape[0] - 1
    u = (x - origin) / spacing
    if u <= 0.0:
        return float(table[0])
    if u >= last:
        return float(table[last])
    i = int(u)
    return float(table[i] + (u - i) * (table[i + 1] - table[i]))


class PortSums(NamedTuple):
    """Sum of the slots at each of `PORTS` [its unit]."""

    longitudinal_force: float
    brake_torque: float
    friction: float
    pitch_moment: float
    suspension_force: float


_FORCE, _TORQUE, _FRICTION, _MOMENT = (PORTS.index(port) for port in PortSums._fields[:4])
NO_SUMS = PortSums(0.0, 0.0, 0.0, 0.0, 0.0)
"""Sums of no slots."""


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def sum_slots(variables: tuple[float, ...], slots: SlotTables) -> PortSums:
    """Return the sums of all slots at all ports, in one pass.

    Parameters
    ----------
    variables : values of the variables, in the order of `VARIABLES` [their units]
    slots : the tables
    """
    force, torque, friction, moment, strut = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(slots.keys.shape[0]):
        port = slots.keys[k, 0]
        value = interpolate_table(
            slots.tables[k], slots.grids[k, 0], slots.grids[k, 1], variables[slots.keys[k, 1]]
        )
        if port == _FORCE:
            force += value
        elif port == _TORQUE:
            torque += value
        elif port == _FRICTION:
            friction += value
        elif port == _MOMENT:
            moment += value
        else:
            strut += value
    return PortSums(force, torque, friction, moment, strut)
