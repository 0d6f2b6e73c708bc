"""Effects that only coupled mode has, beside those of the library: all 0 in the paper's model.

With every number 0 each function returns exactly what the plain model has at its port.
"""

from math import sqrt
from typing import NamedTuple

from numba import njit

from tasks.vehicle.road import RoadFeature, height_at, slope_at
from tasks.vehicle.tyres.contract import Tyre, tyre_friction, tyre_slope

STICK_SLIP = 0.01
"""Slip over which a sticking tyre builds up its force; any value well below the curve's peak serves [1]."""


class ChassisEffects(NamedTuple):
    """Numbers of these effects.

    Parameters
    ----------
    slope_moment : share of the load's slope force that turns the wheel, as where the load acts below its centre and
        not on the road's normal through it [1]
    radius_by_load : share of the tyre's deflection by which its lever on the wheel shortens [1]
    scrub_stiffness : stiffness that the track's change adds where the tyre grips sideways, over the spring's [1]
    enveloping_length : length of the footprint over which the tyre averages the road (Zegelaar 1998) [m]
    tyre_damping : vertical, of each axle [N s/m]
    abs_cutoff : speed below which the ABS lets the full brake torque through [m/s]
    stick_ratio : friction of a tyre that sticks and slides instead of rolling, over its peak [1]
    stick_below, stick_above : all of the tyre does so below the one speed, none above the other [m/s]
    stick_anti_dive, stick_anti_lift : what anti_dive and anti_lift gain in that state [1]
    """

    slope_moment: float = 0.0
    radius_by_load: float = 0.0
    scrub_stiffness: float = 0.0
    enveloping_length: float = 0.0
    tyre_damping: float = 0.0
    abs_cutoff: float = 0.0
    stick_ratio: float = 0.0
    stick_below: float = 0.0
    stick_above: float = 0.0
    stick_anti_dive: float = 0.0
    stick_anti_lift: float = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def stick_share(speed: float, effects: ChassisEffects) -> float:
    """Share of the tyre that sticks and slides instead of rolling: 1 at low speed, smoothly to 0 [1].

    Parameters
    ----------
    speed : [m/s]
    effects : the numbers
    """
    if speed >= effects.stick_above:
        return 0.0
    if speed <= effects.stick_below:
        return 1.0
    u = (effects.stick_above - speed) / (effects.stick_above - effects.stick_below)
    return u * u * (3.0 - 2.0 * u)


@njit(cache=True, nogil=True, error_model="numpy")
def effective_friction(slip: float, load: float, share: float, tyre: Tyre, effects: ChassisEffects) -> float:
    """Friction of a tyre of which a share sticks, for a braking slip [1].

    Parameters
    ----------
    slip : braking slip, 0 or more [1]
    load : of the axle [N]
    share : that sticks [1]
    tyre : on the surface
    effects : the numbers
    """
    rolling = tyre_friction(slip, load, tyre)
    if share == 0.0:
        return rolling
    u = slip / STICK_SLIP
    return (1.0 - share) * rolling + share * effects.stick_ratio * tyre.peak * u / sqrt(1.0 + u * u)


@njit(cache=True, nogil=True, error_model="numpy")
def effective_slope(slip: float, load: float, share: float, tyre: Tyre, effects: ChassisEffects) -> float:
    """Rise of ``effective_friction`` with slip [1].

    Parameters
    ----------
    slip : braking slip, 0 or more [1]
    load : of the axle [N]
    share : that sticks [1]
    tyre : on the surface
    effects : the numbers
    """
    rolling = tyre_slope(slip, load, tyre)
    if share == 0.0:
        return rolling
    u = slip / STICK_SLIP
    return (1.0 - share) * rolling + share * effects.stick_ratio * tyre.peak / STICK_SLIP / (
        1.0 + u * u
    ) ** 1.5


@njit(cache=True, nogil=True, error_model="numpy")
def footprint(station: float, road: RoadFeature, effects: ChassisEffects) -> tuple[float, float]:
    """Road height [m] and slope [m/m] that a tyre feels: their means over its footprint.

    The mean of the height is by Gauss's three points, that of the slope is exact.

    Parameters
    ----------
    station : of the axle [m]
    road : the feature
    effects : the numbers
    """
    half = 0.5 * effects.enveloping_length
    if half <= 0.0:
        return height_at(station, road), slope_at(station, road)
    out = 0.7745966692414834 * half
    ends = height_at(station - out, road) + height_at(station + out, road)
    height = (5.0 * ends + 8.0 * height_at(station, road)) / 18.0
    return height, (height_at(station + half, road) - height_at(station - half, road)) / (2.0 * half)


@njit(cache=True, nogil=True, error_model="numpy")
def grip_reserve(friction: float, peak: float) -> float:
    """Sideways grip that a braking tyre has left, by the friction circle [1].

    Parameters
    ----------
    friction : of braking in use [1]
    peak : of the curve [1]
    """
    used = friction / peak
    return sqrt(max(1.0 - used * used, 0.0))


@njit(cache=True, nogil=True, error_model="numpy")
def link_lift(tyre_force: float, transfer: float, anti: float, stick_anti: float, share: float) -> float:
    """Vertical force that an axle's links pass between body and wheel while it brakes [N].

    Parameters
    ----------
    tyre_force : braking force of the axle [N]
    transfer : height of the centre of gravity over the wheelbase [1]
    anti, stick_anti : share of the load transfer, always and in addition where the tyre sticks [1]
    share : that sticks [1]
    """
    return (anti + share * stick_anti) * tyre_force * transfer
