"""``musync vehicle new`` and ``check``: a short file for a data sheet, and its figures beside those of real cars."""

import json
import os
from collections.abc import Mapping
from math import isfinite, nan
from pathlib import Path
from typing import Any

import yaml

from catalogs.entries import YAML, load
from catalogs.plausible_vehicle import find_plausibility_problems
from catalogs.sentences import shorten
from catalogs.vehicles import open_vehicle
from catalogs.vehicles.numbers import VehicleNumber
from tasks.errors import InputError
from tasks.vehicle.figures import compute_figures

TO_FILL_IN = "TO FILL IN"
"""How the source of a number begins for which nobody has said yet where it comes from."""
DATA_SHEET = {
    "sprung_mass": "Mass of the body: of the car as it was driven, with fuel and people, less both unsprung masses.",
    "unsprung_mass_f": "Wheels, tyres, brakes and half of the links of the front axle, both sides.",
    "unsprung_mass_r": "The same of the rear axle.",
    "cg_to_front_axle": "Wheelbase x (mass on the rear axle - unsprung_mass_r) / sprung_mass.",
    "cg_to_rear_axle": "Wheelbase x (mass on the front axle - unsprung_mass_f) / sprung_mass; both add up to it.",
    "cg_height": "Height of the centre of gravity above the road; without a measurement 0.2 x wheelbase.",
    "wheel_radius": "Rolling radius: way of one turn of the wheel / 6.283; some 0.97 x the free radius of the tyre.",
    "brake_gain": "Torque of all brakes for 1 MPa: mass x wheel_radius x deceleration / pressure, of an even stop.",
    "front_brake_share": "Share of this torque at the front axle.",
    "pitch_inertia": "Of the body; without a measurement 0.9 x sprung_mass x cg_to_front_axle x cg_to_rear_axle.",
    "wheel_inertia_f": "Both front wheels, with tyres and discs: some 0.7 x their mass x wheel_radius squared.",
    "wheel_inertia_r": "The same of the rear axle.",
}
"""The numbers that a data sheet has, or that follow from one: field of `Vehicle`, and how to get it."""
HEADER = """\
# {name}: a car of your own. What does not stand in this file is that of the vehicle that it extends.
# Each number has a value, a unit, a source (a data sheet and its page, a scale, a guess) and a tolerance: one sigma, in
# the number's own unit; without it nothing is said of how far the value may be off.
# Delete the lines of a number that you do not know: it is inherited. Axle values are of both sides together.
# Then: musync vehicle check {file}
{extends}"""


def check_vehicle(vehicle: str) -> dict[str, Any]:
    """Say what of a vehicle is implausible.

    Parameters
    ----------
    vehicle : catalogue name or file

    Returns
    -------
    ``plausible``; ``problems``, a sentence each; ``figures`` with their ranges; ``tolerances``, one sigma over the
    value [1]; ``without_source``, the numbers of a template for which nobody has said yet where they come from.

    Raises
    ------
    InputError
        As `catalogs.vehicles.open_vehicle`.
    """
    file = open_vehicle(vehicle)
    figures, tolerances = compute_figures(file.build()), file.tolerances
    problems = find_plausibility_problems(figures, tolerances)
    ranges = load("table of plausible figures").figures
    return {
        "vehicle": vehicle,
        "plausible": not problems,
        "problems": problems,
        "figures": [
            {
                "figure": name,
                "value": value if isfinite(value) else None,
                "unit": ranges[name].unit,
                "low": ranges[name].low,
                "high": ranges[name].high,
            }
            for name, value in figures.items()
        ],
        "tolerances": tolerances,
        "without_source": [
            name for name, number in file.numbers.items() if number.source.startswith(TO_FILL_IN)
        ],
    }


def format_text(result: dict[str, Any]) -> str:
    """Return the result as sentences for people, below them the figures.

    Parameters
    ----------
    result : of `check_vehicle`
    """
    name, problems, unfilled = Path(result["vehicle"]).name, result["problems"], result["without_source"]
    lines = [f"{name}: {problem}" for problem in problems] or [f"{name}: every figure is plausible"]
    if unfilled:
        lines.append(f"{name}: say where these come from, or delete their lines: {', '.join(unfilled)}")
    lines += ["", "figure                          value unit          plausible"]
    for row in result["figures"]:
        value = nan if row["value"] is None else row["value"]
        lines.append(f"{row['figure']:27}{value:10.4g} {row['unit']:14}{row['low']:g} to {row['high']:g}")
    return "\n".join(lines) + "\n"


def make_vehicle_template(*, out: str, base: str = "bmw-320i", name: str | None = None) -> dict[str, Any]:
    """Write a vehicle file that extends another vehicle, with the numbers of a data sheet to be filled in.

    Parameters
    ----------
    out : the file, which must not exist
    base : vehicle that has every other number: catalogue name, or file in the folder of the new one
    name : what the file's first line calls the car; by default the name of the file

    Returns
    -------
    ``vehicle_file``, ``extends``, the ``numbers`` that stand in it, and the command that checks it.

    Raises
    ------
    InputError
        If the file exists or cannot be one, or the vehicle cannot be extended from its place.
    """
    file, extended = Path(out), base
    problems = []
    if file.suffix not in YAML:
        problems.append(f"--out {shorten(out)}: must end in .yaml; it does not")
    if os.path.lexists(file):
        problems.append(_describe_taken(out))
    if Path(base).suffix in YAML:
        extended = Path(base).name
        if Path(base).absolute().parent.resolve() != file.absolute().parent.resolve():
            problems.append(
                f"--from {shorten(base)}: must be a name of the catalogue or a file in the folder of --out; copy it"
                " there"
            )
    try:
        numbers = open_vehicle(base).numbers
    except InputError as error:
        problems += error.problems
    if problems:
        raise InputError(problems)
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(format_template(numbers, extended, name or file.stem, file.name))
    except FileExistsError:
        raise InputError(_describe_taken(out)) from None
    return {
        "vehicle_file": out,
        "extends": extended,
        "numbers": list(DATA_SHEET),
        "next": f"musync vehicle check {out}",
    }


def format_template(numbers: Mapping[str, VehicleNumber], base: str, name: str, file: str) -> str:
    """Return the text of the template.

    Parameters
    ----------
    numbers : of the vehicle that it extends, by field
    base : what the template writes for this vehicle
    name, file : of the new vehicle
    """
    extends = yaml.safe_dump({"extends": base}, allow_unicode=True)
    blocks = [HEADER.format(name=shorten(name, 60), file=shorten(file, 60), extends=extends)]
    for field, how in DATA_SHEET.items():
        number = numbers[field]
        tolerance = number.tolerance or _propose_tolerance(field, number.value)
        source = number.source.removeprefix(TO_FILL_IN).lstrip("; ")
        lines = [
            f"# {how}",
            f"{field}:",
            f"  value: {_format_number(number.value)}",
            f"  unit: {json.dumps(number.unit) if number.unit == '1' else number.unit}",
            f"  source: {json.dumps(f'{TO_FILL_IN}; {shorten(source, 150)}', ensure_ascii=False)}",
            *([f"  tolerance: {_format_number(tolerance)}"] if tolerance else []),
        ]
        blocks.append("\n".join(lines) + "\n")
    return "\n".join(blocks)


def _describe_taken(out: str) -> str:
    return f"--out {shorten(out)}: must be a new file; something lies there: name another one"


def _propose_tolerance(field: str, value: float) -> float:
    usual = load("table of plausible figures").usual_tolerances[field].value
    return float(f"{abs(value) * usual:.2g}")


def _format_number(value: float) -> str:
    """A number as YAML reads it: 1e-05 would be text there."""
    whole = int(value) if value.is_integer() and abs(value) < 1e15 else value
    return str(yaml.safe_dump(whole)).split("\n")[0]
