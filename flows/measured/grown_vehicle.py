"""The vehicle with the additions of a verdict, as a catalogue entry with provenance."""

from collections.abc import Mapping
from typing import Any

from catalogs.documents import parse_yaml
from catalogs.entries import entry_folder, find_entry
from catalogs.vehicles import VehicleFile
from catalogs.vehicles.frozen import frozen_text
from manifests.canonical import sha256_of, sha256_of_file
from manifests.provenance import code_version
from tasks.identification.decision.answer import NamedEffect, Parameter, Verdict
from tasks.identification.decision.forms import make_form_in_range
from tasks.vehicle.effects.forms import Form
from tasks.vehicle.effects.grown import FAMILY, apply_effects, find_family_tables
from tasks.vehicle.effects.ports import PORT_UNITS, VARIABLE_UNITS
from tasks.vehicle.effects.table import PARAMETERS, EffectParameter
from tasks.vehicle.parameters import Vehicle


def tyre_beside(file: VehicleFile) -> dict[str, bytes]:
    """Return the tyre's property file beside a vehicle's file, or beside one that it extends.

    A vehicle that is grown from it needs this file too.

    Parameters
    ----------
    file : of the vehicle

    Returns
    -------
    One file by its name; none if the vehicle names no tyre, or one of the catalogue.
    """
    tyre = file.tyre
    return {} if tyre is None or tyre[0].parent == entry_folder("tyre") else {tyre[0].name: tyre[1]}


def grown_vehicle(
    file: VehicleFile, verdict: Verdict, reached: Mapping[str, tuple[float, float]]
) -> tuple[str | None, list[str]]:
    """Return the text of the grown vehicle's file: the vehicle with the effects that were found.

    Errors of instruments are no part of the car. Neither is the grade of the proving ground, which is omitted and
    named.

    Parameters
    ----------
    file : of the judged vehicle
    verdict : the verdict
    reached : range of the variable of each form that the runs reached [unit of the variable]

    Returns
    -------
    The text, or None if nothing was added; and the parameters that no vehicle can carry.
    """
    source, content = file.source, file.content
    entry: dict[str, Any] = parse_yaml(content, source, "vehicle")
    before = entry.pop("provenance", None) or {"bounds": {}}
    base = file.build()
    bounds: dict[str, dict[str, Any]] = {}
    values: dict[str, float] = {}
    sources: dict[str, list[str]] = {}
    missing: list[str] = []
    for effect in verdict.effects:
        if effect.effect_class == "sensor":
            continue
        if effect.effect_class == "form":
            form = make_form_in_range(
                effect.name, tuple(p.value for p in effect.parameters), *reached[effect.variable]
            )
            source_text = "; ".join(_source(effect, p, verdict) for p in effect.parameters)
            entry["forms"] = [*entry.get("forms", ()), _form_entry(form, source_text, verdict.campaign)]
            bounds |= {f"{effect.name}: {p.name}": _limits(p) for p in effect.parameters}
            continue
        if not all(p.name in PARAMETERS and PARAMETERS[p.name].of_vehicle for p in effect.parameters):
            missing += [f"{effect.name}: {p.name}" for p in effect.parameters]
            continue
        for p in effect.parameters:
            # effects that share a number, such as air drag and headwind, are added
            values[p.name] = values.get(p.name, 0.0) + p.value
            sources.setdefault(p.name, []).append(_source(effect, p, verdict))
            own = base.effects.get(p.name, 0.0)
            bounds[p.name] = {"unit": p.unit, "lower": own + p.lower, "upper": own + p.upper}
    if not bounds:
        return None, missing
    grown = apply_effects(base, values)
    for parameter, texts in sources.items():
        for field in PARAMETERS[parameter].fields:
            _write(entry, grown, PARAMETERS[parameter], field, "; ".join(texts))
    kept = {effect: limits for effect, limits in before["bounds"].items() if effect in base.effects}
    bounds = kept | bounds
    rivals = [rival.name for _, rival in verdict.rivals]
    undecided = f"; the runs cannot tell it from {', '.join(rivals)}" if rivals else ""
    provenance = {
        "mode": "coupled",
        "base": source.stem,
        "base_sha256": sha256_of([content]),
        "procedure": f"close-loop, verdict {verdict.verdict}: {', '.join(e.name for e in verdict.effects)}{undecided}",
        "procedure_sha256": sha256_of_file(find_entry("library of effects")),
        "version": code_version()["version"],
        "split": f"train of {verdict.campaign}",
        "data_sha256": {"campaign": verdict.content_hash, "split": verdict.split_hash},
        "stages": [],
        "bounds": bounds,
    }
    title = f"{source.stem} with what the campaign {verdict.campaign} shows it lacks. Frozen: do not edit."
    return frozen_text(entry, provenance, title), missing


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
            "unit": PORT_UNITS[form.port],
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


def _write(entry: dict[str, Any], grown: Vehicle, row: EffectParameter, field: str, source: str) -> None:
    """Write one field of the grown vehicle into its file, with its source."""
    if row.kind == "added":
        old = entry.setdefault("effects", {}).get(field, {"source": ""})
        entry["effects"][field] = {
            "value": grown.effects[field], "unit": row.unit, "source": f"{old['source']}; {source}".removeprefix("; "),
        }  # fmt: skip
        return
    if field.startswith(FAMILY):
        # tyre families of the weather catalogue are no part of the vehicle's file
        kinds, table = find_family_tables(field, entry["families"])
        for weather in kinds:
            tables = entry["families"][weather]
            old = tables[table]
            tables[table] = {
                **old, "value": list(getattr(grown.families[weather], table)), "source": f"{old['source']}; {source}",
            }  # fmt: skip
        return
    entry[field] |= {"value": getattr(grown, field), "source": f"{entry[field]['source']}; {source}"}
