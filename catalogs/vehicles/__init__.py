"""Vehicles: mechanical values, tyre families and frozen calibration."""

from dataclasses import dataclass
from functools import cache, cached_property
from math import radians
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from catalogs.entries import KINDS, find_entry, parse, read_file
from catalogs.names import Name, WeatherName
from catalogs.quantities import CatalogueEntry, Scalar, parse_entry, require_quantity
from catalogs.tyre_families import KNOT_TABLES, FamilyEntry
from catalogs.vehicles.added import FormEntry, find_effect_problems
from catalogs.vehicles.frozen import Provenance
from catalogs.vehicles.inherited import Generation, join_generations, read_generations
from catalogs.vehicles.numbers import VehicleNumber
from catalogs.weather.grip import WEATHER, WeatherFolder
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


@dataclass(frozen=True, kw_only=True)
class VehicleFile:
    """A vehicle's file with those that it extends, read and checked once.

    Parameters
    ----------
    source : the file
    content : the file with everything in it that it inherits: what a dataset keeps, and what hashes cover; the file's
        own bytes where it extends no other vehicle
    entry : what it holds
    tyre_source : property file of the tyre that the vehicle names, beside the file that names it or in the catalogue;
        None where it names none and drives on its families' Burckhardt curves
    """

    source: Path
    content: bytes
    entry: VehicleEntry
    tyre_source: Path | None

    @property
    def provenance(self) -> Provenance | None:
        """Where the numbers come from, if it is a frozen vehicle or extends one."""
        return self.entry.provenance

    @property
    def numbers(self) -> dict[str, VehicleNumber]:
        """Each number: by the field of `Vehicle`, and of effects by the name in the table of effects."""
        own = {name: number for name, number in self.entry if isinstance(number, VehicleNumber)}
        return own | self.entry.effects

    @property
    def tolerances(self) -> dict[str, float]:
        """One sigma of each of the `numbers` that has a tolerance, as a share of its value [1]."""
        shares = {name: number.relative_tolerance for name, number in self.numbers.items()}
        return {name: share for name, share in shares.items() if share is not None}

    @cached_property
    def tyre(self) -> tuple[Path, bytes] | None:
        """The tyre's file and its content."""
        return (
            None if self.tyre_source is None else (self.tyre_source, read_file("tyre", self.tyre_source)[0])
        )

    def build(self, weather: WeatherFolder = WEATHER) -> Vehicle:
        """Return the vehicle; the weather has tyre families for kinds that it has none of."""
        values: dict[str, Any] = {name: one.value for name, one in self.entry if isinstance(one, Scalar)}
        values["static_pitch"] = radians(values["static_pitch"])
        return Vehicle(
            name=self.source.stem,
            families={kind: family.family for kind, family in self.entry.families.items()},
            shared_families=weather.families,
            tyre=None if self.tyre is None else parse("tyre", self.tyre[1], self.tyre[0]),
            effects={name: number.value for name, number in self.entry.effects.items()},
            forms=tuple(form.form for form in self.entry.forms),
            **values,
        )


def open_vehicle(name_or_path: str | Path) -> VehicleFile:
    """Read a vehicle's file, by its name in the catalogue or its path, and those that it extends.

    Parameters
    ----------
    name_or_path : of the vehicle

    Raises
    ------
    InputError
        Listing every problem of the files, or the names that exist.
    """
    return _open_content(*read_file("vehicle", name_or_path))


def build_vehicle(content: bytes, source: Path, weather: WeatherFolder = WEATHER) -> Vehicle:
    """Return the vehicle of a file that is already read.

    Parameters
    ----------
    content, source : of the file
    weather : as of `VehicleFile.build`

    Raises
    ------
    InputError
        As `open_vehicle`.
    """
    return _open_content(content, source).build(weather)


@cache
def vehicle_units() -> dict[str, str]:
    """Unit of each number of a vehicle file."""
    return {name: number.unit for name, number in open_vehicle("paper-reference").numbers.items()}


def _open_content(content: bytes, source: Path) -> VehicleFile:
    line = read_generations(content, source)
    # what another file brings is checked first, so that a problem is reported of its file
    for oldest in range(len(line) - 1, -1, -1):
        whole = join_generations(line[oldest:])
        entry = parse_entry(VehicleEntry, whole, line[oldest].source, "vehicle")
    return VehicleFile(source=source, content=whole, entry=entry, tyre_source=_find_tyre(entry, line))


def _find_tyre(entry: VehicleEntry, line: list[Generation]) -> Path | None:
    if entry.tyre is None:
        return None
    vehicle = line[0] if len(line) == 1 else next(one for one in line if "tyre" in one.table)
    beside = vehicle.source.with_name(f"{entry.tyre}{KINDS['tyre'].suffixes[0]}")
    return beside if beside.is_file() else find_entry("tyre", entry.tyre)
