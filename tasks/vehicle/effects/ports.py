"""Where added effects enter the equations of motion: one compiled function per port.

``theta`` is the flat parameter vector in the order of `PARAMETERS`; with all entries 0 every function
returns exactly what the plain model has at that port, so an effect that is off costs no bit.
Any further form enters through a *slot*: a piecewise-linear table of one state variable at one port,
which serves unknown forms, smooth disturbances and the scan for what is left over.
"""

from math import exp

import numpy as np
from numba import njit
from numpy.typing import NDArray

PARAMETERS = (
    "pressure_gain", "mass", "pitch_gain", "wheel_radius", "damping", "stiffness", "slope",
    "friction", "slip_stiffness", "front_bias",
    "drag_area", "wind_speed", "rolling_coefficient", "rolling_speed", "ploughing", "creep_force",
    "creep_speed", "engine_torque", "engine_viscous", "wheel_inertia", "pad_drag",
    "lag", "dead_time", "push_out", "pressure_curve", "fade", "pad_speed", "pad_speed_reference",
    "bias_pressure", "relaxation_length", "load_sensitivity", "tyre_heating", "wet_speed",
    "wet_threshold", "friction_speed", "damper_asymmetry", "coulomb_friction", "progressive_rate",
    "stop_stiffness", "stop_clearance", "anti_dive", "anti_lift", "aero_pitch", "aero_lift",
)  # fmt: skip
"""Order of the parameter vector; units and meaning stand in catalogs/effects/library.yaml."""

INDEX = {name: i for i, name in enumerate(PARAMETERS)}

PORTS = ("longitudinal_force", "brake_torque", "friction", "pitch_moment", "suspension_force")
PORT_UNITS = ("N", "1", "1", "N m", "N")
VARIABLES = (
    "time", "speed", "pressure", "disc_temperature", "pressure_rate", "load_ratio",
    "suspension_travel", "suspension_speed", "deceleration",
)  # fmt: skip
VARIABLE_UNITS = ("s", "m/s", "MPa", "K", "MPa/s", "1", "m", "m/s", "m/s^2")

(_GAIN, _MASS, _PITCH, _RADIUS, _DAMP, _STIFF, _SLOPE, _MU, _SLIP, _BIAS,
 _CDA, _WIND, _CRR, _CRV, _PLOUGH, _CREEP, _CREEPV, _ENG, _ENGV, _INERTIA, _PAD,
 _LAG, _DEAD, _PUSH, _CURVE, _FADE, _PADV, _PADREF,
 _BIASP, _RELAX, _LOADS, _HEAT, _WETV, _WETT, _MUV, _ASYM, _COUL, _PROG,
 _STOPK, _STOPC, _DIVE, _LIFT, _AEROM, _AEROL) = range(len(PARAMETERS))  # fmt: skip

LOOSE = {"contract", "arcp", "nsz", "reassoc"}
"""Freedoms of the compiler that move the last digits only: not the one to take nan and infinity for impossible."""

AIR_DENSITY = 1.2
"""Air at 20 degrees and sea level [kg/m^3]."""
COULOMB_SPEED = 0.01
"""Suspension speed over which dry friction turns sign [m/s]."""


@njit(cache=True, nogil=True, inline="always", error_model="numpy", fastmath=LOOSE)
def table_value(table: NDArray[np.float64], origin: float, spacing: float, x: float) -> float:
    """Piecewise-linear table on a uniform grid, held constant beyond its ends."""
    last = table.shape[0] - 1
    u = (x - origin) / spacing
    if u <= 0.0:
        return float(table[0])
    if u >= last:
        return float(table[last])
    i = int(u)
    return float(table[i] + (u - i) * (table[i + 1] - table[i]))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=LOOSE)
def slot_sum(
    port: int,
    states: NDArray[np.float64],
    keys: NDArray[np.int64],
    grids: NDArray[np.float64],
    tables: NDArray[np.float64],
) -> float:
    """Sum of all slots at ``port``; ``states`` holds the variables in the order of `VARIABLES`."""
    total = 0.0
    for k in range(keys.shape[0]):
        if keys[k, 0] == port:
            total += table_value(tables[k], grids[k, 0], grids[k, 1], states[keys[k, 1]])
    return total


@njit(cache=True, nogil=True, error_model="numpy", fastmath=LOOSE)
def resistance(
    theta: NDArray[np.float64], speed: float, direction: float, weight: float, snow_depth_mm: float
) -> float:
    """Force against the motion [N]: air, rolling, ploughing, less the idle creep that drives."""
    force = 0.0
    if speed > 0.0:
        if theta[_CDA] != 0.0:
            air = speed + direction * theta[_WIND]
            force += 0.5 * AIR_DENSITY * theta[_CDA] * air * abs(air)
        force += weight * (theta[_CRR] + theta[_CRV] * speed)
        force += theta[_PLOUGH] * snow_depth_mm
        if theta[_CREEP] != 0.0 and speed < theta[_CREEPV]:
            force -= theta[_CREEP] * (1.0 - speed / theta[_CREEPV])
    return force


@njit(cache=True, nogil=True, error_model="numpy", fastmath=LOOSE)
def brake_factor(theta: NDArray[np.float64], pressure: float, speed: float, disc_rise: float) -> float:
    """Pad friction and hydraulics as a factor on the linear pressure-to-torque law [1]."""
    factor = 1.0 + theta[_CURVE] * pressure
    factor *= 1.0 - theta[_FADE] * disc_rise / 100.0
    factor *= 1.0 - theta[_PADV] * (speed - theta[_PADREF])
    return max(factor, 0.0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=LOOSE)
def friction_factor(
    theta: NDArray[np.float64], speed: float, load_ratio: float, slip_energy: float, wet: float
) -> float:
    """Peak tyre friction as a factor [1]: load, heat of sliding, film and speed."""
    factor = 1.0 - theta[_LOADS] * (load_ratio - 1.0)
    factor *= 1.0 - theta[_HEAT] * slip_energy / 1e5
    if wet > 0.0:
        factor *= 1.0 - theta[_WETV] * max(speed - theta[_WETT], 0.0)
    factor *= 1.0 - theta[_MUV] * speed
    return max(factor, 0.0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=LOOSE)
def strut_force(
    theta: NDArray[np.float64], stiffness: float, damping: float, travel: float, rate: float
) -> float:
    """Spring and damper force of one axle [N], extension positive as in the half-car."""
    c = damping * (1.0 + theta[_ASYM]) if rate > 0.0 else damping * (1.0 - theta[_ASYM])
    force = stiffness * travel + c * rate
    if theta[_COUL] != 0.0:
        u = rate / COULOMB_SPEED
        force += theta[_COUL] * (1.0 - 2.0 / (exp(2.0 * min(max(u, -20.0), 20.0)) + 1.0))
    force += theta[_PROG] * travel * travel * travel
    if theta[_STOPK] != 0.0 and -travel > theta[_STOPC]:
        force += theta[_STOPK] * (travel + theta[_STOPC])
    return force
