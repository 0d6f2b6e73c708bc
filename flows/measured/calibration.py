"""Calibration of known parameters: fit a vehicle's scalars to reference traces, freeze it, and report uncertainties."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.documents import parse_yaml
from catalogs.entries import find_entry, load
from catalogs.names import find_name_problem
from catalogs.references import ReferenceCase, Traces, read_reference, trace_file
from catalogs.vehicles import VehicleFile, open_vehicle
from catalogs.vehicles.frozen import frozen_text
from flows.measured.agreement import agreement_of
from flows.measured.grown_vehicle import tyre_beside
from flows.store.outputs import Outputs
from manifests.canonical import sha256_of, sha256_of_file
from manifests.provenance import code_version
from tasks.errors import InputError
from tasks.identification.calibration.identifiability import compute_identifiability
from tasks.identification.calibration.procedure import Procedure
from tasks.identification.calibration.residual import WHEELS, CalibrationCase
from tasks.identification.calibration.scalars import list_calibration_scalars, read_scalar, set_scalars
from tasks.identification.calibration.staged import calibrate_vehicle as run_stages
from tasks.vehicle.effects.table import EFFECT_UNITS, NUMBERS_OF_EFFECTS
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Mode

DIGITS = 6
"""Significant digits that a frozen file keeps of a calibrated scalar."""


def calibrate_on_traces(
    traces: str,
    *,
    out: str,
    vehicle: str = "paper-reference",
    procedure: str = "paper-staged",
    split: str = "development",
    name: str = "calibrated",
) -> dict[str, Any]:
    """Calibrate a vehicle in stages on one split of a folder of traces, and freeze it.

    Parameters
    ----------
    traces : folder with cases.json and NAME.parquet or */NAME.parquet
    out : folder for ``NAME.yaml`` and ``calibration.json``
    vehicle : catalogue name or file to start from
    procedure : catalogue name or file of the stages
    split : cases that are fitted; the others are not used
    name : name of the frozen vehicle

    Raises
    ------
    InputError
        Listing every problem of traces, vehicle or procedure; or for a name that is none.
    """
    if problem := find_name_problem(name):
        raise InputError(f"--name must {problem}")
    base = open_vehicle(vehicle)
    beside = tyre_beside(base)
    results = Outputs(out, "vehicle calibrate", f"{name}.yaml", "calibration.json", *beside)
    start = base.build()
    steps, interval = load("calibration procedure", procedure)
    reference = read_reference(Path(traces), split=split)
    before = agreement_of(start, reference, steps.mode)
    cases = [
        calibration_case(case, columns, row["window"], interval, steps.yardstick.start_s, start.wheelbase)
        for (case, columns), row in zip(reference, before["cases"], strict=True)
    ]
    fitted, records = run_stages(start, cases, steps)
    fitted = _rounded(fitted, steps)
    target = results.path(f"{name}.yaml")
    data = {case.case: sha256_of_file(trace_file(Path(traces), case.case)) for case, _ in reference}
    for file, content in beside.items():
        results.write(file, content)
    results.write(f"{name}.yaml", _frozen(fitted, base, procedure, steps, split, data))
    frozen = load("vehicle", target)
    after = agreement_of(frozen, reference, steps.mode)
    result = {
        "vehicle_file": str(target),
        "vehicle_sha256": sha256_of_file(target),
        "base": vehicle,
        "procedure": procedure,
        "mode": steps.mode,
        "split": split,
        "cases": [case.name for case in cases],
        "data_sha256": data,
        "stages": [asdict(record) for record in records],
        "before": before["groups"],
        "after": after["groups"],
        "without": _without(frozen, reference, steps.mode),
        "identifiability": asdict(compute_identifiability(frozen, cases, steps)),
    }
    results.write_json("calibration.json", result)
    return result


def calibration_case(
    case: ReferenceCase,
    columns: Traces,
    window: Sequence[float],
    interval: float,
    head_s: float,
    wheelbase: float,
) -> CalibrationCase:
    """Return one trace for the fit: the judge's event window and the samples from the brake onset to it.

    Parameters
    ----------
    case : conditions of the trace
    columns : columns of the trace
    window : start and end of the event [s]
    interval : spacing of the samples [s]
    head_s : time from the brake onset in which every sample counts [s]
    wheelbase : wheelbase of the model [m]
    """
    time = columns["time"]
    onset = case.brake_onset_s if case.braked and case.brake_onset_s is not None else window[0]
    inside = np.flatnonzero((time >= min(onset, window[0]) - 1e-9) & (time <= window[1] + 1e-9))
    every = max(1, round(interval / float(np.median(np.diff(time)))))
    head = inside[time[inside] <= time[inside[0]] + head_s + 1e-9]
    chosen = np.union1d(inside[::every], head)
    return CalibrationCase(
        name=case.case,
        kind=case.facts(wheelbase).kind,
        family=case.weather,
        surface_friction=case.surface_coefficient,
        controls=case.controls(),
        hazard=case.hazard(),
        time=time[chosen],
        event_start=window[0],
        speed=columns["speed"][chosen],
        pitch=columns["pitch"][chosen],
        slip=np.stack([columns[f"slip_{wheel}"][chosen] for wheel in WHEELS]),
        wheel_load=np.stack([columns[f"wheel_load_{wheel}"][chosen] for wheel in WHEELS]),
        stopping_distance=case.stopping_distance_m if case.hazard_height_m == 0 and case.braked else None,
    )


def _without(
    vehicle: Vehicle, reference: list[tuple[ReferenceCase, Traces]], mode: Mode
) -> list[dict[str, Any]]:
    """Return the mean agreement with each effect of the vehicle switched off and nothing fitted again.

    If the vehicle does not stop without an effect, a sentence replaces the figures.
    """
    rows: list[dict[str, Any]] = []
    for effect, numbers in NUMBERS_OF_EFFECTS.items():
        if any(vehicle.effects.get(number) for number in numbers):
            off = replace(vehicle, effects={**vehicle.effects, **dict.fromkeys(numbers, 0.0)})
            try:
                rows.append({"effect": effect, "mean": agreement_of(off, reference, mode)["mean"]})
            except InputError as error:
                rows.append({"effect": effect, "mean": None, "note": error.problems[0]})
    return rows


def _rounded(vehicle: Vehicle, procedure: Procedure) -> Vehicle:
    scalars = list_calibration_scalars(vehicle, procedure.groups)
    return set_scalars(vehicle, {s: float(f"{read_scalar(vehicle, s):.{DIGITS}g}") for s in scalars})


def _frozen(
    fitted: Vehicle,
    base: VehicleFile,
    procedure_name: str,
    procedure: Procedure,
    split: str,
    data: dict[str, str],
) -> str:
    """Return the frozen file: the base's entry with the calibrated values and their provenance."""
    entry = parse_yaml(base.content, base.source, "vehicle")
    before = entry.pop("provenance", None) or {"bounds": {}}
    note = f"calibrated by {Path(procedure_name).stem} on {len(data)} {split} cases, see provenance"
    for group in procedure.groups:
        if group in EFFECT_UNITS:
            number = {"value": fitted.effects[group], "unit": EFFECT_UNITS[group], "source": note}
            entry.setdefault("effects", {})[group] = number
            continue
        if group == "cg_to_front_axle":
            entry["cg_to_rear_axle"] |= {"value": fitted.cg_to_rear_axle, "source": note}
        if hasattr(fitted, group):
            value = getattr(fitted, group)
            in_entry = degrees(value) if entry[group]["unit"] == "deg" else value
            entry[group] |= {"value": float(f"{in_entry:.{DIGITS}g}"), "source": note}
            continue
        for family, tables in entry["families"].items():
            tables[group] |= {"value": list(getattr(fitted.families[family], group)), "source": note}
    provenance = {
        "mode": procedure.mode,
        "base": base.source.stem,
        "base_sha256": sha256_of([base.content]),
        "procedure": Path(procedure_name).stem,
        "procedure_sha256": sha256_of_file(find_entry("calibration procedure", procedure_name)),
        "version": code_version()["version"],
        "split": split,
        "data_sha256": data,
        "stages": [
            {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(stage).items()}
            for stage in procedure.stages
        ],
        # numbers of the base keep the bounds of their own fit
        "bounds": {
            group: limits
            for group, limits in before["bounds"].items()
            if group in fitted.effects or group not in EFFECT_UNITS
        }
        | {
            group: {"unit": bounds.unit, "lower": bounds.lower, "upper": bounds.upper}
            for group, bounds in procedure.bounds.items()
        },
    }
    return frozen_text(entry, provenance, f"{fitted.name} with its scalars {note}. Frozen: do not edit.")
