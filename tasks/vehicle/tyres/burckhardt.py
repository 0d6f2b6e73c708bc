"""The peak-normalised Burckhardt tyre, which does not depend on load."""

from math import exp, log
from typing import NamedTuple

from numba import njit
from numba.extending import register_jitable


class BurckhardtCurve(NamedTuple):
    """A base curve that rises and then falls, mu = c1 (1 - exp(-c2 kappa)) - c3 kappa (paper, Appendix B).

    Parameters
    ----------
    c1, c2, c3 : coefficients [1]
    """

    c1: float
    c2: float
    c3: float


class BurckhardtTyre(NamedTuple):
    """A Burckhardt curve scaled to one surface: mu = rise (1 - exp(-decay kappa)) - fall kappa.

    Parameters
    ----------
    rise, decay, fall : the base curve's c1, c2, c3 after scaling height and slip [1]
    peak : friction at the top of the curve, mu_eff [1]
    target_slip : slip at the top of the curve, kappa* [1]
    """

    rise: float
    decay: float
    fall: float
    peak: float
    target_slip: float


@register_jitable
def scale_burckhardt(curve: BurckhardtCurve, peak: float, slip_stiffness: float) -> BurckhardtTyre:
    """Scale a base curve to its peak and stiffness on a surface, mu_B(beta kappa; mu_eff) (paper, Appendix B).

    Parameters
    ----------
    curve : base curve
    peak : mu_eff [1]
    slip_stiffness : horizontal scale, beta [1]
    """
    c1, c2, c3 = curve
    peak_slip = min(log(c1 * c2 / c3) / c2, 1.0)
    scale = peak / (c1 * (1 - exp(-c2 * peak_slip)) - c3 * peak_slip)
    return BurckhardtTyre(
        rise=scale * c1,
        decay=c2 * slip_stiffness,
        fall=scale * c3 * slip_stiffness,
        peak=peak,
        target_slip=peak_slip / slip_stiffness,
    )


@njit(cache=True, nogil=True, forceinline=True)
def compute_burckhardt_friction(braking_slip: float, load: float, tyre: BurckhardtTyre) -> float:
    """Return braking force over load [1] (paper, Eq. tire_force).

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    load : load of the axle; without influence [N]
    tyre : scaled curve
    """
    return tyre.rise * (1.0 - exp(-tyre.decay * braking_slip)) - tyre.fall * braking_slip


@njit(cache=True, nogil=True, forceinline=True)
def compute_burckhardt_slope(braking_slip: float, load: float, tyre: BurckhardtTyre) -> float:
    """Return the derivative of ``compute_burckhardt_friction`` by slip [1].

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    load : load of the axle; without influence [N]
    tyre : scaled curve
    """
    return tyre.rise * tyre.decay * exp(-tyre.decay * braking_slip) - tyre.fall
