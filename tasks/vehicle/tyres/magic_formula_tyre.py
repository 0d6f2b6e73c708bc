"""The Magic Formula in the form that the vehicle takes: longitudinal slip on one surface, for two tyres of an axle."""

from math import atan, cos, inf, pi, tan
from typing import NamedTuple

from numba import njit
from numba.extending import register_jitable

from tasks.vehicle.tyres.magic_formula import (
    Longitudinal,
    MagicFormula,
    bend_slip,
    compute_load_change,
    compute_longitudinal_curvature,
    compute_longitudinal_friction,
    compute_longitudinal_peak,
    compute_longitudinal_stiffness,
)

MOST_LOAD_CHANGE = 2.0
"""df_z above which friction stays constant: no tyre is measured at over three times its nominal load [1]."""


class MagicFormulaTyre(NamedTuple):
    """The longitudinal curve of an axle's tyres on one surface.

    Parameters
    ----------
    nominal_load : nominal load of both tyres of an axle [N]
    longitudinal : coefficients, scaled to the surface and without shifts
    peak : friction at the top of the curve under the nominal load, mu_eff [1]
    target_slip : braking slip there, kappa* [1]
    """

    nominal_load: float
    longitudinal: Longitudinal
    peak: float
    target_slip: float


@register_jitable
def scale_magic_formula(tyre: MagicFormula, peak: float, slip_stiffness: float) -> MagicFormulaTyre:
    """Scale a tyre to its peak and stiffness on a surface, by the formula's own factors.

    LMUX becomes peak / PDX1, so that the friction under the nominal load peaks at ``peak``; LKX becomes
    ``slip_stiffness``. The slip at the peak follows: it falls with the friction, since the stiffness does not.
    Shifts are left out: a wheel that rolls freely has no tyre force here, rolling resistance is an effect of its own.

    Parameters
    ----------
    tyre : tyre of the property file
    peak : mu_eff [1]
    slip_stiffness : beta [1]
    """
    c = tyre.longitudinal
    scaled = Longitudinal(
        pcx1=c.pcx1, pdx1=peak, pdx2=c.pdx2 * peak / c.pdx1, pdx3=c.pdx3, pex1=c.pex1, pex2=c.pex2, pex3=c.pex3,
        pex4=c.pex4, pkx1=c.pkx1 * slip_stiffness, pkx2=c.pkx2 * slip_stiffness, pkx3=c.pkx3, phx1=0.0, phx2=0.0,
        pvx1=0.0, pvx2=0.0,
    )  # fmt: skip
    target_slip = find_peak_slip(scaled)
    return MagicFormulaTyre(
        nominal_load=2.0 * tyre.nominal_load,
        longitudinal=scaled,
        peak=-compute_longitudinal_friction(-target_slip, 0.0, 0.0, scaled),
        target_slip=target_slip,
    )


@register_jitable
def find_peak_slip(c: Longitudinal) -> float:
    """Return the braking slip at which friction peaks under the nominal load, by bisection; at most 1 [1].

    Parameters
    ----------
    c : coefficients without shifts
    """
    stiffness = c.pkx1 / (c.pcx1 * c.pdx1)
    curvature = compute_longitudinal_curvature(0.0, -1.0, c)
    top = tan(0.5 * pi / c.pcx1) if c.pcx1 > 1.0 else inf
    low, high = 0.0, 1.0
    if bend_slip(stiffness, curvature) <= top:
        return high
    while (middle := 0.5 * (low + high)) not in (low, high):
        low, high = (middle, high) if bend_slip(stiffness * middle, curvature) < top else (low, middle)
    return middle


@njit(cache=True, nogil=True, error_model="numpy")
def compute_magic_formula_friction(braking_slip: float, load: float, tyre: MagicFormulaTyre) -> float:
    """Return braking force over load [1] (Pacejka 2012, 4.E9).

    Parameters
    ----------
    braking_slip : kappa, 0 or more; the book's is its negative [1]
    load : load of the axle [N]
    tyre : the tyre on the surface
    """
    load_change = min(compute_load_change(load, tyre.nominal_load), MOST_LOAD_CHANGE)
    return -compute_longitudinal_friction(-braking_slip, load_change, 0.0, tyre.longitudinal)


@njit(cache=True, nogil=True, error_model="numpy")
def compute_magic_formula_slope(braking_slip: float, load: float, tyre: MagicFormulaTyre) -> float:
    """Return the derivative of ``compute_magic_formula_friction`` by slip [1].

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    load : load of the axle [N]
    tyre : the tyre on the surface
    """
    c = tyre.longitudinal
    load_change = min(compute_load_change(load, tyre.nominal_load), MOST_LOAD_CHANGE)
    peak = compute_longitudinal_peak(load_change, 0.0, c)
    stiffness = compute_longitudinal_stiffness(load_change, c) / (c.pcx1 * peak)
    curvature = min(compute_longitudinal_curvature(load_change, -1.0, c), 1.0)
    scaled = stiffness * braking_slip
    bent = bend_slip(scaled, curvature)
    bending = stiffness * (1.0 - curvature + curvature / (1.0 + scaled * scaled))
    return peak * cos(c.pcx1 * atan(bent)) * c.pcx1 / (1.0 + bent * bent) * bending
