"""Vehicles: mechanical values, tyre families and frozen calibration."""

from functools import cache
from math import radians
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from catalogs.entries import find_entry
from catalogs.names import Name, WeatherName
from catalogs.quantities import CatalogueEntry, Scalar, parse_entry, require_quantity
from catalogs.tyre_families import KNOT_TABLES, FamilyEntry
from catalogs.tyres import load_tyre
from catalogs.vehicles.added import FormEntry, find_effect_problems
from catalogs.vehicles.frozen import Provenance
from catalogs.vehicles.inherited import Generation, join_generations, read_generations
from catalogs.vehicles.numbers import VehicleNumber
from catalogs.weather.grip import FOLDER as WEATHER
from catalogs.weather.grip import shared_families
from tasks.vehicle.effects.table import EFFECT_UNITS, PARAMETERS
from tasks.vehicle.parameters import Vehicle

Mass = Annotated[VehicleNumber, require_quantity("kg", above=0)]
Length = Annotated[VehicleNumber, require_quantity("m", above=0)]
Inertia = Annotated[VehicleNumber, require_quantity("kg m2", above=0)]
Stiffness = Annotated[VehicleNumber, require_quantity("N m-1", above=0)]
Damping = Annotated[VehicleNumber, require_quantity("N s m-1", minimum=0)]
Rate = Annotated[VehicleNumber, require_quantity("s-1", above=0)]
Speed = Annotated[VehicleNumber, require_quantity("m s-1", above=0)]


class VehicleEntry(CatalogueEntry):
    """Content of a vehicle file; `Vehicle` gives the meanings."""

    sprung_mass: Mass
    unsprung_mass_f: Mass
    unsprung_mass_r: Mass
    cg_to_front_axle: Length
    cg_to_rear_axle: Length
    cg_height: Length
    pitch_inertia: Inertia
    suspension_stiffness_f: Stiffness
    suspension_stiffness_r: Stiffness
    suspension_damping_f: Damping
    suspension_damping_r: Damping
    tyre_stiffness_f: Stiffness
    tyre_stiffness_r: Stiffness
    wheel_radius: Length
    wheel_inertia_f: Inertia
    wheel_inertia_r: Inertia
    brake_gain: Annotated[VehicleNumber, require_quantity("N m MPa-1", above=0)]
    front_brake_share: Annotated[VehicleNumber, require_quantity("1", minimum=0, maximum=1)]
    abs_release_width: Annotated[VehicleNumber, require_quantity("1", above=0)]
    abs_build_rate: Rate
    abs_release_rate: Rate
    coast_deceleration: Annotated[VehicleNumber, require_quantity("m s-2", minimum=0)]
    hold_ratio: Annotated[VehicleNumber, require_quantity("1", minimum=0)]
    coupled_pitch_scale: Annotated[VehicleNumber, require_quantity("1", above=0)]
    static_pitch: Annotated[VehicleNumber, require_quantity("deg", above=-45, below=45)]
    slip_speed_floor: Speed
    stop_speed: Speed
    lock_speed: Annotated[VehicleNumber, require_quantity("rad s-1", above=0)]
    gravity: Annotated[VehicleNumber, require_quantity("m s-2", above=0)]
    families: Annotated[dict[WeatherName, FamilyEntry], Field(min_length=1)]
    tyre: Name | None = None
    effects: dict[str, VehicleNumber] = Field(default_factory=dict)
    forms: tuple[FormEntry, ...] = ()
    provenance: Provenance | None = None

    @model_validator(mode="after")
    def _effects_keep_their_rules(self) -> "VehicleEntry":
        bounds = self.provenance.bounds if self.provenance else {}
        problems = find_effect_problems(self.effects, bounds)
        units = self._units_inside()
        problems += [
            f"provenance.bounds: unit of {group} must be {units[group]}; it is {limits.unit}"
            for group, limits in bounds.items()
            if group in units
            and limits.unit not in {units[group], *(PARAMETERS[g].unit for g in (group,) if g in PARAMETERS)}
        ]
        if problems:
            raise ValueError("; ".join(problems))
        return self

    def _units_inside(self) -> dict[str, str]:
        """Unit of each group that a calibration may move; angles are in radians there."""
        fields = {name: quantity.unit for name, quantity in self if isinstance(quantity, Scalar)}
        knots = {name: getattr(next(iter(self.families.values())), name).unit for name in KNOT_TABLES}
        inside = {name: "rad" if unit == "deg" else unit for name, unit in fields.items()}
        return {**inside, **knots, **EFFECT_UNITS}


def vehicle_tyre_source(name_or_path: str | Path) -> Path | None:
    """The property file of the tyre that a vehicle names: beside the file that names it, or in the catalogue.

    Parameters
    ----------
    name_or_path : of the vehicle

    Returns
    -------
    The file; None where the vehicle names none and drives on its families' Burckhardt curves.

    Raises
    ------
    InputError
        As ``load_vehicle``.
    """
    line = read_generations(find_entry("vehicle", name_or_path))
    return _find_tyre(_check_line(line), line)


def vehicle_provenance(name_or_path: str | Path) -> Provenance | None:
    """Where a vehicle's numbers come from, if it is a frozen one or extends one.

    Raises
    ------
    InputError
        As ``load_vehicle``.
    """
    return _check_line(read_generations(find_entry("vehicle", name_or_path))).provenance


def vehicle_content(name_or_path: str | Path) -> bytes:
    """The file of a vehicle with everything in it that it inherits: what a dataset keeps, and what hashes cover.

    Parameters
    ----------
    name_or_path : of the vehicle

    Returns
    -------
    The file's own bytes where it extends no other vehicle.

    Raises
    ------
    InputError
        As ``load_vehicle``.
    """
    line = read_generations(find_entry("vehicle", name_or_path))
    _check_line(line)
    return join_generations(line)


def vehicle_numbers(name_or_path: str | Path) -> dict[str, VehicleNumber]:
    """Each number of a vehicle: by the field of `Vehicle`, and of its effects by the name in the table of effects.

    Parameters
    ----------
    name_or_path : of the vehicle

    Raises
    ------
    InputError
        As ``load_vehicle``.
    """
    entry = _check_line(read_generations(find_entry("vehicle", name_or_path)))
    return {name: number for name, number in entry if isinstance(number, VehicleNumber)} | entry.effects


def load_tolerances(name_or_path: str | Path) -> dict[str, float]:
    """One sigma of each number of a vehicle that has a tolerance, as a share of its value [1].

    Parameters
    ----------
    name_or_path : of the vehicle

    Returns
    -------
    By the field of `Vehicle`, and of its effects by the name in the table of effects; empty where nobody gave one.

    Raises
    ------
    InputError
        As ``load_vehicle``.
    """
    numbers = vehicle_numbers(name_or_path)
    return {
        name: share for name, number in numbers.items() if (share := number.relative_tolerance) is not None
    }


@cache
def vehicle_units() -> dict[str, str]:
    """Unit of each number of a vehicle file."""
    return {name: number.unit for name, number in vehicle_numbers("paper-reference").items()}


def load_vehicle(name_or_path: str | Path, weather: Path = WEATHER) -> Vehicle:
    """Read a vehicle by its name in the catalogue or from a YAML file.

    Parameters
    ----------
    name_or_path : name, or path ending in .yaml
    weather : folder of the weather catalogue, which has tyre families for kinds that the vehicle has none of

    Raises
    ------
    InputError
        Listing every problem of the file, or the names that exist.
    """
    source = find_entry("vehicle", name_or_path)
    line = read_generations(source)
    entry = _check_line(line)
    values: dict[str, Any] = {
        name: quantity.value
        for name in VehicleEntry.model_fields
        if isinstance(quantity := getattr(entry, name), Scalar)
    }
    families = {kind: family.family for kind, family in entry.families.items()}
    values["static_pitch"] = radians(values["static_pitch"])
    effects = {name: number.value for name, number in entry.effects.items()}
    forms = tuple(form.form for form in entry.forms)
    tyre = None if (file := _find_tyre(entry, line)) is None else load_tyre(file)
    return Vehicle(
        name=source.stem, families=families, shared_families=shared_families(weather), tyre=tyre, effects=effects,
        forms=forms, **values,
    )  # fmt: skip


def _find_tyre(entry: VehicleEntry, line: list[Generation]) -> Path | None:
    if entry.tyre is None:
        return None
    vehicle = line[0] if len(line) == 1 else next(one for one in line if "tyre" in one.table)
    beside = vehicle.source.with_name(f"{entry.tyre}.tir")
    return beside if beside.is_file() else find_entry("tyre", entry.tyre)


def _check_line(line: list[Generation]) -> VehicleEntry:
    """The vehicle of these files; what another one brings is checked first, so that a problem is told of its file."""
    if len(line) > 1:
        _check_line(line[1:])
    return parse_entry(VehicleEntry, join_generations(line), line[0].source, "vehicle")
