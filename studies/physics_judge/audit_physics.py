"""The physics audit: a dataset's stored telemetry compared with the physical laws that it must follow."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.scenes import load_route
from catalogs.studies.ablation import cut_coupling
from catalogs.variants import warn_of_variant
from flows.making.catalogue import Catalogue
from flows.making.driving import collect_surface_depths, surface_of
from flows.making.input_changes import refuse_changed_records
from flows.making.locations import find_scene, refuse_changed_scene
from flows.making.plan import Plan, read_plan
from flows.making.traced import refuse_traced
from flows.running.orchestration import run_as_stage
from flows.running.progress import progress_bar
from flows.store.address import open_for_reading, want_telemetry
from flows.store.layout import Layout
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest, read_plan_record
from flows.store.telemetry import list_columns, read_columns, read_table
from studies.physics_judge.clip_tables import iterate_clips
from studies.physics_judge.frozen_constants import read_constants
from studies.physics_judge.laws.audit import PhysicsVerdict, audit_clip
from studies.physics_judge.laws.constants import DT, Constants
from studies.physics_judge.laws.law import Law, finite_rows
from studies.physics_judge.laws.route import RouteLine
from tasks.conventions import (
    CHANNELS_BY_NAME,
    CHECK_CHANNELS,
    CLIP_CHANNELS,
    FRAME_CHANNELS,
    IDENTITY_CHANNELS,
    TICK_CHANNELS,
)
from tasks.errors import InputError

Tables = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]
"""Columns of a clip's ticks and of its frames."""

DEPTHS = ("film_depth_mm", "snow_depth_mm", "snow_coverage")
"""Columns of what lies on the road that is seen."""

LEVEL_WITHOUT = frozenset({"ticks.road_grade"})
"""Columns that a law reads also of an older dataset without them: its cars felt every road as level."""


def audit_physics(dataset: str, *, out: str | None = None) -> dict[str, Any]:
    """Work every stored column out again from the others, and name the column of a clip that breaks a law.

    Both vehicle modes, held speeds, any tyre and any calibrated or grown vehicle are judged. A law that an effect, a
    form or a steep road feature makes depend on what no column holds stands under ``not_judged``. Where the scene is
    at hand, every frame's pose is held against its route.

    Where a coupling is cut on purpose, the motion is held against the scenario that its variant drives, and the result
    says so; the depths of film and snow are then the picture's, and are held against nothing.

    Parameters
    ----------
    dataset : a finished dataset
    out : folder for physics.json

    Raises
    ------
    InputError
        If the folder is no finished dataset, or a table lacks columns.
    """
    results = Outputs(out, "lab audit-physics", "physics.json")
    root = open_for_reading(dataset, want_telemetry).root
    plan = Plan.of(read_plan_record(Layout(root)), Layout(root).plan)
    refuse_traced(plan.inputs, dataset, "lab audit-physics")
    constants = read_constants(root)
    clips = clip_facts(root)
    driven = drive_facts(root, plan)
    named = {clip.clip_id: clip.scenario.scene for clip in plan.clips}
    routes = {scene: find_route(plan.record_of(scene)) for scene in set(named.values())}
    absent = list_absent_columns(Layout(root))
    judged = {}
    with progress_bar("laws of clip", len(clips)) as advance:
        for facts, tables in iterate_tables(root, clips):
            row = run_as_stage(_clip_row)(
                tables,
                facts,
                driven.get(facts["clip_id"], {}),
                constants,
                routes[named[facts["clip_id"]]],
                absent,
            )
            advance(facts["label"], failed=not row["passed"])
            judged[facts["clip_id"]] = row
    rows = [judged[facts["clip_id"]] for facts in clips]
    broken = [row for row in rows if not row["passed"]]
    result = {
        "verified": not broken,
        "variant": plan.settings.variant,
        **({"warning": warning} if (warning := warn_of_variant(plan.settings.variant)) else {}),
        "clips_checked": len(rows),
        "poses_checked": None not in routes.values(),
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
    unknown = {channel.name: np.nan for channel in (*CLIP_CHANNELS, *CHECK_CHANNELS) if channel.unit}
    rows: list[dict[str, Any]] = [
        unknown | {name: value for name, value in row.items() if value is not None or name not in unknown}
        for row in table.to_pylist()
    ]
    if [row["clip_id"] for row in rows] != [clip["clip_id"] for clip in manifest["clips"]]:
        raise InputError(
            f"{path}: must have a row of each of the manifest's {len(manifest['clips'])} clips, in order; its"
            f" {len(rows)} rows are others: musync lab repair makes the table again"
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
    catalogue = Catalogue(layout.inputs)
    driven = {clip.clip_id: cut_coupling(clip.scenario, variant, catalogue.families) for clip in plan.clips}
    return {
        name: {key: np.nan if value is None else value for key, value in scenario.as_row().items()}
        | collect_surface_depths(surface_of(scenario, catalogue.surface))
        for name, scenario in driven.items()
    }


def list_absent_columns(layout: Layout) -> frozenset[str]:
    """Return the columns, as table.column, that the tables of an older dataset do not have.

    Parameters
    ----------
    layout : of the dataset
    """
    tables = {
        "ticks": list_known("ticks"),
        "frames": list_known("frames"),
        "clips.parquet": [channel.name for channel in CLIP_CHANNELS],
    }
    return frozenset(
        f"{table.removesuffix('.parquet')}.{name}"
        for table, known in tables.items()
        for stored in [list_columns(layout.telemetry / table)]
        for name in known
        if name not in stored
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
    rows = read_plan(root).settings.rows_per_clip[table]
    return read_columns(Layout(root).telemetry / table, facts["clip_id"], list_known(table), most=rows)


def iterate_tables(root: Path, clips: Sequence[dict[str, Any]]) -> Iterator[tuple[dict[str, Any], Tables]]:
    """Yield each clip's row and its columns of both tables, in the order of the files, each of which is read once.

    Parameters
    ----------
    root : of the dataset
    clips : rows of all clips

    Raises
    ------
    InputError
        As `clip_columns` raises it.
    """
    folder, left = Layout(root).telemetry, {facts["clip_id"]: facts for facts in clips}
    rows = read_plan(root).settings.rows_per_clip
    frames = iterate_clips(folder / "frames", list_known("frames"), rows["frames"])
    shown: dict[str, dict[str, np.ndarray]] = {}
    for clip_id, ticks in iterate_clips(folder / "ticks", list_known("ticks"), rows["ticks"]):
        for other, columns in frames:
            shown[other] = columns
            if other == clip_id:
                break
        found = {"ticks": len(ticks["t_ns"]), "frames": len(shown.get(clip_id, ticks)["t_ns"])}
        if clip_id in left and clip_id in shown and found == rows:
            yield left.pop(clip_id), (ticks, shown.pop(clip_id))
    for facts in left.values():  # one that is not there has its sentence
        yield facts, (clip_columns(root, "ticks", facts), clip_columns(root, "frames", facts))


def list_known(table: str) -> list[str]:
    """Return the names of the columns of the tick or the frame table that the laws are about.

    Parameters
    ----------
    table : ``ticks`` or ``frames``
    """
    channels = TICK_CHANNELS if table == "ticks" else (*FRAME_CHANNELS, *TICK_CHANNELS)
    return [channel.name for channel in channels]


def _clip_row(
    tables: Tables,
    seen: dict[str, Any],
    driven: dict[str, Any],
    constants: Constants,
    route: RouteLine | None,
    absent: frozenset[str],
) -> dict[str, Any]:
    ticks, frames = tables
    facts = seen | driven | (_find_policys_brake(ticks) if constants.policy else {})
    frames = frames | {name: np.full(len(frames["t_ns"]), driven[name]) for name in DEPTHS if name in driven}
    holes = [name for c in finite_rows(ticks) if (name := f"ticks.{c}") not in absent]
    with np.errstate(all="ignore"):  # stored values may be infinite; a law that infinity enters is broken
        verdict = audit_clip(ticks, frames, facts, constants, route, absent - LEVEL_WITHOUT)
    lifted = {
        f"wheel_lift_time_{axle}": float(np.sum(~ticks[f"contact_{axle}"].astype(bool))) * DT for axle in "fr"
    }
    contact = lifted | {"superposition_holds": not any(lifted.values())}
    row = {
        "clip_id": facts["clip_id"],
        "label": facts["label"],
        **_as_row(verdict, frames["tick"]),
        "not_finite": holes,
    }
    return row | contact


def _find_policys_brake(ticks: dict[str, np.ndarray]) -> dict[str, float]:
    """Where a policy first braked, and its highest pressure, in the place of a scenario's brake."""
    pressed = np.flatnonzero(ticks["brake_pressure_mpa"] > 0)
    if not pressed.size:
        return {}
    onset = DT * max(int(pressed[0]) - 1, 0)
    return {"brake_onset_s": onset, "peak_pressure_mpa": float(ticks["brake_pressure_mpa"].max())}


def find_route(scene: Mapping[str, Any]) -> RouteLine | None:
    """Return the route of the recorded scene; None where that is not at hand, or is another one by now.

    Parameters
    ----------
    scene : ``name`` and ``sha256``, of a plan
    """
    try:
        refuse_changed_scene(scene)
        route = load_route(find_scene(scene))
    except InputError:
        return None
    return RouteLine(station=route.station, T_world_rig=route.T_world_rig)


def _as_row(verdict: PhysicsVerdict, frame_ticks: np.ndarray) -> dict[str, Any]:
    return {
        "passed": verdict.passed,
        "laws": len(verdict.laws),
        "column": verdict.column,
        "also": list(verdict.also),
        "broken": [_describe_break(law, frame_ticks) for law in verdict.broken],
        "not_judged": dict(verdict.not_judged),
        "tightest": max((x.excess for x in verdict.laws if not x.broken), default=0.0),
    }


def _describe_break(law: Law, frame_ticks: np.ndarray) -> dict[str, Any]:
    """Law, tick and size of a break; ``tick`` is null where a law is of the clip's row."""
    table, _, name = law.of.partition(".")
    tick = {"ticks": law.at, "frames": int(frame_ticks[law.at]) if law.at < len(frame_ticks) else None}.get(
        table
    )
    channel = CHANNELS_BY_NAME.get(name)
    return {
        "law": law.name, "excess": _bound_number(law.excess), "row": law.at, "tick": tick,
        "size": _bound_number(law.size), "unit": channel.unit if channel else "", "columns": sorted(law.columns),
    }  # fmt: skip


def _bound_number(value: float) -> float:
    """A number that JSON can hold: what is not finite breaks a law by any amount."""
    return min(value, 1e300) if value == value else 1e300
