"""The car's suspension: springs that stiffen, degressive dampers, stops, and arms that carry braking forces."""

from math import sqrt, tanh

from numba import njit


@njit(error_model="numpy")
def spring_force(travel: float, stiffness: float, progression: float) -> float:
    """Change of spring force from rest, positive in extension [N].

    Parameters
    ----------
    travel : rebound positive, from rest [m]
    stiffness : [N/m]
    progression : of the third power of travel [N/m3]
    """
    return stiffness * travel + progression * travel**3


@njit(error_model="numpy")
def damper_force(rate: float, damping: float, knee: float, asymmetry: float) -> float:
    """Degressive damper, positive in extension [N].

    Parameters
    ----------
    rate : of travel, rebound positive [m/s]
    damping : at rest [N s/m]
    knee : speed at which the damper has lost three tenths of it [m/s]
    asymmetry : share moved from bump to rebound [1]
    """
    side = 1.0 + asymmetry if rate > 0.0 else 1.0 - asymmetry
    return side * damping * rate / sqrt(1.0 + (rate / knee) ** 2)


@njit(error_model="numpy")
def stop_force(travel: float, clearance: float, stiffness: float, growth: float) -> float:
    """Progressive stop in compression; negative, for it pushes body and wheel apart [N].

    Parameters
    ----------
    travel : rebound positive [m]
    clearance : compression at which it is met [m]
    stiffness : where it is met [N/m]
    growth : compression beyond that by which its stiffness has doubled [m]
    """
    beyond = -travel - clearance
    if beyond <= 0.0:
        return 0.0
    return -stiffness * beyond * (1.0 + 0.5 * beyond / growth)


@njit(error_model="numpy")
def dry_friction(rate: float, force: float, width: float) -> float:
    """Dry friction of joints and seals, positive in extension [N].

    Parameters
    ----------
    rate : of travel [m/s]
    force : at any plain rate [N]
    width : rate over which it changes sign [m/s]
    """
    return force * tanh(rate / width)


@njit(error_model="numpy")
def swing_arm_force(
    brake_torque: float, radius: float, tangent: float, travel: float, migration: float
) -> float:
    """Vertical force that a swing arm passes from wheel to body, upward on the body [N].

    The knuckle takes the brake's torque, so that the ground's force acts on the arm at the contact: by virtual work
    the body is pushed up by that force times the tangent of the line from contact to the arm's centre of rotation
    (Gillespie 1992, ch. 7). The centre moves with travel wherever there is such an angle.

    Parameters
    ----------
    brake_torque : of the wheel [N m]
    radius : of the wheel [m]
    tangent : at rest; positive for a front arm that resists diving [1]
    travel : rebound positive [m]
    migration : growth of the tangent with compression, relative to that at rest [1/m]
    """
    return brake_torque / radius * tangent * (1.0 - migration * travel)
