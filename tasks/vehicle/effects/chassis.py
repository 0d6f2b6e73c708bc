"""Equations of the sticking tyre, the footprint and the links; with every value 0 they return the plain model."""

from math import sqrt

from numba import njit

from tasks.vehicle.effects.table import EffectValues
from tasks.vehicle.road import RoadFeature, compute_road_height, compute_road_slope
from tasks.vehicle.tyres.contract import Tyre, compute_tyre_friction, compute_tyre_slope

STICK_SLIP = 0.01
"""Slip over which a sticking tyre builds up its force; any value well below the curve's peak serves [1]."""


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def compute_stick_share(speed: float, effects: EffectValues) -> float:
    """Return the share of the tyre that sticks and slides instead of rolling [1]: 1 at low speed, smoothly down to 0.

    Parameters
    ----------
    speed : speed of the vehicle [m/s]
    effects : numbers of the vehicle's effects
    """
    if speed >= effects.stick_above:
        return 0.0
    if speed <= effects.stick_below:
        return 1.0
    u = (effects.stick_above - speed) / (effects.stick_above - effects.stick_below)
    return u * u * (3.0 - 2.0 * u)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def compute_effective_friction(
    slip: float, load: float, share: float, tyre: Tyre, effects: EffectValues
) -> float:
    """Return the friction of a tyre of which a share sticks, at a braking slip [1].

    Parameters
    ----------
    slip : braking slip, 0 or more [1]
    load : load of the axle [N]
    share : share of the tyre that sticks [1]
    tyre : the tyre on the surface
    effects : numbers of the vehicle's effects
    """
    rolling = compute_tyre_friction(slip, load, tyre)
    if share == 0.0:
        return rolling
    u = slip / STICK_SLIP
    return (1.0 - share) * rolling + share * effects.stick_ratio * tyre.peak * u / sqrt(1.0 + u * u)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def compute_effective_slope(
    slip: float, load: float, share: float, tyre: Tyre, effects: EffectValues
) -> float:
    """Return the derivative of ``compute_effective_friction`` by slip [1].

    Parameters
    ----------
    slip : braking slip, 0 or more [1]
    load : load of the axle [N]
    share : share of the tyre that sticks [1]
    tyre : the tyre on the surface
    effects : numbers of the vehicle's effects
    """
    rolling = compute_tyre_slope(slip, load, tyre)
    if share == 0.0:
        return rolling
    u = slip / STICK_SLIP
    return (1.0 - share) * rolling + share * effects.stick_ratio * tyre.peak / STICK_SLIP / (
        1.0 + u * u
    ) ** 1.5


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def average_over_footprint(station: float, road: RoadFeature, effects: EffectValues) -> tuple[float, float]:
    """Return road height [m] and slope [m/m] averaged over the tyre's footprint.

    Gauss's three-point rule averages the height; the mean of the slope is exact.

    Parameters
    ----------
    station : route position of the axle [m]
    road : road feature
    effects : numbers of the vehicle's effects
    """
    half = 0.5 * effects.enveloping_length
    if half <= 0.0:
        return compute_road_height(station, road), compute_road_slope(station, road)
    out = 0.7745966692414834 * half
    ends = compute_road_height(station - out, road) + compute_road_height(station + out, road)
    height = (5.0 * ends + 8.0 * compute_road_height(station, road)) / 18.0
    return height, (compute_road_height(station + half, road) - compute_road_height(station - half, road)) / (
        2.0 * half
    )


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def compute_lateral_reserve(friction: float, peak: float) -> float:
    """Return the lateral friction that a braking tyre has left, by the friction circle [1].

    Parameters
    ----------
    friction : friction that braking uses [1]
    peak : friction at the top of the curve [1]
    """
    used = friction / peak
    return sqrt(max(1.0 - used * used, 0.0))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def compute_link_force(
    tyre_force: float, transfer: float, anti: float, stick_anti: float, share: float
) -> float:
    """Return the vertical force that an axle's links pass between body and wheel while it brakes [N].

    Parameters
    ----------
    tyre_force : braking force of the axle [N]
    transfer : height of the centre of gravity over the wheelbase [1]
    anti, stick_anti : share of the load transfer, always and in addition where the tyre sticks [1]
    share : share of the tyre that sticks [1]
    """
    return (anti + share * stick_anti) * tyre_force * transfer
