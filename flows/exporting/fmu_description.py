"""modelDescription.xml of a vehicle: its variables with units, and what the FMU can do (FMI 2.0.4, section 2.2)."""

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree

from tasks.surface.weather import WEATHERS
from tasks.vehicle.model.embedded import STEP
from tasks.vehicle.model.embedded_variables import INPUTS, OUTPUTS, EmbeddedVariable

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
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stopTime="5", stepSize=str(2 * STEP))
    variables = ElementTree.SubElement(root, "ModelVariables")
    for place, row in enumerate((*INPUTS, *OUTPUTS)):
        said = f"{row.description}: {_number_weathers(weathers)}" if row.kind == "choice" else row.description
        _add_variable(variables, row, said, place, starts.get(row.name))
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
    parent: ElementTree.Element, row: EmbeddedVariable, description: str, place: int, start: float | None
) -> None:
    fixed = {"parameter": {"causality": "parameter", "variability": "fixed"}, "input": {"causality": "input"}}
    roles = fixed.get(row.role, {"causality": "output", "initial": "calculated"})
    if row.kind != "real" and row.role != "parameter":
        roles |= {"variability": "discrete"}
    said = {"name": row.name, "valueReference": str(place), "description": description}
    variable = ElementTree.SubElement(parent, "ScalarVariable", said | roles)
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
