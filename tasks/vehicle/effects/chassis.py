"""Equations of the tyre's tread, its sticking, its contact with the road, and the links.

With every value 0 they return the plain model.
"""

from math import sqrt

from numba.extending import register_jitable

from tasks.vehicle.effects.table import EffectValues
from tasks.vehicle.road import RoadFeature, compute_road_height, compute_road_slope
from tasks.vehicle.tyres.contract import Tyre, compute_tyre_friction, compute_tyre_slope

STICK_SLIP = 0.002
"""Slip over which a sticking tyre builds up its force; any value well below the curve's peak serves [1]."""


@register_jitable(cache=True, error_model="numpy", forceinline=True)
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


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_tread_curve(slip: float, stiffness: float, tyre: Tyre) -> tuple[float, float]:
    """Return friction [1] and slope [1] of a tyre whose tread has its own stiffness, below the slip of the peak.

    The tread deflects in proportion to the force and slides only near the peak, so the slope at slip 0 is that of the
    rubber on any surface. The curve is the one of TMeasy (Hirschberg, Rill and Weinfurter 2007) between that
    slope and the tyre's own peak: mu = c kappa / (1 + u (u + c kappa* / mu_peak - 2)) with u = kappa / kappa*.

    Parameters
    ----------
    slip : braking slip kappa, 0 or more, below the slip of the peak [1]
    stiffness : slope of the friction at slip 0, c [1]
    tyre : the tyre on the surface, which gives peak and slip of the peak
    """
    u = slip / tyre.target_slip
    steepness = max(stiffness * tyre.target_slip / tyre.peak, 2.0)
    below = 1.0 + u * (u + steepness - 2.0)
    friction = tyre.peak * steepness * u / below
    return friction, tyre.peak / tyre.target_slip * steepness * (1.0 - u * u) / (below * below)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_rolling_friction(slip: float, load: float, tyre: Tyre, effects: EffectValues) -> float:
    """Return the friction of a rolling tyre at a braking slip [1].

    Parameters
    ----------
    slip : braking slip, 0 or more [1]
    load : load of the axle [N]
    tyre : the tyre on the surface
    effects : numbers of the vehicle's effects
    """
    if effects.tread_stiffness > 0.0 and slip < tyre.target_slip:
        return compute_tread_curve(slip, effects.tread_stiffness, tyre)[0]
    return compute_tyre_friction(slip, load, tyre)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_rolling_slope(slip: float, load: float, tyre: Tyre, effects: EffectValues) -> float:
    """Return the derivative of ``compute_rolling_friction`` by slip [1].

    Parameters
    ----------
    slip : braking slip, 0 or more [1]
    load : load of the axle [N]
    tyre : the tyre on the surface
    effects : numbers of the vehicle's effects
    """
    if effects.tread_stiffness > 0.0 and slip < tyre.target_slip:
        return compute_tread_curve(slip, effects.tread_stiffness, tyre)[1]
    return compute_tyre_slope(slip, load, tyre)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_stick_friction(tyre: Tyre, effects: EffectValues) -> float:
    """Return the friction of a tyre that sticks [1].

    Parameters
    ----------
    tyre : the tyre on the surface
    effects : numbers of the vehicle's effects
    """
    return max(effects.stick_ratio * tyre.peak - effects.stick_loss, 0.0)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
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
    rolling = compute_rolling_friction(slip, load, tyre, effects)
    if share == 0.0:
        return rolling
    u = slip / STICK_SLIP
    return (1.0 - share) * rolling + share * compute_stick_friction(tyre, effects) * u / sqrt(1.0 + u * u)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
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
    rolling = compute_rolling_slope(slip, load, tyre, effects)
    if share == 0.0:
        return rolling
    u = slip / STICK_SLIP
    return (1.0 - share) * rolling + share * compute_stick_friction(tyre, effects) / STICK_SLIP / (
        1.0 + u * u
    ) ** 1.5


@register_jitable(cache=True, error_model="numpy", forceinline=True)
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


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def find_contact(station: float, road: RoadFeature, effects: EffectValues) -> tuple[float, float]:
    """Return road height [m] and slope [m/m] that a wheel at a station feels.

    A wheel with a radius touches a slope uphill of its centre. It feels the slope of the road there, and the height of
    a rigid disc that rolls over the road (Zegelaar 1998), for slopes whose square is small.

    Parameters
    ----------
    station : route position of the wheel's centre [m]
    road : road feature
    effects : numbers of the vehicle's effects
    """
    height, slope = average_over_footprint(station, road, effects)
    radius = effects.contact_radius
    if radius == 0.0 or slope == 0.0:
        return height, slope
    height, slope = average_over_footprint(station + radius * slope, road, effects)
    return height - 0.5 * radius * slope * slope, slope


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_lateral_reserve(friction: float, peak: float) -> float:
    """Return the lateral friction that a braking tyre has left, by the friction circle [1].

    Parameters
    ----------
    friction : friction that braking uses [1]
    peak : friction at the top of the curve [1]
    """
    used = friction / peak
    return sqrt(max(1.0 - used * used, 0.0))


@register_jitable(cache=True, error_model="numpy", forceinline=True)
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
