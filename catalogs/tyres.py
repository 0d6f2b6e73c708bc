"""Tyres of the Magic Formula: property files (.tir) as test benches and other simulators write them."""

import re
from collections.abc import Mapping
from itertools import product
from math import isfinite

from catalogs.sentences import cap_problems, shorten, shorten_value
from tasks.errors import InputError
from tasks.vehicle.tyres.magic_formula import (
    MagicFormula,
    compute_longitudinal_peak,
    compute_longitudinal_stiffness,
    compute_tyre_forces,
)
from tasks.vehicle.tyres.magic_formula_tyre import MOST_LOAD_CHANGE
from tasks.vehicle.tyres.scaling import NAMES, fold_scaling

VERSIONS = {"6": "MF 5.2", "52": "MF 5.2", "61": "MF 6.1", "62": "MF 6.1"}
"""Version of the forces' equations by FITTYP; what 6.2 adds to 6.1 is the overturning moment, not a force."""
UNITS = {
    "LENGTH": ("meter", "metre", "m"),
    "FORCE": ("newton", "n"),
    "ANGLE": ("radian", "radians", "rad"),
    "MASS": ("kg", "kilogram"),
    "TIME": ("second", "s"),
}
SECTIONS = {
    "UNITS", "MODEL", "OPERATING_CONDITIONS", "VERTICAL", "LONGITUDINAL_COEFFICIENTS", "LATERAL_COEFFICIENTS",
    "SCALING_COEFFICIENTS",
}  # fmt: skip
"""Sections that are read; others say nothing about the forces, and may hold tables."""
_KEY = re.compile(r"[A-Z][A-Z0-9_]*")
_COMMENT = re.compile(r"""^((?:[^'"$!]|'[^']*'|"[^"]*")*)[$!].*$""")


def parse_tyre(content: bytes, origin: object) -> MagicFormula:
    """The tyre that a property file holds.

    Parameters
    ----------
    content : of the file; characters beyond ASCII stand in comments only
    origin : where it comes from, for the sentences

    Raises
    ------
    InputError
        One sentence for each fault: no SI units, an unknown FITTYP, a value that is no number or stands twice, all
        coefficients that its version needs and that are missing, a curve without grip.
    """
    entries, problems = _read_lines(content)
    problems += [
        f"{unit} must be {names[0]}; it is {shorten_value(value)}"
        for unit, names in UNITS.items()
        if (value := entries.get(unit, names[0])).lower() not in names
    ]
    version = VERSIONS.get(entries.get("FITTYP", ""))
    if version is None:
        known = "6 or 52 (MF 5.2), 61 or 62 (MF 6.1)"
        problems.append(f"FITTYP must be {known}; it is {shorten_value(entries.get('FITTYP'))}")
    values: dict[str, float] = {}
    if version is not None:
        names = NAMES[version]
        missing = [name for name in names.needed if name not in entries]
        if missing:
            problems.append(
                f"{version} needs {', '.join(missing)}: add them, with 0 for what has no influence"
            )
        for name in (*names.needed, *names.optional, *names.factors):
            number = _read_number(entries.get(name, "0"))
            if number is None:
                problems.append(f"{name} must be a finite number; it is {shorten_value(entries[name])}")
            elif name in entries:
                values[name] = number
        if not problems:
            problems = _find_shape_problems(values, version)
    if problems or version is None:
        raise InputError(cap_problems([f"{shorten(origin)}: {problem}" for problem in problems]))
    return fold_scaling(values, version)


def tyre_entries(content: bytes) -> dict[str, str]:
    """Keys and values of the sections that are read, as text; what is no entry is left out.

    Parameters
    ----------
    content : of a property file
    """
    return _read_lines(content)[0]


def _read_lines(content: bytes) -> tuple[dict[str, str], list[str]]:
    """Keys and values of the sections that are read, and what is wrong with their lines."""
    entries: dict[str, str] = {}
    problems: list[str] = []
    section = ""
    for number, whole in enumerate(content.decode("utf-8-sig", "replace").splitlines(), 1):
        line = _COMMENT.sub(r"\1", whole).strip()
        if line.startswith("["):
            section = line.strip("[]").strip().upper().replace(" ", "_")
        if not line or line.startswith("[") or section not in SECTIONS:
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
        if not equals or not _KEY.fullmatch(key.upper()):
            problems.append(
                f"line {number} must be KEY = value, as all of [{section}]; it is {shorten_value(line)}"
            )
        elif key.upper() in entries:
            problems.append(f"{key.upper()} must stand once; it stands again in line {number}")
        else:
            entries[key.upper()] = value.strip("'\"").strip()
    return entries, problems


def _read_number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if isfinite(number) else None


def _find_shape_problems(values: Mapping[str, float], version: str) -> list[str]:
    """List why the coefficients describe no tyre: no load, no peak, no grip, or forces that are not finite."""
    if values["FNOMIN"] <= 0 or values.get("LFZO", 1.0) <= 0:
        return [
            f"FNOMIN and LFZO must be above 0; they are {values['FNOMIN']:g} and {values.get('LFZO', 1.0):g}"
        ]
    tyre = fold_scaling(values, version)
    c, problems = tyre.longitudinal, []
    if not 1.0 < c.pcx1 <= 2.0:
        problems.append(f"PCX1 LCX must be above 1 and at most 2, for a curve with a peak; it is {c.pcx1:g}")
    if not 0.0 < tyre.lateral.pcy1 <= 2.0:
        problems.append(f"PCY1 LCY must be above 0 and at most 2; it is {tyre.lateral.pcy1:g}")
    for load in (0.0, 1.0, 1.0 + MOST_LOAD_CHANGE):
        peak, stiffness = (
            compute_longitudinal_peak(load - 1.0, 0.0, c),
            compute_longitudinal_stiffness(load - 1.0, c),
        )
        if not (0 < peak < 10 and 0 < stiffness < 1e4):
            problems.append(
                "peak friction and slip stiffness must be above 0, below 10 and 10,000 of the load; under"
                f" {load:g} FNOMIN they are {peak:g} and {stiffness:g}"
            )
    grid = product((-1.0, -0.05, 0.0, 0.5), (-0.5, 0.0, 0.1), (-0.1, 0.0), (0.1, 1.0, 1.0 + MOST_LOAD_CHANGE))
    forces = [
        compute_tyre_forces(slip, angle, lean, load * tyre.nominal_load, tyre)
        for slip, angle, lean, load in grid
    ]
    if not all(isfinite(force) for pair in forces for force in pair):
        problems.append("the coefficients must give finite forces in combined slip; some are not")
    return problems
