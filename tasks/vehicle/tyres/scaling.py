"""Folding of the scaling factors and the pressure of a tyre property file into the coefficients of a Magic Formula.

Equation numbers are those of Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012; MF 5.2 differs from them as its manual
says (MF-Tyre/MF-Swift 6.1 Equation Manual, TNO 2008, and MF-Tyre 5.2 User Manual, TNO 2001): no pressure, camber by
LGAX, LGAY and PHY3, shifts scaled by LMUX and LMUY themselves.
"""

from collections.abc import Mapping
from typing import NamedTuple

from tasks.vehicle.tyres.magic_formula import Combined, Lateral, Longitudinal, MagicFormula


class CoefficientNames(NamedTuple):
    """Names of the force coefficients in a tyre property file of one version.

    Parameters
    ----------
    needed : nominal load [N] and coefficients [1]
    optional : coefficients that are 0 where the file has none [1]
    factors : scaling factors that are 1 where the file has none [1]
    """

    needed: tuple[str, ...]
    optional: tuple[str, ...]
    factors: tuple[str, ...]


_COEFFICIENTS = (
    "FNOMIN", "PCX1", "PDX1", "PDX2", "PDX3", "PEX1", "PEX2", "PEX3", "PEX4", "PKX1", "PKX2", "PKX3", "PHX1", "PHX2",
    "PVX1", "PVX2", "RBX1", "RBX2", "RCX1", "REX1", "REX2", "RHX1", "PCY1", "PDY1", "PDY2", "PDY3", "PEY1", "PEY2",
    "PEY3", "PEY4", "PKY1", "PKY2", "PKY3", "PHY1", "PHY2", "PVY1", "PVY2", "PVY3", "PVY4", "RBY1", "RBY2", "RBY3",
    "RCY1", "REY1", "REY2", "RHY1", "RHY2", "RVY1", "RVY2", "RVY3", "RVY4", "RVY5", "RVY6",
)  # fmt: skip
_PRESSURE = ("PPX1", "PPX2", "PPX3", "PPX4", "PPY1", "PPY2", "PPY3", "PPY4", "PPY5", "INFLPRES", "NOMPRES")
_FACTORS = (
    "LFZO", "LCX", "LMUX", "LEX", "LKX", "LHX", "LVX", "LXAL", "LCY", "LMUY", "LEY", "LKY", "LHY", "LVY", "LYKA",
    "LVYKA",
)  # fmt: skip
NAMES = {
    "MF 5.2": CoefficientNames((*_COEFFICIENTS, "PHY3"), (), (*_FACTORS, "LGAX", "LGAY")),
    "MF 6.1": CoefficientNames(
        (*_COEFFICIENTS, "PKY4", "PKY6", "PKY7"),
        ("PEY5", "PKY5", "RBX3", "RBY4", *_PRESSURE),
        (*_FACTORS, "LKYC"),
    ),
}
"""Names of each version of the Magic Formula."""
LOW_FRICTION = 10.0
"""A_mu, by which vertical shifts vanish slower than the friction does [1] (4.E8)."""


def fold_scaling(values: Mapping[str, float], version: str) -> MagicFormula:
    """Return the tyre with every scaling factor and the inflation pressure in its coefficients.

    Parameters
    ----------
    values : numbers of a tyre property file by name, with all that the version needs; others are ignored
    version : key of ``NAMES``
    """
    newer = version == "MF 6.1"
    names = NAMES[version]
    v = {name: 0.0 for names in NAMES.values() for name in (*names.needed, *names.optional)} | {"PKY4": 2.0}
    v |= {name: 1.0 for names in NAMES.values() for name in names.factors}
    known = {name for group in names for name in group}
    v |= {name: float(value) for name, value in values.items() if name in known}
    pressure = v["INFLPRES"] / v["NOMPRES"] - 1.0 if v["INFLPRES"] > 0.0 and v["NOMPRES"] > 0.0 else 0.0
    return MagicFormula(
        nominal_load=v["FNOMIN"] * v["LFZO"],
        longitudinal=_fold_longitudinal(v, pressure, newer),
        lateral=_fold_lateral(v, pressure, newer),
        combined=_fold_combined(v),
    )


def _fold_longitudinal(v: Mapping[str, float], pressure: float, newer: bool) -> Longitudinal:
    """Return the longitudinal coefficients with factors and pressure in them [1]."""
    stiffness = v["LKX"] * (1.0 + v["PPX1"] * pressure + v["PPX2"] * pressure**2)
    friction = v["LMUX"] * (1.0 + v["PPX3"] * pressure + v["PPX4"] * pressure**2)
    shift = v["LVX"] * (_compute_shift_scale(v["LMUX"]) if newer else v["LMUX"])
    return Longitudinal(
        pcx1=v["PCX1"] * v["LCX"],
        pdx1=v["PDX1"] * friction,
        pdx2=v["PDX2"] * friction,
        pdx3=v["PDX3"] * v["LGAX"] ** 2,
        pex1=v["PEX1"] * v["LEX"],
        pex2=v["PEX2"] * v["LEX"],
        pex3=v["PEX3"] * v["LEX"],
        pex4=v["PEX4"],
        pkx1=v["PKX1"] * stiffness,
        pkx2=v["PKX2"] * stiffness,
        pkx3=v["PKX3"],
        phx1=v["PHX1"] * v["LHX"],
        phx2=v["PHX2"] * v["LHX"],
        pvx1=v["PVX1"] * shift,
        pvx2=v["PVX2"] * shift,
    )


def _fold_lateral(v: Mapping[str, float], pressure: float, newer: bool) -> Lateral:
    """Return the lateral coefficients with factors and pressure in them [1]."""
    friction = v["LMUY"] * (1.0 + v["PPY3"] * pressure + v["PPY4"] * pressure**2)
    slow = _compute_shift_scale(v["LMUY"]) if newer else v["LMUY"]
    lean, load = v["LGAY"], 1.0 + v["PPY2"] * pressure
    stiffness = v["LKYC"] * (1.0 + v["PPY5"] * pressure)
    return Lateral(
        pcy1=v["PCY1"] * v["LCY"],
        pdy1=v["PDY1"] * friction,
        pdy2=v["PDY2"] * friction,
        pdy3=v["PDY3"] * lean**2,
        pey1=v["PEY1"] * v["LEY"],
        pey2=v["PEY2"] * v["LEY"],
        pey3=v["PEY3"],
        pey4=v["PEY4"] * lean,
        pey5=v["PEY5"],
        pky1=v["PKY1"] * v["LKY"] * (1.0 + v["PPY1"] * pressure),
        pky2=v["PKY2"] * load,
        pky3=v["PKY3"] * lean,
        pky4=v["PKY4"],
        pky5=v["PKY5"] * load,
        pky6=v["PKY6"] * stiffness,
        pky7=v["PKY7"] * stiffness,
        phy1=v["PHY1"] * v["LHY"],
        phy2=v["PHY2"] * v["LHY"],
        phy3=v["PHY3"] * lean,
        pvy1=v["PVY1"] * v["LVY"] * slow,
        pvy2=v["PVY2"] * v["LVY"] * slow,
        pvy3=v["PVY3"] * v["LKYC"] * lean * slow,
        pvy4=v["PVY4"] * v["LKYC"] * lean * slow,
        shift_by_stiffness=float(newer),
    )


def _fold_combined(v: Mapping[str, float]) -> Combined:
    """Return the coefficients of combined slip with their factors in them [1]."""
    factor = {"RBX1": "LXAL", "RBX3": "LXAL", "RBY1": "LYKA", "RBY4": "LYKA"}
    factor |= dict.fromkeys(("RVY1", "RVY2", "RVY3"), "LVYKA")
    return Combined(**{
        name: v[name.upper()] * v.get(factor.get(name.upper(), ""), 1.0) for name in Combined._fields
    })  # fmt: skip


def _compute_shift_scale(friction: float) -> float:
    """Return the friction scale of vertical shifts, lambda_mu' [1] (4.E8)."""
    return LOW_FRICTION * friction / (1.0 + (LOW_FRICTION - 1.0) * friction)
