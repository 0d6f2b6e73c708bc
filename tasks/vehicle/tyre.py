"""The peak-normalised Burckhardt tyre and its slip."""

from math import exp, log
from typing import NamedTuple

from numba import njit


class TyreCurve(NamedTuple):
    """A Burckhardt curve scaled to one surface, as the kernels take it.

    Parameters
    ----------
    c1, c2, c3 : base curve [1]
    peak : friction at the top of the curve, mu_eff [1]
    slip_stiffness : horizontal scale, beta [1]
    base_peak : top of the base curve on slips of 0 to 1 [1]
    target_slip : slip at the top of the scaled curve, kappa* [1]
    """

    c1: float
    c2: float
    c3: float
    peak: float
    slip_stiffness: float
    base_peak: float
    target_slip: float


def tyre_curve(burckhardt: tuple[float, float, float], peak: float, slip_stiffness: float) -> TyreCurve:
    """Scale a base curve to its peak and stiffness on a surface (paper, Appendix B).

    Parameters
    ----------
    burckhardt : c1, c2, c3 of a curve that rises and then falls [1]
    peak : mu_eff [1]
    slip_stiffness : beta [1]
    """
    c1, c2, c3 = burckhardt
    peak_slip = min(log(c1 * c2 / c3) / c2, 1.0)
    base_peak = c1 * (1 - exp(-c2 * peak_slip)) - c3 * peak_slip
    return TyreCurve(c1, c2, c3, peak, slip_stiffness, base_peak, peak_slip / slip_stiffness)


@njit(cache=True, nogil=True)
def tyre_friction(braking_slip: float, tyre: TyreCurve) -> float:
    """Braking force over load, mu_B(beta kappa; mu_eff) [1] (paper, Eq. tire_force).

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    tyre : the scaled curve
    """
    x = tyre.slip_stiffness * braking_slip
    return tyre.peak / tyre.base_peak * (tyre.c1 * (1.0 - exp(-tyre.c2 * x)) - tyre.c3 * x)


@njit(cache=True, nogil=True)
def tyre_slope(braking_slip: float, tyre: TyreCurve) -> float:
    """Rise of ``tyre_friction`` with slip, its derivative [1].

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    tyre : the scaled curve
    """
    x = tyre.slip_stiffness * braking_slip
    return (
        tyre.peak / tyre.base_peak * tyre.slip_stiffness * (tyre.c1 * tyre.c2 * exp(-tyre.c2 * x) - tyre.c3)
    )


@njit(cache=True, nogil=True)
def braking_slip(speed: float, rim_speed: float, speed_floor: float) -> float:
    """Braking slip kappa, clipped to [0, 1] [1] (paper, Eq. tire_force).

    Parameters
    ----------
    speed : v [m/s]
    rim_speed : R omega [m/s]
    speed_floor : v_epsilon [m/s]
    """
    return min(max((speed - rim_speed) / max(speed, speed_floor), 0.0), 1.0)
