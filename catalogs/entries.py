"""Catalogue entries by name or by file: the kinds that there are, where each lies, and one way to load them all."""

import os
import pkgutil
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from catalogs.documents import LARGEST_YAML, read_content
from catalogs.quantities import parse_entry
from catalogs.sentences import shorten
from tasks.errors import InputError

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
"""A name that is one file name on any system, and never a path."""
CATALOGUE = Path(__file__).parent
YAML = (".yaml", ".yml")
Reference = str | Path | None
"""Name or file of an entry; None for the only entry of its kind."""


@dataclass(frozen=True)
class Kind:
    """A kind of catalogue entry.

    Parameters
    ----------
    location : folder of the entries, or the file of a kind that has one entry alone, which may be of datasets only
    form : module and name of the schema of a file, whose ``build`` makes the value, or of a function that makes it of a
        file's content and path
    suffixes : of the files; the first is that of the catalogue
    """

    location: str
    form: str
    suffixes: tuple[str, ...] = YAML


KINDS = {
    "ablation": Kind("studies/ablation.yaml", "studies.ablation:AblationEntry"),
    "calibrated range": Kind("calibrated_range.yaml", "calibrated_range:CalibratedRange"),
    "calibration procedure": Kind("calibration", "calibration:ProcedureEntry"),
    "camera": Kind("cameras", "cameras:CameraEntry"),
    "channel map": Kind("channel_maps", "channel_maps:build_channel_map"),
    "cut of the low-speed rule": Kind("studies/no_low_speed_rule.yaml", "low_speed:LowSpeedCutEntry"),
    "foreign gate file": Kind("foreign_gates.yaml", "gates:ForeignGateEntry"),
    "gate file": Kind("gates.yaml", "gates:GateEntry"),
    "grade of the road": Kind("road_grade.yaml", "road_grade:RoadGradeEntry"),
    "grid": Kind("grids", "grids:build_grid"),
    "hazard marking": Kind("hazard_markings", "hazard_markings:MarkingEntry"),
    "library of effects": Kind("effects/library.yaml", "effects:EffectLibrary"),
    "list of conditions": Kind("studies/appendix-c.yaml", "studies:ConditionList"),
    "low-speed rule": Kind("low_speed.yaml", "low_speed:LowSpeedEntry"),
    "road user sizes": Kind("road_users.yaml", "road_users:RoadUserSizes"),
    "sensitivity study": Kind("studies/surface-sensitivity.yaml", "studies:SensitivityEntry"),
    "set of assumed tolerances": Kind("assumed_tolerances.yaml", "channel_maps.tolerances:AssumedTolerances"),
    "set of decision rules": Kind("decision_rules.yaml", "decision_rules:DecisionRulesEntry"),
    "surface": Kind("surfaces", "surfaces:SurfaceEntry"),
    "table of checks": Kind("campaign_checks.yaml", "campaign_checks:CheckTableEntry"),
    "table of physical limits": Kind("physical_limits.yaml", "physical_limits:PhysicalLimits"),
    "table of plausible figures": Kind("plausible_vehicle.yaml", "plausible_vehicle:PlausibleVehicle"),
    "table of printed agreement": Kind("studies/agreement.yaml", "studies.agreement:AgreementFile"),
    "tyre": Kind("tyres", "tyres:parse_tyre", (".tir",)),
    "vehicle": Kind("vehicles", "vehicles:build_vehicle"),
    "wet friction": Kind("wet_friction.yaml", "wet_friction:WetFrictionEntry"),
}
"""Every kind of entry that has a name of its own; the name stands in the sentences about its files."""


def load(kind: str, name_or_path: Reference = None, *given: Any) -> Any:
    """Read an entry and make its value, such as a `Camera` of a camera's file.

    Parameters
    ----------
    kind : of `KINDS`
    name_or_path : of the entry; None for the only entry of its kind, which is read once
    given : what the value is made with beside its file: the `WeatherFolder` of a vehicle or a surface

    Raises
    ------
    InputError
        Listing every problem of the file, or the names that exist.
    """
    return open_entry(kind, name_or_path, *given)[2]


def open_entry(kind: str, name_or_path: Reference = None, *given: Any) -> tuple[bytes, Path, Any]:
    """Return the content of an entry's file, the file, and the value as of `load`.

    Parameters
    ----------
    kind, name_or_path, given : as of `load`

    Raises
    ------
    InputError
        As `load`.
    """
    if name_or_path is None:
        return _open_only(kind)
    content, origin = read_file(kind, name_or_path)
    return content, origin, parse(kind, content, origin, *given)


def read_file(kind: str, name_or_path: Reference = None) -> tuple[bytes, Path]:
    """Return the content of an entry's file, and the file.

    Parameters
    ----------
    kind, name_or_path : as of `load`

    Raises
    ------
    InputError
        If there is no such file, or it cannot be read.
    """
    path = find_entry(kind, name_or_path)
    return read_content(path, kind, LARGEST_YAML), path


def parse(kind: str, content: bytes, origin: Path, *given: Any) -> Any:
    """Make the value of an entry of its file's content.

    Parameters
    ----------
    kind, given : as of `load`
    content, origin : of the file

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    form = pkgutil.resolve_name(f"catalogs.{KINDS[kind].form}")
    if not isinstance(form, type):
        return form(content, origin, *given)
    return parse_entry(form, content, origin, kind).build(*given)


@cache
def _open_only(kind: str) -> tuple[bytes, Path, Any]:
    content, origin = read_file(kind)
    return content, origin, parse(kind, content, origin)


def entry_folder(kind: str) -> Path:
    """Return the catalogue's folder of a kind of entry."""
    return CATALOGUE / KINDS[kind].location


def entry_names(kind: str) -> tuple[str, ...]:
    """Return the names of the entries of a kind in the catalogue, sorted."""
    return tuple(sorted(entry.stem for entry in entry_folder(kind).glob(f"*{KINDS[kind].suffixes[0]}")))


def find_entry(kind: str, name_or_path: Reference = None) -> Path:
    """Return the file of an entry: a path with its suffix as it is, a name from the catalogue.

    Parameters
    ----------
    kind : of `KINDS`
    name_or_path : of the entry; None for the only entry of its kind

    Raises
    ------
    InputError
        If there is no such entry; the sentence lists those that exist.
    """
    location, suffixes = entry_folder(kind), KINDS[kind].suffixes
    if name_or_path is None or location.suffix:
        return location if name_or_path is None else Path(name_or_path)
    path = Path(name_or_path)
    is_name = path.suffix not in suffixes
    if is_name:
        path = location / f"{name_or_path}{suffixes[0]}"
    if (is_name and not NAME.fullmatch(str(name_or_path))) or not os.path.isfile(path):
        form = "YAML" if suffixes == YAML else suffixes[0]
        raise InputError(
            f"{shorten(name_or_path)}: no such {kind}; give a {form} file or one of:"
            f" {', '.join(entry_names(kind))}"
        )
    return path
