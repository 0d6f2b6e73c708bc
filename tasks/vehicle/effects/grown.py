"""A vehicle with effects: fits and grown vehicles change a vehicle by this one function."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from tasks.errors import InputError
from tasks.vehicle.effects.table import PARAMETERS
from tasks.vehicle.parameters import Vehicle

FAMILY = "families."


def find_family_tables(field: str, families: Iterable[str]) -> tuple[list[str], str]:
    """Return the tyre families whose table a field of the effects' table is, and that table's name.

    Parameters
    ----------
    field : such as "families.efficiency", of all, or "families.rain.efficiency", of one
    families : kinds of weather that there are
    """
    *kind, table = field.removeprefix(FAMILY).split(".")
    return [weather for weather in families if not kind or weather in kind], table


def apply_effects(vehicle: Vehicle, values: Mapping[str, float]) -> Vehicle:
    """Return the vehicle with values added to the effects that it already has.

    Parameters
    ----------
    vehicle : the vehicle
    values : numbers by parameter name [units of the table]

    Raises
    ------
    InputError
        For parameters that no vehicle carries.
    """
    foreign = [name for name in values if name not in PARAMETERS or not PARAMETERS[name].of_vehicle]
    if foreign:
        raise InputError([f"effect parameter {name}: no vehicle carries it" for name in foreign])
    effects = dict(vehicle.effects)
    families, shared = dict(vehicle.families), dict(vehicle.shared_families)
    fields: dict[str, float] = {}
    for name, value in values.items():
        row = PARAMETERS[name]
        for field in row.fields:
            if row.kind == "added":
                effects[field] = effects.get(field, 0.0) + value
            elif field.startswith(FAMILY):
                for group in (families, shared):
                    kinds, table = find_family_tables(field, group)
                    for weather in kinds:
                        family = group[weather]
                        scaled = tuple(v * (1.0 + value) for v in getattr(family, table))
                        group[weather] = replace(family, **{table: scaled})  # type: ignore[arg-type]
            else:
                old = fields.get(field, getattr(vehicle, field))
                fields[field] = old * (1.0 + value) if row.kind == "scaled" else old + value
    return replace(vehicle, effects=effects, families=families, shared_families=shared, **fields)  # type: ignore[arg-type]
