"""The physics audit: a dataset's stored telemetry compared with the physical laws that it must follow."""

from pathlib import Path
from typing import Any

import numpy as np

from catalogs.documents import read_yaml
from catalogs.grids.form import TICK_RATE_HZ
from catalogs.low_speed import load_kept_low_speed
from catalogs.studies.ablation import cut_coupling, load_kept_families
from catalogs.surfaces import load_surface
from catalogs.variants import warn_of_variant
from catalogs.vehicles import load_vehicle
from flows.making.driving import collect_surface_depths, surface_of
from flows.making.input_changes import refuse_changed_records
from flows.making.plan import Plan, read_plan
from flows.making.traced import refuse_traced
from flows.running.orchestration import run_as_stage
from flows.store.address import open_for_reading, want_telemetry
from flows.store.layout import Layout
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest, read_plan_record, recorded_grid
from flows.store.telemetry import list_columns, read_columns, read_table
from tasks.conventions import (
    CLIP_CHANNELS,
    FRAME_CHANNELS,
    IDENTITY_CHANNELS,
    TICK_CHANNELS,
)
from tasks.errors import InputError
from tasks.eval.physics.audit import PhysicsVerdict, audit_clip
from tasks.eval.physics.constants import DT, Constants, TyreTables
from tasks.eval.physics.laws import finite_rows

DEPTHS = ("film_depth_mm", "snow_depth_mm", "snow_coverage")
"""Columns of what lies on the road that is seen."""


def audit_physics(dataset: str, *, out: str | None = None) -> dict[str, Any]:
    """Work every stored column out again from the others, and name the column of a clip that breaks a law.

    Where a coupling is cut on purpose, the motion is held against the scenario that its variant drives, and the result
    says so; the depths of film and snow are then the picture's, and are held against nothing.

    Parameters
    ----------
    dataset : a finished dataset in the paper's vehicle mode
    out : folder for physics.json

    Raises
    ------
    InputError
        If the folder is no finished dataset, a table lacks columns, or its mode's laws are not known here.
    """
    results = Outputs(out, "audit-physics", "physics.json")
    root = open_for_reading(dataset, want_telemetry).root
    plan = Plan.of(read_plan_record(Layout(root)), Layout(root).plan)
    refuse_traced(plan.inputs, dataset, "audit-physics")
    constants = read_constants(root)
    clips = clip_facts(root)
    held = [facts["label"] for facts in clips if facts["hold_speed"]]
    if held:
        raise InputError(
            f"{dataset}: {len(held)} clips hold their speed until the brake ({held[0]} first), by a force that no"
            " column records: the physics audit knows coasting cars only"
        )
    driven, absent = drive_facts(root, plan), list_absent_columns(Layout(root))
    rows = [
        run_as_stage(_clip_row)(root, facts, driven.get(facts["clip_id"], {}), constants, absent)
        for facts in clips
    ]
    broken = [row for row in rows if not row["passed"]]
    result = {
        "verified": not broken,
        "variant": plan.settings.variant,
        **({"warning": warning} if (warning := warn_of_variant(plan.settings.variant)) else {}),
        "clips_checked": len(rows),
        "laws_checked": sum(row["laws"] for row in rows),
        "wheels_lifted": [row["label"] for row in rows if not row["superposition_holds"]],
        "clips": rows,
    }
    results.write_json("physics.json", result)
    return result


def clip_facts(root: Path) -> list[dict[str, Any]]:
    """The clips' rows: scenario, surface, outcome and check.

    Raises
    ------
    InputError
        If the dataset is not finished, or the table, the plan or an input is missing or another than was recorded.
    """
    layout = Layout(root)
    manifest = read_manifest(layout)
    refuse_changed_records(layout, manifest)
    path = layout.telemetry / "clips.parquet"
    required = [channel.name for channel in IDENTITY_CHANNELS]
    table = read_table(path, required=required, most=len(manifest["clips"]))
    unknown = {channel.name: np.nan for channel in CLIP_CHANNELS if channel.unit}
    rows: list[dict[str, Any]] = [
        unknown | {name: value for name, value in row.items() if value is not None or name not in unknown}
        for row in table.to_pylist()
    ]
    if [row["clip_id"] for row in rows] != [clip["clip_id"] for clip in manifest["clips"]]:
        raise InputError(
            f"{path}: must have a row of each of the manifest's {len(manifest['clips'])} clips, in order; its"
            f" {len(rows)} rows are others: musync repair makes the table again"
        )
    return rows


def drive_facts(root: Path, plan: Plan) -> dict[str, dict[str, Any]]:
    """Return the facts of each clip that its variant drives otherwise than it is seen, by id.

    Parameters
    ----------
    root, plan : of the dataset
    """
    layout, variant = Layout(root), plan.settings.variant
    if variant == "full":
        return {}
    surface = load_surface(layout.inputs / "surface.yaml", layout.inputs / "weather")
    families = load_kept_families(layout.inputs, variant)
    driven = {clip.clip_id: cut_coupling(clip.scenario, variant, families) for clip in plan.clips}
    return {
        name: {key: np.nan if value is None else value for key, value in scenario.as_row().items()}
        | collect_surface_depths(surface_of(scenario, surface))
        for name, scenario in driven.items()
    }


def list_absent_columns(layout: Layout) -> frozenset[str]:
    """Return the columns, as table.column, that the tables of an older dataset do not have.

    Parameters
    ----------
    layout : of the dataset
    """
    tables = {
        "ticks": TICK_CHANNELS,
        "frames": (*FRAME_CHANNELS, *TICK_CHANNELS),
        "clips.parquet": CLIP_CHANNELS,
    }
    return frozenset(
        f"{table.removesuffix('.parquet')}.{channel.name}"
        for table, channels in tables.items()
        for names in [list_columns(layout.telemetry / table)]
        for channel in channels
        if channel.name not in names
    )


def clip_columns(root: Path, table: str, facts: dict[str, Any]) -> dict[str, np.ndarray]:
    """One clip's columns of the tick or the frame table.

    Parameters
    ----------
    root : of the dataset
    table : ``ticks`` or ``frames``
    facts : the clip's row

    Raises
    ------
    InputError
        If the clip or a column of every dataset is not there, or it has another number of rows than the plan.
    """
    folder = Layout(root).telemetry / table
    channels = TICK_CHANNELS if table == "ticks" else (*FRAME_CHANNELS, *TICK_CHANNELS)
    rows = read_plan(root).settings.rows_per_clip[table]
    return read_columns(folder, facts["clip_id"], [channel.name for channel in channels], most=rows)


def read_constants(root: Path) -> Constants:
    """The frozen car and pavement of a dataset, as numbers by name, in SI.

    Raises
    ------
    InputError
        If a file is missing, or the dataset was made in another mode or with effects.
    """
    layout = Layout(root)
    files = {name: layout.inputs / f"{name}.yaml" for name in ("vehicle", "surface")}
    missing = [
        f"{path}: no such file; is {root} a finished muSync dataset?"
        for path in files.values()
        if not path.is_file()
    ]
    if missing:
        raise InputError(missing)
    # of the form that they must have
    vehicle = load_vehicle(files["vehicle"], layout.inputs / "weather")
    pavement = load_surface(files["surface"], layout.inputs / "weather")
    car = read_yaml(files["vehicle"], "catalogue entry")
    settings = recorded_grid(read_plan_record(layout)["grid"], layout.plan)
    mode, steady = settings.vehicle_mode, load_kept_low_speed(layout.inputs)
    if mode != "paper" or car.get("effects"):
        raise InputError(
            f"{root}: the physics audit knows the laws of the paper's vehicle; this dataset was made in {mode} mode"
            f"{' with effects' if car.get('effects') else ''}, whose inner steps the stored ticks do not fix."
        )
    if car.get("tyre"):
        raise InputError(
            f"{root}: the physics audit knows Burckhardt's tyre; this dataset's vehicle drives on {car['tyre']}"
        )
    tyres = {kind: TyreTables(**vars(vehicle.find_tyre_family(kind))) for kind in vehicle.find_weathers()}
    surface = {name: value for name, value in vars(pavement).items() if isinstance(value, float)}
    return Constants(
        car=_convert_numbers(car), surface=surface, tyres=tyres, mode=mode,
        ticks_per_frame=TICK_RATE_HZ / settings.frame_rate_hz,
        steady_limit=0.0 if steady is None else steady.explicit_limit,
        held_share=0.0 if steady is None else steady.held_share,
        low_speed_rule=steady is None or steady.pitch_rule,
    )  # fmt: skip


def _convert_numbers(entry: dict[str, Any]) -> dict[str, float]:
    scalars = {
        k: v for k, v in entry.items() if isinstance(v, dict) and isinstance(v.get("value"), (int, float))
    }
    return {
        name: float(np.deg2rad(item["value"])) if item.get("unit") == "deg" else float(item["value"])
        for name, item in scalars.items()
    }


def _clip_row(
    root: Path, seen: dict[str, Any], driven: dict[str, Any], constants: Constants, absent: frozenset[str]
) -> dict[str, Any]:
    ticks, frames = clip_columns(root, "ticks", seen), clip_columns(root, "frames", seen)
    facts = seen | driven
    frames |= {name: np.full(len(frames["t_ns"]), driven[name]) for name in DEPTHS if name in driven}
    holes = [name for c in finite_rows(ticks) if (name := f"ticks.{c}") not in absent]
    with np.errstate(all="ignore"):  # stored values may be infinite; a law that infinity enters is broken
        verdict = audit_clip(ticks, frames, facts, constants, absent)
    lifted = {
        f"wheel_lift_time_{axle}": float(np.sum(~ticks[f"contact_{axle}"].astype(bool))) * DT for axle in "fr"
    }
    contact = lifted | {"superposition_holds": not any(lifted.values())}
    row = {"clip_id": facts["clip_id"], "label": facts["label"], **_as_row(verdict), "not_finite": holes}
    return row | contact


def _as_row(verdict: PhysicsVerdict) -> dict[str, Any]:
    return {
        "passed": verdict.passed,
        "laws": len(verdict.laws),
        "column": verdict.column,
        "also": list(verdict.also),
        "broken": [
            {"law": x.name, "excess": min(x.excess, 1e300), "row": x.at, "columns": sorted(x.columns)}
            for x in verdict.broken
        ],
        "tightest": max((x.excess for x in verdict.laws if not x.broken), default=0.0),
    }
