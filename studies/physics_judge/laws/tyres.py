"""The tyre's curve on one surface: Burckhardt's (paper, Appendix B), or the Magic Formula (Pacejka 2012, 4.E9)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from studies.physics_judge.laws.constants import (
    Constants,
    Floats,
    compute_burckhardt_friction,
    peak_slip,
)

MOST_LOAD_CHANGE = 2.0
"""df_z above which friction over load stays as it is [1] (docs/reference/tyres.md)."""
BISECTIONS = 80
"""Halvings of the slip's interval [1]."""
BLOWN = ("61", "62")
"""Values of FITTYP whose forces depend on the pressure."""


@dataclass(frozen=True, kw_only=True)
class MagicNumbers:
    """Longitudinal coefficients of the Magic Formula (Pacejka 2012, 4.E9 to 4.E18).

    Parameters
    ----------
    nominal_load : of one tyre [N]
    shape : PCX1 [1]
    peak : PDX1, PDX2 [1]
    curvature : PEX1 to PEX4 [1]
    stiffness : PKX1 to PKX3 [1]
    """

    nominal_load: float
    shape: float
    peak: tuple[float, float]
    curvature: tuple[float, float, float, float]
    stiffness: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class TyreCurve:
    """Friction over braking slip on one surface.

    Parameters
    ----------
    friction, slope : of braking slip, 0 or more [1], and axle load [N]: force over load, and its derivative by slip [1]
    peak : height of the curve under the nominal load [1]
    target_slip : slip there, which the ABS holds [1]
    """

    friction: Callable[[Floats, Floats], Floats]
    slope: Callable[[Floats, Floats], Floats]
    peak: float
    target_slip: float


def find_curve(facts: Mapping[str, Any], constants: Constants) -> TyreCurve:
    """Return the curve of a clip's tyre.

    Parameters
    ----------
    facts : the clip's row
    constants : car and pavement
    """
    family = constants.tyres[facts["weather"]]
    beta = family.at(family.slip_stiffness, facts["surface_friction"])
    if constants.tyre is None:
        return _scale_burckhardt(family.burckhardt, facts["tyre_peak"], beta)
    magic = read_magic_formula(constants.tyre)
    meant = family.at(family.efficiency, facts["surface_friction"]) * facts["surface_friction"]
    curve = _scale_magic_formula(magic, facts["tyre_peak"], beta)
    # a curve without a peak before full slip has its stated peak there, below eta mu_c
    return curve if curve.target_slip < 1.0 else _scale_magic_formula(magic, meant, beta)


def _scale_burckhardt(base: tuple[float, float, float], peak: float, beta: float) -> TyreCurve:
    top = peak_slip(base)
    scale = peak / float(compute_burckhardt_friction(np.array(top), base))
    c1, c2, c3 = base
    return TyreCurve(
        friction=lambda slip, load: scale * compute_burckhardt_friction(beta * slip, base),
        slope=lambda slip, load: scale * beta * (c1 * c2 * np.exp(-c2 * beta * slip) - c3),
        peak=peak,
        target_slip=top / beta,
    )


class _Scaled(NamedTuple):
    """B, C, D and E of the formula under a load, each [N] or a scalar [1]."""

    B: Floats
    C: float
    D: Floats
    E: Floats


def _scale_magic_formula(tyre: MagicNumbers, peak: float, beta: float) -> TyreCurve:
    def scale(load: Floats) -> _Scaled:
        df = np.minimum(np.asarray(load) / (2.0 * tyre.nominal_load) - 1.0, MOST_LOAD_CHANGE)
        D = peak * (1.0 + tyre.peak[1] / tyre.peak[0] * df)
        K = beta * (tyre.stiffness[0] + tyre.stiffness[1] * df) * np.exp(tyre.stiffness[2] * df)
        E = (tyre.curvature[0] + df * (tyre.curvature[1] + df * tyre.curvature[2])) * (
            1.0 + tyre.curvature[3]
        )
        return _Scaled(K / (tyre.shape * D), tyre.shape, D, np.minimum(E, 1.0))

    def friction(slip: Floats, load: Floats) -> Floats:
        B, C, D, E = scale(load)
        x = B * slip
        return np.asarray(D * np.sin(C * np.arctan(x - E * (x - np.arctan(x)))))

    def slope(slip: Floats, load: Floats) -> Floats:
        B, C, D, E = scale(load)
        x = B * slip
        bent = x - E * (x - np.arctan(x))
        return np.asarray(D * np.cos(C * np.arctan(bent)) * C / (1 + bent**2) * B * (1 - E + E / (1 + x**2)))

    nominal = np.array(2.0 * tyre.nominal_load)
    low, high = 0.0, 1.0
    if slope(np.array(1.0), nominal) < 0:
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if slope(np.array(middle), nominal) > 0 else (low, middle)
    return TyreCurve(
        friction=friction, slope=slope, peak=float(friction(np.array(high), nominal)), target_slip=high
    )


def read_magic_formula(entries: Mapping[str, str]) -> MagicNumbers:
    """Return the longitudinal numbers of a tyre property file, with its factors and its pressure in them.

    Parameters
    ----------
    entries : values by their names in the file, as text; a factor that it lacks is 1, a coefficient 0
    """

    def factor(name: str) -> float:
        return float(entries.get(name, 1.0))

    def number(name: str) -> float:
        return float(entries.get(name, 0.0))

    blown = (
        number("INFLPRES") / number("NOMPRES") - 1.0
        if entries["FITTYP"] in BLOWN and number("INFLPRES") * number("NOMPRES") > 0
        else 0.0
    )
    bend = factor("LEX")
    stiffer = factor("LKX") * (1.0 + number("PPX1") * blown + number("PPX2") * blown**2)
    grip = factor("LMUX") * (1.0 + number("PPX3") * blown + number("PPX4") * blown**2)
    return MagicNumbers(
        nominal_load=number("FNOMIN") * factor("LFZO"),
        shape=number("PCX1") * factor("LCX"),
        peak=(number("PDX1") * grip, number("PDX2") * grip),
        curvature=(number("PEX1") * bend, number("PEX2") * bend, number("PEX3") * bend, number("PEX4")),
        stiffness=(number("PKX1") * stiffer, number("PKX2") * stiffer, number("PKX3")),
    )
