"""Lateral force of sticking tyres, which the links turn into a vertical force between body and axle.

As the suspension travels, the wheels of an axle steer and the track between their contacts changes. A tyre that sticks
holds its place on the road against both, by a deflection within the friction circle (Dahl 1968); the road that it has
rolled winds the deflection up. The lateral forces of both wheels cancel on a straight road, but each passes through
inclined links, and both push the body the same way. With every value 0 the functions return 0.
"""

from math import sqrt
from typing import NamedTuple

from numba.extending import register_jitable

from tasks.vehicle.effects.table import EffectValues

LEAST_REACH = 0.002
"""Shortest deflection at which a tyre slides sideways; it bounds the rate of the deflection off the road [m]."""


class LateralHold(NamedTuple):
    """Hold of an axle's tyres on the road, sideways.

    Parameters
    ----------
    link_force : vertical force that the links make of the lateral force; it pulls body and wheel together where
        positive [N]
    rate : rate of the lateral deflection [m/s]
    """

    link_force: float
    rate: float


NO_HOLD = LateralHold(0.0, 0.0)
"""Hold of tyres without a lateral stiffness."""


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_lateral_deflection_rate(deflection: float, speed: float, reach: float) -> float:
    """Return the rate of a deflection that follows a motion and ends where the tyre slides (Dahl 1968) [m/s].

    Parameters
    ----------
    deflection : lateral deflection [m]
    speed : lateral speed of the contact [m/s]
    reach : deflection at which the tyre slides [m]
    """
    return speed - abs(speed) * deflection / max(reach, LEAST_REACH)


@register_jitable(cache=True, error_model="numpy", forceinline=True)
def compute_lateral_hold(
    deflection: float,
    brake_force: float,
    travel: float,
    rate: float,
    speed: float,
    limit: float,
    share: float,
    effects: EffectValues,
) -> LateralHold:
    """Return how the tyres of an axle hold the road sideways.

    Braking comes first: the lateral force gets what the friction circle leaves. It acts on the body by virtual work, as
    the force times the contact's lateral travel per suspension travel.

    Parameters
    ----------
    deflection : lateral deflection of the axle's tyres [m]
    brake_force : braking force of the axle [N]
    travel, rate : extension of the strut and its rate, rebound positive [m, m/s]
    speed : speed of the vehicle [m/s]
    limit : friction of the axle's tyres [N]
    share : share of the tyres that sticks [1]
    effects : numbers of the vehicle's effects
    """
    if effects.lateral_stiffness <= 0.0:
        return NO_HOLD
    left = sqrt(max(limit * limit - brake_force * brake_force, 0.0))
    force = min(max(effects.lateral_stiffness * deflection, -left), left)
    incline = effects.track_change + effects.track_change_by_travel * travel
    sideways = speed * effects.bump_steer * travel + incline * rate
    return LateralHold(
        share * force * incline,
        compute_lateral_deflection_rate(deflection, sideways, limit / effects.lateral_stiffness),
    )
