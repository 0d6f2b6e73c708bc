"""Effects that coupled mode carries: each a few numbers of the vehicle, all 0 in the paper's model.

With every number 0 each function returns exactly what the plain model has at its port. Names that the library
of effects has too mean the same there.
"""

from collections.abc import Mapping
from math import sqrt, tanh
from typing import NamedTuple

from numba import njit

from tasks.errors import InputError
from tasks.vehicle.effects.ports import AIR_DENSITY, COULOMB_SPEED
from tasks.vehicle.road import RoadFeature, height_at, slope_at
from tasks.vehicle.tyre import TyreCurve, tyre_friction, tyre_slope

STICK_SLIP = 0.01
"""Slip over which a sticking tyre builds up its force; any value well below the curve's peak serves [1]."""


class ChassisEffects(NamedTuple):
    """Numbers of the effects.

    Parameters
    ----------
    drag_area : CdA of the air drag (Gillespie 1992, SAE R-114) [m2]
    rolling_coefficient : rolling-resistance moment per load and radius, on the wheels (ISO 28580) [1]
    slope_moment : share of the load's slope force that turns the wheel, as where the load acts below its centre and
        not on the road's normal through it [1]
    radius_by_load : share of the tyre's deflection by which its lever on the wheel shortens [1]
    damper_asymmetry : rebound damping 1 + a, bump damping 1 - a times the nominal [1]
    progressive_rate : cubic part of each axle's spring [N/m3]
    scrub_stiffness : stiffness that the track's change adds where the tyre grips sideways, over the spring's [1]
    anti_dive, anti_lift : share of the longitudinal load transfer that the links carry, front and rear [1]
    enveloping_length : length of the footprint over which the tyre averages the road (Zegelaar 1998) [m]
    tyre_damping : vertical, of each axle [N s/m]
    abs_cutoff : speed below which the ABS lets the full brake torque through [m/s]
    stick_ratio : friction of a tyre that sticks and slides instead of rolling, over its peak [1]
    stick_below, stick_above : all of the tyre does so below the one speed, none above the other [m/s]
    stick_anti_dive, stick_anti_lift : what anti_dive and anti_lift gain in that state [1]
    wind_speed : of the wind against the vehicle, on its drag area [m/s]
    rolling_speed : rise of the rolling-resistance coefficient with speed [s/m]
    creep_force, creep_speed : drive of an idling engine at rest, and the speed at which it ends [N, m/s]
    pad_drag : torque of pads that rub, shared as the brakes are [N m]
    load_sensitivity : fall of the tyre's friction per relative rise of its load [1]
    friction_speed : fall of the tyre's friction per speed [s/m]
    coulomb_friction : dry friction of each axle's suspension [N]
    stop_stiffness, stop_clearance : bump stop of each axle, and the bump travel before it [N/m, m]
    dead_time, lag : of the brake line, from command to pads [s]
    push_out : pressure that the pads' return takes [MPa]
    pressure_curve : rise of the torque per pressure with pressure [1/MPa]
    pad_speed, pad_speed_reference : fall of pad friction with speed, and the speed at which it is nominal [s/m, m/s]
    fade : fall of pad friction per 100 K of the discs above ambient [1]
    """

    drag_area: float = 0.0
    rolling_coefficient: float = 0.0
    slope_moment: float = 0.0
    radius_by_load: float = 0.0
    damper_asymmetry: float = 0.0
    progressive_rate: float = 0.0
    scrub_stiffness: float = 0.0
    anti_dive: float = 0.0
    anti_lift: float = 0.0
    enveloping_length: float = 0.0
    tyre_damping: float = 0.0
    abs_cutoff: float = 0.0
    stick_ratio: float = 0.0
    stick_below: float = 0.0
    stick_above: float = 0.0
    stick_anti_dive: float = 0.0
    stick_anti_lift: float = 0.0
    wind_speed: float = 0.0
    rolling_speed: float = 0.0
    creep_force: float = 0.0
    creep_speed: float = 0.0
    pad_drag: float = 0.0
    load_sensitivity: float = 0.0
    friction_speed: float = 0.0
    coulomb_friction: float = 0.0
    stop_stiffness: float = 0.0
    stop_clearance: float = 0.0
    dead_time: float = 0.0
    lag: float = 0.0
    push_out: float = 0.0
    pressure_curve: float = 0.0
    pad_speed: float = 0.0
    pad_speed_reference: float = 0.0
    fade: float = 0.0


EFFECT_UNITS = {
    "drag_area": "m2", "rolling_coefficient": "1", "slope_moment": "1", "radius_by_load": "1",
    "damper_asymmetry": "1", "progressive_rate": "N m-3", "scrub_stiffness": "1", "anti_dive": "1",
    "anti_lift": "1", "enveloping_length": "m", "tyre_damping": "N s m-1",
    "abs_cutoff": "m s-1", "stick_ratio": "1", "stick_below": "m s-1", "stick_above": "m s-1",
    "stick_anti_dive": "1", "stick_anti_lift": "1", "wind_speed": "m s-1", "rolling_speed": "s m-1",
    "creep_force": "N", "creep_speed": "m s-1", "pad_drag": "N m", "load_sensitivity": "1", "friction_speed": "s m-1",
    "coulomb_friction": "N", "stop_stiffness": "N m-1", "stop_clearance": "m", "dead_time": "s", "lag": "s",
    "push_out": "MPa", "pressure_curve": "MPa-1", "pad_speed": "s m-1", "pad_speed_reference": "m s-1", "fade": "1",
}  # fmt: skip
"""Unit of each number, as catalogue files write it."""

CHASSIS_EFFECTS = {
    "air drag": ("drag_area",),
    "rolling resistance": ("rolling_coefficient",),
    "tyre radius by load": ("radius_by_load",),
    "slope moment": ("slope_moment",),
    "footprint": ("enveloping_length",),
    "tyre damping": ("tyre_damping",),
    "damper asymmetry": ("damper_asymmetry",),
    "progressive spring": ("progressive_rate",),
    "scrub": ("scrub_stiffness",),
    "anti-dive and anti-lift": ("anti_dive", "anti_lift"),
    "ABS cut-off": ("abs_cutoff",),
    "sticking tyre": ("stick_ratio", "stick_below", "stick_above", "stick_anti_dive", "stick_anti_lift"),
    "wind": ("wind_speed",),
    "rolling resistance by speed": ("rolling_speed",),
    "idle creep": ("creep_force", "creep_speed"),
    "pad drag": ("pad_drag",),
    "load sensitivity": ("load_sensitivity",),
    "tyre friction by speed": ("friction_speed",),
    "suspension friction": ("coulomb_friction",),
    "bump stop": ("stop_stiffness", "stop_clearance"),
    "brake dead time": ("dead_time",),
    "brake lag": ("lag",),
    "push-out pressure": ("push_out",),
    "pressure curve": ("pressure_curve",),
    "pad friction by speed": ("pad_speed", "pad_speed_reference"),
    "brake fade": ("fade",),
}
"""The effects, and the numbers of each."""


def chassis_effects(values: Mapping[str, float]) -> ChassisEffects:
    """The effects of a vehicle from named numbers; all others 0.

    Parameters
    ----------
    values : by name, in the units of `EFFECT_UNITS`

    Raises
    ------
    InputError
        For names that coupled mode does not carry.
    """
    unknown = [name for name in values if name not in EFFECT_UNITS]
    if unknown:
        known = ", ".join(EFFECT_UNITS)
        raise InputError(
            [f"effect {name}: coupled mode has no such number; there are: {known}" for name in unknown]
        )
    return ChassisEffects(**{name: float(value) for name, value in values.items()})


@njit(cache=True, nogil=True)
def air_drag(speed: float, effects: ChassisEffects) -> float:
    """Force of the air against the motion, less what an idling engine drives with [N].

    Parameters
    ----------
    speed : [m/s]
    effects : the numbers
    """
    air = speed + effects.wind_speed
    force = 0.5 * AIR_DENSITY * effects.drag_area * air * abs(air)
    if speed < effects.creep_speed:
        force -= effects.creep_force * (1.0 - speed / effects.creep_speed)
    return force


@njit(cache=True, nogil=True)
def grip_share(speed: float, load_ratio: float, effects: ChassisEffects) -> float:
    """Tyre friction as a factor of its nominal: falls with speed and with load [1].

    Parameters
    ----------
    speed : [m/s]
    load_ratio : contact load over that at rest [1]
    effects : the numbers
    """
    by_load = 1.0 - effects.load_sensitivity * (load_ratio - 1.0)
    return max(by_load * (1.0 - effects.friction_speed * speed), 0.0)


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def effective_friction(slip: float, share: float, tyre: TyreCurve, effects: ChassisEffects) -> float:
    """Friction of a tyre of which a share sticks, for a braking slip [1].

    Parameters
    ----------
    slip : braking slip, 0 or more [1]
    share : that sticks [1]
    tyre : the scaled curve
    effects : the numbers
    """
    rolling = tyre_friction(slip, tyre)
    if share == 0.0:
        return rolling
    u = slip / STICK_SLIP
    return (1.0 - share) * rolling + share * effects.stick_ratio * tyre.peak * u / sqrt(1.0 + u * u)


@njit(cache=True, nogil=True)
def effective_slope(slip: float, share: float, tyre: TyreCurve, effects: ChassisEffects) -> float:
    """Rise of ``effective_friction`` with slip [1].

    Parameters
    ----------
    slip : braking slip, 0 or more [1]
    share : that sticks [1]
    tyre : the scaled curve
    effects : the numbers
    """
    rolling = tyre_slope(slip, tyre)
    if share == 0.0:
        return rolling
    u = slip / STICK_SLIP
    return (1.0 - share) * rolling + share * effects.stick_ratio * tyre.peak / STICK_SLIP / (
        1.0 + u * u
    ) ** 1.5


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def added_strut_force(travel: float, rate: float, damping: float, effects: ChassisEffects) -> float:
    """What an axle's strut has beyond its linear spring and damper [N].

    Parameters
    ----------
    travel, rate : of the strut, rebound positive [m, m/s]
    damping : nominal [N s/m]
    effects : the numbers
    """
    force = (
        effects.damper_asymmetry * damping * abs(rate) + effects.progressive_rate * travel * travel * travel
    )
    if effects.coulomb_friction != 0.0:
        force += effects.coulomb_friction * tanh(rate / COULOMB_SPEED)
    if -travel > effects.stop_clearance:
        force += effects.stop_stiffness * (travel + effects.stop_clearance)
    return force


@njit(cache=True, nogil=True)
def grip_reserve(friction: float, peak: float) -> float:
    """Sideways grip that a braking tyre has left, by the friction circle [1].

    Parameters
    ----------
    friction : of braking in use [1]
    peak : of the curve [1]
    """
    used = friction / peak
    return sqrt(max(1.0 - used * used, 0.0))


@njit(cache=True, nogil=True)
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
