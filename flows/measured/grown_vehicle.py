"""The vehicle with what a verdict adds, as a catalogue entry that names where it comes from."""

from collections.abc import Mapping
from typing import Any

import yaml

from catalogs.effects import LIBRARY_FILE
from catalogs.entries import find_entry
from catalogs.vehicles.added import VARIABLE_UNITS
from catalogs.vehicles.frozen import frozen_text
from manifests.canonical import sha256_of_file
from manifests.provenance import code_version
from tasks.identification.decision.answer import NamedEffect, Parameter, Verdict
from tasks.identification.decision.forms import form_in_range
from tasks.vehicle.effects.forms import Form
from tasks.vehicle.effects.numbers import EFFECT_UNITS
from tasks.vehicle.effects.ports import PORT_UNITS, PORTS

SCALED = {
    "pressure_gain": ("brake_gain",),
    "mass": ("sprung_mass",),
    "wheel_radius": ("wheel_radius",),
    "damping": ("suspension_damping_f", "suspension_damping_r"),
    "stiffness": ("suspension_stiffness_f", "suspension_stiffness_r"),
}
"""Parameters that are a relative change of the vehicle's own numbers."""
SHIFTED = {"front_bias": ("front_brake_share",), "wheel_inertia": ("wheel_inertia_f", "wheel_inertia_r")}
"""Parameters that are added to the vehicle's own numbers."""
TABLES = {"friction": "efficiency", "slip_stiffness": "slip_stiffness"}
"""Parameters that are a relative change of a table of every tyre family."""


def grown_vehicle(
    name: str, verdict: Verdict, reached: Mapping[str, tuple[float, float]]
) -> tuple[str | None, list[str]]:
    """The text of the grown vehicle's file.

    Sensor faults are no part of the car. What else is none, as the grade of the proving ground, is left out and
    named.

    Parameters
    ----------
    name : catalogue name or file of the vehicle that was judged
    verdict : what was found
    reached : of the variable of each form, the range that the runs reached [unit of the variable]

    Returns
    -------
    The text, or None where nothing was added; and the parameters that could not be.
    """
    source = find_entry("vehicle", name)
    entry: dict[str, Any] = yaml.safe_load(source.read_text(encoding="utf-8"))
    entry.pop("provenance", None)
    bounds: dict[str, dict[str, Any]] = {}
    missing: list[str] = []
    for effect in verdict.effects:
        if effect.effect_class == "sensor":
            continue
        if effect.effect_class == "form":
            form = form_in_range(
                effect.name, tuple(p.value for p in effect.parameters), *reached[effect.variable]
            )
            sources = "; ".join(_source(effect, p, verdict) for p in effect.parameters)
            entry["forms"] = [*entry.get("forms", ()), _form_entry(form, sources, verdict.campaign)]
            bounds |= {f"{effect.name}: {p.name}": _limits(p) for p in effect.parameters}
            continue
        if not all(_carried(p.name) for p in effect.parameters):
            missing += [f"{effect.name}: {p.name}" for p in effect.parameters]
            continue
        for parameter in effect.parameters:
            _apply(entry, parameter, _source(effect, parameter, verdict))
            bounds[parameter.name] = _limits(parameter)
    if not bounds:
        return None, missing
    rivals = [rival.name for _, rival in verdict.rivals]
    untold = f"; the runs cannot tell it from {', '.join(rivals)}" if rivals else ""
    provenance = {
        "mode": "coupled",
        "base": source.stem,
        "base_sha256": sha256_of_file(source),
        "procedure": f"close-loop, verdict {verdict.verdict}: {', '.join(e.name for e in verdict.effects)}{untold}",
        "procedure_sha256": sha256_of_file(LIBRARY_FILE),
        "version": code_version()["version"],
        "split": f"train of {verdict.campaign}",
        "data_sha256": {"campaign": verdict.content_hash, "split": verdict.split_hash},
        "stages": [],
        "bounds": bounds,
    }
    title = f"{source.stem} with what the campaign {verdict.campaign} shows it lacks. Frozen: do not edit."
    return frozen_text(entry, provenance, title), missing


def _carried(name: str) -> bool:
    return name in EFFECT_UNITS or name in SCALED or name in SHIFTED or name in TABLES


def _limits(p: Parameter) -> dict[str, Any]:
    return {"unit": p.unit, "lower": p.lower, "upper": p.upper}


def _form_entry(form: Form, source: str, campaign: str) -> dict[str, Any]:
    unit = VARIABLE_UNITS[form.variable]
    return {
        "port": form.port,
        "variable": form.variable,
        "shape": form.shape,
        "coefficients": {
            "value": list(form.coefficients),
            "unit": PORT_UNITS[PORTS.index(form.port)],
            "source": source,
        },
        "scale": {"value": form.scale, "unit": unit, "source": "where x of the shape is 1: by the grammar"},
        "range": {
            "value": [form.low, form.high],
            "unit": unit,
            "source": f"what the runs of {campaign} reached; beyond it the form is held constant",
        },
    }


def _source(effect: NamedEffect, p: Parameter, verdict: Verdict) -> str:
    return (
        f"close-loop on {verdict.campaign}, verdict {verdict.verdict}: {effect.name}, {p.name} {p.value:.6g} {p.unit},"
        f" 95 % interval {p.ci_low:.6g} to {p.ci_high:.6g}"
    )


def _apply(entry: dict[str, Any], p: Parameter, source: str) -> None:
    if p.name in SCALED or p.name in SHIFTED:
        for key in SCALED.get(p.name, ()) or SHIFTED[p.name]:
            value = entry[key]["value"]
            grown = value * (1.0 + p.value) if p.name in SCALED else value + p.value
            entry[key] = {**entry[key], "value": float(grown), "source": f"{entry[key]['source']}; {source}"}
    elif p.name in TABLES:
        for family in entry["families"].values():
            table = family[TABLES[p.name]]
            family[TABLES[p.name]] = {
                **table,
                "value": [float(v * (1.0 + p.value)) for v in table["value"]],
                "source": f"{table['source']}; {source}",
            }
    else:
        effects = entry.setdefault("effects", {})
        # two effects that share a number, as air drag and headwind do, add up; so does what the base had
        before = effects.get(p.name, {"value": 0.0, "source": ""})
        effects[p.name] = {
            "value": float(before["value"] + p.value),
            "unit": EFFECT_UNITS[p.name],
            "source": f"{before['source']}; {source}".removeprefix("; "),
        }
