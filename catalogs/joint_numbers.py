"""Numbers that a joint fit may move, with their priors."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, TypeAdapter

from catalogs.effects import load_effects
from catalogs.quantities import CatalogueEntry, Text, read_entries
from tasks.campaign.campaign import CHANNELS
from tasks.identification.joint.numbers import JointNumber
from tasks.vehicle.effects.table import PARAMETERS

JOINT_NUMBERS = Path(__file__).with_name("joint_numbers.yaml")
Limit = Annotated[float, Field(allow_inf_nan=False)]


class JointNumberEntry(CatalogueEntry):
    """One number; the meanings are given by ``JointNumber``."""

    sigma: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    lower: Limit
    upper: Limit
    unit: Text
    group: Literal[
        "gain", "friction", "grip", "radius", "delay", "curve", "resistance", "sensor", "mass", "road"
    ]
    removable: bool
    needs: Annotated[tuple[Text, ...], Field(min_length=1)]
    source: Text
    of_pressure: bool = False
    of_grade: bool = False
    free_with: tuple[Text, ...] = ()
    stands_in: bool = False
    weather: Text | None = None


def _check(entries: dict[str, JointNumberEntry]) -> dict[str, JointNumberEntry]:
    problems = [
        f"{name} is no parameter of the table of effects" for name in entries if name not in PARAMETERS
    ]
    for name, entry in entries.items():
        if name in PARAMETERS and entry.unit != PARAMETERS[name].unit:
            problems.append(f"{name} must be in {PARAMETERS[name].unit}; it is in {entry.unit}")
        if not entry.lower <= 0.0 <= entry.upper:
            problems.append(f"{name} must have 0, the vehicle file's value, within its limits")
        problems += [
            f"{name} needs {need}, which is no channel"
            for need in (*entry.needs, *entry.free_with)
            if need not in (*CHANNELS, "drive_torque")
        ]
    if problems:
        raise ValueError("; ".join(problems))
    return entries


NUMBERS = TypeAdapter(Annotated[dict[str, JointNumberEntry], AfterValidator(_check)])
"""Content of the file."""


def load_joint_numbers(path: str | Path = JOINT_NUMBERS) -> tuple[JointNumber, ...]:
    """Return the numbers of a file, in its order.

    Parameters
    ----------
    path : YAML file; by default the catalogue's

    Raises
    ------
    InputError
        With every rule that the file breaks.
    """
    entries = read_entries(NUMBERS, Path(path), "set of joint numbers")
    # where several effects begin with one number, the first of the library is it alone
    effects = {effect.parameters[0].name: effect for effect in reversed(load_effects())}
    return tuple(
        JointNumber(
            name=name, sigma=entry.sigma, lower=entry.lower, upper=entry.upper, group=entry.group,
            removable=entry.removable, needs=entry.needs, effect=effects[name], of_pressure=entry.of_pressure,
            of_grade=entry.of_grade, free_with=entry.free_with, stands_in=entry.stands_in, weather=entry.weather,
        )
        for name, entry in entries.items()
    )  # fmt: skip
