"""Vehicles: mechanical values, tyre families and frozen calibration."""

from functools import cache
from math import radians
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from catalogs.documents import LARGEST_YAML, read_content
from catalogs.entries import find_entry
from catalogs.names import Name, WeatherName
from catalogs.quantities import CatalogueEntry, Scalar, parse_entry, require_quantity
from catalogs.tyre_families import KNOT_TABLES, FamilyEntry
from catalogs.tyres import load_tyre
from catalogs.vehicles.added import FormEntry, effect_problems
from catalogs.vehicles.frozen import Provenance, check_seal
from catalogs.weather.grip import FOLDER as WEATHER
from catalogs.weather.grip import shared_families
from tasks.vehicle.effects.table import EFFECT_UNITS, PARAMETERS
from tasks.vehicle.parameters import Vehicle

Mass = Annotated[Scalar, require_quantity("kg", above=0)]
Length = Annotated[Scalar, require_quantity("m", above=0)]
Inertia = Annotated[Scalar, require_quantity("kg m2", above=0)]
Stiffness = Annotated[Scalar, require_quantity("N m-1", above=0)]
Damping = Annotated[Scalar, require_quantity("N s m-1", minimum=0)]
Rate = Annotated[Scalar, require_quantity("s-1", above=0)]
Speed = Annotated[Scalar, require_quantity("m s-1", above=0)]


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
    brake_gain: Annotated[Scalar, require_quantity("N m MPa-1", above=0)]
    front_brake_share: Annotated[Scalar, require_quantity("1", minimum=0, maximum=1)]
    abs_release_width: Annotated[Scalar, require_quantity("1", above=0)]
    abs_build_rate: Rate
    abs_release_rate: Rate
    coast_deceleration: Annotated[Scalar, require_quantity("m s-2", minimum=0)]
    hold_ratio: Annotated[Scalar, require_quantity("1", minimum=0)]
    coupled_pitch_scale: Annotated[Scalar, require_quantity("1", above=0)]
    static_pitch: Annotated[Scalar, require_quantity("deg", above=-45, below=45)]
    slip_speed_floor: Speed
    stop_speed: Speed
    lock_speed: Annotated[Scalar, require_quantity("rad s-1", above=0)]
    gravity: Annotated[Scalar, require_quantity("m s-2", above=0)]
    families: Annotated[dict[WeatherName, FamilyEntry], Field(min_length=1)]
    tyre: Name | None = None
    effects: dict[str, Scalar] = Field(default_factory=dict)
    forms: tuple[FormEntry, ...] = ()
    provenance: Provenance | None = None

    @model_validator(mode="after")
    def _effects_keep_their_rules(self) -> "VehicleEntry":
        bounds = self.provenance.bounds if self.provenance else {}
        problems = effect_problems(self.effects, bounds)
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
    """The property file of the tyre that a vehicle names: beside the vehicle's file, or in the catalogue.

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
    source = find_entry("vehicle", name_or_path)
    name = _read_entry(source).tyre
    return None if name is None else _find_tyre(name, source)


def vehicle_provenance(name_or_path: str | Path) -> Provenance | None:
    """Where a vehicle's numbers come from, if it is a frozen one.

    Raises
    ------
    InputError
        As ``load_vehicle``.
    """
    return _read_entry(find_entry("vehicle", name_or_path)).provenance


@cache
def vehicle_units() -> dict[str, str]:
    """Unit of each number of a vehicle file."""
    entry = _read_entry(find_entry("vehicle", "paper-reference"))
    return {name: quantity.unit for name, quantity in entry if isinstance(quantity, Scalar)}


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
    entry = _read_entry(source)
    values: dict[str, Any] = {
        name: quantity.value
        for name in VehicleEntry.model_fields
        if isinstance(quantity := getattr(entry, name), Scalar)
    }
    families = {kind: family.family for kind, family in entry.families.items()}
    values["static_pitch"] = radians(values["static_pitch"])
    effects = {name: number.value for name, number in entry.effects.items()}
    forms = tuple(form.form for form in entry.forms)
    tyre = None if entry.tyre is None else load_tyre(_find_tyre(entry.tyre, source))
    return Vehicle(
        name=source.stem, families=families, shared_families=shared_families(weather), tyre=tyre, effects=effects,
        forms=forms, **values,
    )  # fmt: skip


def _find_tyre(name: str, vehicle: Path) -> Path:
    beside = vehicle.with_name(f"{name}.tir")
    return beside if beside.is_file() else find_entry("tyre", name)


def _read_entry(source: Path) -> VehicleEntry:
    content = read_content(source, "vehicle", LARGEST_YAML)
    check_seal(content, source)
    return parse_entry(VehicleEntry, content, source, "vehicle")
