"""Scalars that a calibration may move: each has a name and the entries of the vehicle that hold its value."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from tasks.errors import InputError
from tasks.vehicle.effects.table import EFFECT_UNITS
from tasks.vehicle.parameters import Vehicle

KNOT_GROUPS = ("efficiency", "slip_stiffness", "pitch_scale", "hold_s", "release_s")
"""Groups with a value at each surface knot of each tyre family."""
SHARED_HOLD = ("dry", "rain")
"""Families whose hold times are one scalar (paper, note under Table frozen_empirical_params)."""


@dataclass(frozen=True, kw_only=True)
class CalibrationScalar:
    """One number of the vehicle that a calibration may move.

    Parameters
    ----------
    name : unique name; a knot's name holds its family and surface friction
    group : name of its group, which stages and bounds use
    knots : (family, knot) pairs that share the value; empty for a field of the vehicle itself
    """

    name: str
    group: str
    knots: tuple[tuple[str, int], ...] = ()


def list_calibration_scalars(vehicle: Vehicle, groups: Sequence[str]) -> tuple[CalibrationScalar, ...]:
    """Return the scalars of some groups, in their order; all of the paper's groups together hold its 40.

    Parameters
    ----------
    vehicle : vehicle with the families and knots
    groups : `KNOT_GROUPS`, fields of the vehicle that hold a number, or names of its effects' parameters

    Raises
    ------
    InputError
        Listing every group that the vehicle does not have.
    """
    unknown = [
        g for g in groups if g not in KNOT_GROUPS and g not in EFFECT_UNITS and not _is_field(vehicle, g)
    ]
    if unknown:
        known = ", ".join((*KNOT_GROUPS, *EFFECT_UNITS))
        raise InputError(
            [
                f"calibration group {g}: no such number; name a field of the vehicle or one of {known}"
                for g in unknown
            ]
        )
    scalars: list[CalibrationScalar] = []
    for group in groups:
        scalars += (
            _list_knots(vehicle, group)
            if group in KNOT_GROUPS
            else [CalibrationScalar(name=group, group=group)]
        )
    return tuple(scalars)


def read_scalar(vehicle: Vehicle, scalar: CalibrationScalar) -> float:
    """Return the scalar's value in a vehicle [unit of its field].

    Parameters
    ----------
    vehicle : the vehicle
    scalar : one of its scalars
    """
    if scalar.group in EFFECT_UNITS:
        return float(vehicle.effects.get(scalar.group, 0.0))
    if not scalar.knots:
        return float(getattr(vehicle, scalar.group))
    family, knot = scalar.knots[0]
    return float(getattr(vehicle.families[family], scalar.group)[knot])


def set_scalars(vehicle: Vehicle, values: Mapping[CalibrationScalar, float]) -> Vehicle:
    """Return the vehicle with other values of some scalars; if its centre of gravity moves, the wheelbase stays.

    Parameters
    ----------
    vehicle : the vehicle
    values : value of each scalar [unit of its field]
    """
    families = dict(vehicle.families)
    effects = dict(vehicle.effects)
    fields: dict[str, float] = {}
    for scalar, value in values.items():
        if scalar.group in EFFECT_UNITS:
            effects[scalar.group] = value
        elif not scalar.knots:
            fields[scalar.group] = value
        for family, knot in scalar.knots:
            table = list(getattr(families[family], scalar.group))
            table[knot] = value
            families[family] = replace(families[family], **{scalar.group: tuple(table)})  # type: ignore[arg-type]
    if "cg_to_front_axle" in fields:
        fields["cg_to_rear_axle"] = vehicle.wheelbase - fields["cg_to_front_axle"]
    return replace(vehicle, families=families, effects=effects, **fields)  # type: ignore[arg-type]


def _is_field(vehicle: Vehicle, group: str) -> bool:
    """Return whether a group is a numeric field of the vehicle."""
    return isinstance(vars(vehicle).get(group), float | int)


def _list_knots(vehicle: Vehicle, group: str) -> list[CalibrationScalar]:
    """Return one scalar for each knot of each family; families with a shared hold time have one together."""
    scalars = []
    shared: list[tuple[str, int]] = []
    for family, table in vehicle.families.items():
        for knot, friction in enumerate(table.surface_friction):
            if group == "hold_s" and family in SHARED_HOLD:
                shared.append((family, knot))
            else:
                name = f"{group} {family} {friction:g}"
                scalars.append(CalibrationScalar(name=name, group=group, knots=((family, knot),)))
    if shared:
        scalars.insert(
            0,
            CalibrationScalar(name=f"{group} {' and '.join(SHARED_HOLD)}", group=group, knots=tuple(shared)),
        )
    return scalars
