"""Friction of a wet road by film and speed: the law beside the paper's, which knows the film alone.

Of the friction on wet texture, falling with speed, a film that stands above the texture takes away the share of the
load that it carries. That share rises with the square of the speed, as the dynamic pressure of the water does, and is
full at the onset of hydroplaning (Horne and Dreher 1963, NASA TN D-2056).
"""

from math import exp, inf, sqrt
from typing import NamedTuple

HORNE = 6.36 / 3.6
"""Speed at which a deep film carries the whole tyre, over the root of its pressure [m/s/kPa^.5]."""


class WetGrip(NamedTuple):
    """How friction under one film depends on speed; the default does not, as the paper's law.

    Parameters
    ----------
    decay : of the friction on wet texture, over speed [s/m]
    carried : share of the load that the film carries from the onset of hydroplaning on [1]
    onset : speed at which a deep film carries the whole tyre [m/s]
    floor : friction that is left on a film that carries all, over that on wet texture at rest [1]
    reference : friction at the speed for which mu_c holds, over that on wet texture at rest [1]
    """

    decay: float = 0.0
    carried: float = 0.0
    onset: float = inf
    floor: float = 0.0
    reference: float = 1.0


ANY_SPEED = WetGrip()
"""Friction that does not depend on speed."""


def compute_wet_share(speed: float, grip: WetGrip) -> float:
    """Return the friction at a speed over that on wet texture at rest [1].

    Parameters
    ----------
    speed : of the tyre along the road [m/s]
    grip : of the film
    """
    lift = min(speed / grip.onset, 1.0)
    return max(exp(-grip.decay * speed) * (1.0 - grip.carried * lift * lift), grip.floor)


def make_wet_grip(
    above_mm: float,
    friction: float,
    decay_speed: float,
    planing_film_mm: float,
    planing_exponent: float,
    tyre_pressure_kpa: float,
    planing_friction: float,
    reference_speed: float,
) -> WetGrip:
    """Return how friction under a film depends on speed.

    Parameters
    ----------
    above_mm : depth of the film above the mean texture depth; water within the texture carries nothing [mm]
    friction, decay_speed, planing_film_mm, planing_exponent, tyre_pressure_kpa, planing_friction, reference_speed :
        the fields ``wet_...`` of ``SurfaceParameters`` [1, m/s, mm, 1, kPa, 1, m/s]
    """
    carried = 1.0 - exp(-((max(above_mm, 0.0) / planing_film_mm) ** planing_exponent))
    onset = HORNE * sqrt(tyre_pressure_kpa)
    at_rest = WetGrip(1.0 / decay_speed, carried, onset, planing_friction / friction, 1.0)
    return WetGrip(at_rest.decay, carried, onset, at_rest.floor, compute_wet_share(reference_speed, at_rest))
