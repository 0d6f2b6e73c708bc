"""The contract between vehicle and tyre: friction and slope at a slip and a load, the peak and the slip there.

A curve is what a vehicle's file says of its tyres; scaled to a surface it is a tyre. A tyre is a NamedTuple of numbers
with the fields ``peak`` (largest friction [1]) and ``target_slip`` (braking slip at the peak [1]). Each kind of tyre is
one row of ``LAWS``, and its law is chosen there alone. A kernel takes any curve or tyre as its argument: Numba compiles
the kernel once for each kind and inlines that kind's law, so the choice costs no time in the loop.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from numba import njit
from numba.extending import overload

from tasks.vehicle.tyres.burckhardt import (
    BurckhardtCurve,
    BurckhardtTyre,
    compute_burckhardt_friction,
    compute_burckhardt_slope,
    scale_burckhardt,
)
from tasks.vehicle.tyres.magic_formula import MagicFormula
from tasks.vehicle.tyres.magic_formula_tyre import (
    MagicFormulaTyre,
    compute_magic_formula_friction,
    compute_magic_formula_slope,
    scale_magic_formula,
)

Curve = BurckhardtCurve | MagicFormula
"""Every kind of curve that a vehicle's file may hold."""
Tyre = BurckhardtTyre | MagicFormulaTyre
"""Every kind of tyre."""


class TyreLaw(NamedTuple):
    """One kind of tyre.

    Parameters
    ----------
    curve, tyre : its types before and after scaling
    scale : curve, peak [1] and slip stiffness [1] to the tyre on a surface
    friction : braking slip [1], axle load [N] and tyre to braking force over load [1]
    slope : the same to the derivative of the friction by slip [1]
    formula : its friction in words, of ``kappa``, ``load`` and ``stiffness``
    """

    curve: type[Any]
    tyre: type[Any]
    scale: Callable[[Any, float, float], Any]
    friction: Callable[[float, float, Any], float]
    slope: Callable[[float, float, Any], float]
    formula: str


LAWS = (
    TyreLaw(
        curve=BurckhardtCurve, tyre=BurckhardtTyre, scale=scale_burckhardt, friction=compute_burckhardt_friction,
        slope=compute_burckhardt_slope, formula="mu_B({stiffness:.4g} * {kappa:.4g})",
    ),
    TyreLaw(
        curve=MagicFormula, tyre=MagicFormulaTyre, scale=scale_magic_formula,
        friction=compute_magic_formula_friction, slope=compute_magic_formula_slope,
        formula="mu_MF({kappa:.4g}, {load:.6g})",
    ),
)  # fmt: skip
"""Every kind of tyre."""


def find_law(kind: type[Any]) -> TyreLaw:
    """Return the law of a kind of curve or tyre.

    Parameters
    ----------
    kind : type of the curve or the tyre
    """
    return next(law for law in LAWS if kind in (law.curve, law.tyre))


def scale_curve(curve: Curve, peak: float, slip_stiffness: float) -> Tyre:
    """Return the tyre that a curve is on a surface.

    Parameters
    ----------
    curve : of the vehicle's tyres
    peak : mu_eff [1]
    slip_stiffness : horizontal scale, beta [1]
    """
    tyre: Tyre = find_law(type(curve)).scale(curve, peak, slip_stiffness)
    return tyre


def compute_tyre_friction(braking_slip: float, load: float, tyre: Tyre) -> float:
    """Return braking force over load [1].

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    load : load of the axle, that is of two tyres [N]
    tyre : the tyre on the surface
    """
    return find_law(type(tyre)).friction(braking_slip, load, tyre)


def compute_tyre_slope(braking_slip: float, load: float, tyre: Tyre) -> float:
    """Return the derivative of ``compute_tyre_friction`` by slip [1].

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    load : load of the axle, that is of two tyres [N]
    tyre : the tyre on the surface
    """
    return find_law(type(tyre)).slope(braking_slip, load, tyre)


@overload(scale_curve)
def _compile_scale(curve: Any, peak: Any, slip_stiffness: Any) -> Callable[..., Tyre]:
    """Return the implementation of ``scale_curve`` that Numba compiles for a kind of curve."""
    scale = find_law(curve.instance_class).scale

    def evaluate_scale(curve: Any, peak: Any, slip_stiffness: Any) -> Tyre:
        tyre: Tyre = scale(curve, peak, slip_stiffness)
        return tyre

    return evaluate_scale


@overload(compute_tyre_friction)
def _compile_friction(braking_slip: Any, load: Any, tyre: Any) -> Callable[..., float]:
    """Return the implementation of ``compute_tyre_friction`` that Numba compiles for a kind of tyre."""
    law = find_law(tyre.instance_class).friction

    def evaluate_friction(braking_slip: Any, load: Any, tyre: Any) -> float:
        return law(braking_slip, load, tyre)

    return evaluate_friction


@overload(compute_tyre_slope)
def _compile_slope(braking_slip: Any, load: Any, tyre: Any) -> Callable[..., float]:
    """Return the implementation of ``compute_tyre_slope`` that Numba compiles for a kind of tyre."""
    law = find_law(tyre.instance_class).slope

    def evaluate_slope(braking_slip: Any, load: Any, tyre: Any) -> float:
        return law(braking_slip, load, tyre)

    return evaluate_slope


@njit(cache=True, nogil=True, forceinline=True)
def compute_braking_slip(speed: float, rim_speed: float, speed_floor: float) -> float:
    """Return the braking slip kappa, clipped to [0, 1] [1] (paper, Eq. tire_force).

    Parameters
    ----------
    speed : v [m/s]
    rim_speed : R omega [m/s]
    speed_floor : v_epsilon [m/s]
    """
    return min(max((speed - rim_speed) / max(speed, speed_floor), 0.0), 1.0)
