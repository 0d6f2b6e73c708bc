"""``musync vehicle fmu``: a vehicle as a co-simulation FMU (FMI 2.0), for simulators that are no Python.

The model is not written again: its compiled kernels, as every run of muSync takes them, are put into a library of the
platform, behind a frame in C that holds the standard's functions and no physics.
"""

import hashlib
import platform
import re
import uuid
import zipfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

from catalogs.entries import load
from catalogs.sentences import shorten
from catalogs.vehicles import open_vehicle
from flows.exporting.fmu_binary import (
    FRAME,
    PLATFORMS,
    build_library,
    find_compiler,
    find_own_platform,
    format_header,
)
from flows.reading.suggestions import suggest_names
from flows.store.outputs import Outputs
from manifests.provenance import code_version
from tasks.errors import InputError
from tasks.kernel_cache import sources_hash
from tasks.surface.weather import WEATHERS, Weather, find_weather, surface_state
from tasks.vehicle.model.embedded import compile_advance
from tasks.vehicle.model.embedded_variables import INPUTS, OUTPUTS, EmbeddedVariable
from tasks.vehicle.model.simulation import INTERNAL_STEP_S
from tasks.vehicle.parameters import Vehicle

SUFFIX = ".fmu"
_LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""Time of every file in the archive, so that the same vehicle gives the same bytes."""
UNITS: Mapping[str, dict[str, str]] = {
    "m": {"m": "1"},
    "mm": {"m": "1", "factor": "0.001"},
    "m s-1": {"m": "1", "s": "-1"},
    "m s-2": {"m": "1", "s": "-2"},
    "rad": {"rad": "1"},
    "rad s-1": {"rad": "1", "s": "-1"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
    "N m": {"kg": "1", "m": "2", "s": "-2"},
    "MPa": {"kg": "1", "m": "-1", "s": "-2", "factor": "1000000"},
    "K": {"K": "1"},
    "1": {},
}
"""Units of the variables in the standard's base units."""
_SLASHED = {"m s-1": "m/s", "m s-2": "m/s2", "rad s-1": "rad/s", "N m": "N.m"}
"""How Modelica and Simulink write the units that muSync writes otherwise."""


def write_fmu(
    vehicle: str, *, out: str, surface: str = "dense-asphalt", platforms: list[str] | None = None
) -> dict[str, Any]:
    """Write a vehicle as an FMU.

    Parameters
    ----------
    vehicle : catalogue name or file
    out : the file, NAME.fmu
    surface : the pavement whose dry friction is the friction at the start, and whose texture holds water
    platforms : where it will run; None takes this one

    Returns
    -------
    ``fmu``, ``vehicle``, ``platforms``, ``step_s``, and the names of ``parameters``, ``inputs``, ``outputs`` and
    ``weathers``.

    Raises
    ------
    InputError
        Listing every option that is wrong; for a vehicle that was fitted in paper mode; if there is no C compiler.
    """
    problems = []
    if Path(out).suffix != SUFFIX:
        problems.append(f"--out {shorten(out)}: must end in {SUFFIX}; it does not")
    chosen = platforms or [find_own_platform().name]
    compilable = [name for name in dict.fromkeys(chosen) if name in PLATFORMS]
    checks: tuple[Callable[[], Any], ...] = (
        partial(_refuse_unknown_platforms, chosen),
        *(partial(find_compiler, PLATFORMS[name]) for name in compilable),
        partial(_refuse_paper_mode, vehicle),
        partial(load, "surface", surface),
    )
    for check in checks:
        try:
            check()
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    results = Outputs(Path(out).parent, "vehicle fmu", Path(out).name)
    file = open_vehicle(vehicle)
    car = file.build()
    results.write(Path(out).name, pack_fmu(car, file.content, surface, compilable))
    return {
        "fmu": out,
        "vehicle": car.name,
        "platforms": compilable,
        "step_s": INTERNAL_STEP_S,
        "weathers": car.find_weathers(),
        "parameters": [row.name for row in INPUTS if row.role == "parameter"],
        "inputs": [row.name for row in INPUTS if row.role == "input"],
        "outputs": [row.name for row in OUTPUTS],
    }


def pack_fmu(car: Vehicle, content: bytes, surface: str, platforms: Sequence[str]) -> bytes:
    """Return the bytes of an FMU.

    Parameters
    ----------
    car : the vehicle
    content : its file with everything that it inherits
    surface : the pavement, as of `write_fmu`
    platforms : where it will run, of `PLATFORMS`
    """
    weathers = car.find_weathers()
    pavement = load("wet friction").apply(load("surface", surface))
    first = surface_state(Weather(kind=weathers[0]), pavement)
    starts = {row.name: row.start for row in INPUTS} | {
        "weather": float(find_weather(weathers[0]).code),
        "road_friction": first.friction,
    }
    guid = _make_guid(content, repr(starts).encode(), FRAME.read_bytes(), sources_hash().encode())
    identifier = re.sub(r"\W", "_", f"musync_{car.name}", flags=re.ASCII)
    files = {
        "modelDescription.xml": format_description(
            identifier=identifier,
            name=car.name,
            guid=guid,
            tool=f"muSync {code_version()['version']}",
            starts=starts,
            weathers=weathers,
        ),
        "resources/vehicle.yaml": content,
    }
    compiled, header = compile_advance(car, pavement), format_header(car, starts.values(), guid)
    for target in (PLATFORMS[name] for name in platforms):
        with TemporaryDirectory() as folder:
            path = f"binaries/{target.name}/{identifier}{target.suffix}"
            files[path] = build_library(compiled, header, target, Path(folder))
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in files.items():
            packed.writestr(zipfile.ZipInfo(name, _LONG_AGO), data, zipfile.ZIP_DEFLATED)
    return archive.getvalue()


def _make_guid(*parts: bytes) -> str:
    digest = hashlib.sha256(b"".join(hashlib.sha256(part).digest() for part in parts)).digest()
    return f"{{{uuid.UUID(bytes=digest[:16])}}}"


def _refuse_unknown_platforms(names: Sequence[str]) -> None:
    if platform.machine() not in {"x86_64", "AMD64"}:
        raise InputError(f"an FMU is compiled on x86-64 machines only; this one is {platform.machine()}")
    if unknown := [name for name in names if name not in PLATFORMS]:
        raise suggest_names("--platform", unknown, list(PLATFORMS), "musync vehicle fmu --help")


def _refuse_paper_mode(vehicle: str) -> None:
    """Raise for a vehicle whose numbers mean something else in the physical model, which is what an FMU holds."""
    file = open_vehicle(vehicle)
    file.build()
    frozen = file.provenance
    if frozen is not None and frozen.mode != "coupled":
        raise InputError(
            f"{shorten(vehicle)}: was fitted in {frozen.mode} mode, and an FMU drives the physical model, in which its"
            " numbers mean something else: take one of coupled mode, such as multibody-grown"
        )


def format_description(
    *, identifier: str, name: str, guid: str, tool: str, starts: Mapping[str, float], weathers: Sequence[str]
) -> bytes:
    """Return modelDescription.xml.

    Parameters
    ----------
    identifier : name of the library's file
    name : of the vehicle
    guid : of the FMU
    tool : name and version of what wrote it
    starts : start value of each parameter and input [its unit]
    weathers : kinds of weather in which the vehicle has a tyre
    """
    root = ElementTree.Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=name, guid=guid, generationTool=tool,
        variableNamingConvention="flat", numberOfEventIndicators="0",
        description=f"{name}: half-car with tyres, brakes and suspension, which brakes on a straight road",
    )  # fmt: skip
    ElementTree.SubElement(
        root, "CoSimulation", modelIdentifier=identifier, canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="false", canGetAndSetFMUstate="true", canSerializeFMUstate="true",
        canNotUseMemoryManagementFunctions="true",
    )  # fmt: skip
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for unit, base in UNITS.items():
        ElementTree.SubElement(ElementTree.SubElement(units, "Unit", name=write_unit(unit)), "BaseUnit", base)
    ElementTree.SubElement(
        root, "DefaultExperiment", startTime="0", stopTime="5", stepSize=str(2 * INTERNAL_STEP_S)
    )
    variables = ElementTree.SubElement(root, "ModelVariables")
    for reference, row in enumerate((*INPUTS, *OUTPUTS)):
        description = (
            f"{row.description}: {_number_weathers(weathers)}" if row.kind == "choice" else row.description
        )
        _add_variable(variables, row, description, reference, starts.get(row.name))
    structure = ElementTree.SubElement(root, "ModelStructure")
    for group in ("Outputs", "InitialUnknowns"):
        unknowns = ElementTree.SubElement(structure, group)
        for index in range(len(INPUTS) + 1, len(INPUTS) + len(OUTPUTS) + 1):
            unknown = ElementTree.SubElement(unknowns, "Unknown", index=str(index))
            if group == "Outputs":  # it moves with the next step, and not with an input before it
                unknown.set("dependencies", "")
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def write_unit(unit: str) -> str:
    """Return a unit as other simulators write it.

    Parameters
    ----------
    unit : as `tasks.conventions` writes it
    """
    return _SLASHED.get(unit, unit)


def _number_weathers(weathers: Sequence[str]) -> str:
    """The codes of the kinds of weather in which a vehicle has a tyre, in words."""
    return ", ".join(f"{WEATHERS[kind].code} {kind}" for kind in weathers)


def _add_variable(
    parent: ElementTree.Element, row: EmbeddedVariable, description: str, reference: int, start: float | None
) -> None:
    fixed = {"parameter": {"causality": "parameter", "variability": "fixed"}, "input": {"causality": "input"}}
    roles = fixed.get(row.role, {"causality": "output", "initial": "calculated"})
    if row.kind != "real" and row.role != "parameter":
        roles |= {"variability": "discrete"}
    attributes = {"name": row.name, "valueReference": str(reference), "description": description}
    variable = ElementTree.SubElement(parent, "ScalarVariable", attributes | roles)
    if row.kind == "boolean":
        ElementTree.SubElement(variable, "Boolean", start="true" if start else "false")
        return
    if row.kind == "choice":
        # not an Enumeration: some importers (libcosim, Ecos) do not know that type, and could not choose
        given = {"min": "1", "max": str(int(row.maximum)), "start": str(int(start or 1))}
        ElementTree.SubElement(variable, "Integer", given)
        return
    bounds = {"min": row.minimum, "max": row.maximum, "start": start}
    given = {
        key: repr(value) for key, value in bounds.items() if value is not None and abs(value) != float("inf")
    }
    ElementTree.SubElement(variable, "Real", {"unit": write_unit(row.unit)} | given)
