"""Side force between tyre and road of an axle whose wheels steer and move sideways as the suspension travels.

On a straight road the forces of both wheels of an axle cancel, but each passes through inclined links, and both push
the body the same way. A rolling tyre builds its side force up by the angle of its slip, and braking uses most of it up. A
sticking tyre holds its place on the road by a deflection, which the road that it has rolled winds up, within the
friction circle (Dahl 1968). With every value 0 all functions return 0 or the plain model.
"""

from math import sqrt
from typing import NamedTuple

from numba.extending import register_jitable

from tasks.vehicle.effects.chassis import compute_rolling_friction, compute_stick_direction
from tasks.vehicle.effects.table import EffectValues
from tasks.vehicle.tyres.contract import Tyre

LEAST_REACH = 0.002
"""Shortest deflection at which a sticking tyre slides sideways; it keeps the rate bounded off the road [m]."""


class SideMotion(NamedTuple):
    """Sideways motion of an axle's contacts.

    Parameters
    ----------
    incline : sideways travel of the contact per suspension travel [1]
    speed : speed at which the contact would slide sideways [m/s]
    """

    incline: float
    speed: float


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_side_motion(travel: float, rate: float, speed: float, effects: EffectValues) -> SideMotion:
    """Return how the contacts of an axle move sideways.

    Parameters
    ----------
    travel, rate : extension of the strut and its rate, rebound positive [m, m/s]
    speed : speed of the vehicle [m/s]
    effects : numbers of the vehicle's effects
    """
    incline = effects.track_change + effects.track_curve * travel
    return SideMotion(incline, speed * effects.bump_steer * travel + incline * rate)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_wound_share(deflection: float, limit: float, effects: EffectValues) -> float:
    """Return the side force of a sticking tyre over its friction, before braking takes its part, in [-1, 1].

    Parameters
    ----------
    deflection : sideways deflection of the contacts [m]
    limit : friction of the axle's tyres where they stick [N]
    effects : numbers of the vehicle's effects
    """
    if limit <= 0.0:
        return 0.0
    return min(max(effects.side_stiffness * deflection / limit, -1.0), 1.0)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_deflection_rate(deflection: float, side_speed: float, limit: float, effects: EffectValues) -> float:
    """Return the rate of the sideways deflection, by Dahl's law: it follows the motion up to where the tyre slides [m/s].

    Parameters
    ----------
    deflection : sideways deflection of the contacts [m]
    side_speed : sideways speed of the contacts [m/s]
    limit : friction of the axle's tyres where they stick [N]
    effects : numbers of the vehicle's effects
    """
    if effects.side_stiffness <= 0.0:
        return 0.0
    reach = max(limit / effects.side_stiffness, LEAST_REACH)
    return side_speed - abs(side_speed) * deflection / reach


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_rolling_side_force(
    slip: float, angle: float, load: float, tyre: Tyre, effects: EffectValues
) -> float:
    """Return the side force of a rolling axle by its combined slip [N].

    Parameters
    ----------
    slip : signed braking slip [1]
    angle : sideways speed over that of the vehicle [1]
    load : load of the axle [N]
    tyre : the tyre on the surface
    effects : numbers of the vehicle's effects
    """
    combined = sqrt(slip * slip + angle * angle)
    if combined == 0.0:
        return 0.0
    return compute_rolling_friction(min(combined, 1.0), load, tyre, effects) * load * angle / combined


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_sticking_side_force(slip: float, wound: float, limit: float) -> float:
    """Return the side force of a sticking axle within the friction circle [N].

    Parameters
    ----------
    slip : signed braking slip [1]
    wound : side force over friction, before braking takes its part [1]
    limit : friction of the axle's tyres where they stick [N]
    """
    along = compute_stick_direction(abs(slip))
    return limit * wound / max(sqrt(along * along + wound * wound), 1.0)
