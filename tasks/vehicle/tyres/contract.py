"""The contract between vehicle and tyre: friction and slope at a slip and a load, the peak and the slip there.

A tyre is a NamedTuple of numbers on one surface, with the fields ``peak`` (largest friction [1]) and ``target_slip``
(braking slip at the peak [1]), and a law in ``LAWS``. A kernel takes any tyre as its argument: Numba compiles the
kernel once for each kind of tyre and inlines that kind's law, so the choice costs no time in the loop.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from numba import njit
from numba.extending import overload

from tasks.vehicle.tyres.burckhardt import (
    BurckhardtTyre,
    compute_burckhardt_friction,
    compute_burckhardt_slope,
)
from tasks.vehicle.tyres.magic_formula_tyre import (
    MagicFormulaTyre,
    compute_magic_formula_friction,
    compute_magic_formula_slope,
)

Tyre = BurckhardtTyre | MagicFormulaTyre
"""Every kind of tyre."""


class TyreLaw(NamedTuple):
    """Kernels of one kind of tyre, each of braking slip [1], axle load [N] and the tyre.

    Parameters
    ----------
    friction : braking force over load [1]
    slope : derivative of the friction by slip [1]
    """

    friction: Callable[[float, float, Any], float]
    slope: Callable[[float, float, Any], float]


LAWS: dict[type[Tyre], TyreLaw] = {
    BurckhardtTyre: TyreLaw(compute_burckhardt_friction, compute_burckhardt_slope),
    MagicFormulaTyre: TyreLaw(compute_magic_formula_friction, compute_magic_formula_slope),
}
"""The law of each kind of tyre."""


def compute_tyre_friction(braking_slip: float, load: float, tyre: Tyre) -> float:
    """Return braking force over load [1].

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    load : load of the axle, that is of two tyres [N]
    tyre : the tyre on the surface
    """
    return LAWS[type(tyre)].friction(braking_slip, load, tyre)


def compute_tyre_slope(braking_slip: float, load: float, tyre: Tyre) -> float:
    """Return the derivative of ``compute_tyre_friction`` by slip [1].

    Parameters
    ----------
    braking_slip : kappa, 0 or more [1]
    load : load of the axle, that is of two tyres [N]
    tyre : the tyre on the surface
    """
    return LAWS[type(tyre)].slope(braking_slip, load, tyre)


@overload(compute_tyre_friction)
def _compile_friction(braking_slip: Any, load: Any, tyre: Any) -> Callable[..., float]:
    """Return the implementation of ``compute_tyre_friction`` that Numba compiles for a kind of tyre."""
    law = LAWS[tyre.instance_class].friction

    def evaluate_friction(braking_slip: Any, load: Any, tyre: Any) -> float:
        return law(braking_slip, load, tyre)

    return evaluate_friction


@overload(compute_tyre_slope)
def _compile_slope(braking_slip: Any, load: Any, tyre: Any) -> Callable[..., float]:
    """Return the implementation of ``compute_tyre_slope`` that Numba compiles for a kind of tyre."""
    law = LAWS[tyre.instance_class].slope

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
