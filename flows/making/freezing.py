"""Frozen runs: frozen from a grid, compared with the code and catalogue at hand, and made again hash for hash."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from catalogs.entries import entry_names, load
from catalogs.grids import Grid, GridFile, expand_grid
from catalogs.grids.form import BEFORE
from catalogs.sentences import cap_problems
from catalogs.studies.ablation import cut_coupling
from flows.making.driving import simulate_drive
from flows.making.generate import generate_dataset
from flows.making.grid_entries import find_private_entries, read_entries
from flows.making.grid_inputs import grade_of
from flows.making.locations import find_scene
from flows.making.plan import Plan, freeze_grid
from flows.making.run_report import RunReport
from flows.running.progress import progress_bar
from flows.running.runner import RunnerChoice
from flows.store.layout import write_atomically
from flows.store.outputs import find_dataset_problems, refuse_link
from flows.store.sealed import read_manifest, recorded_grid
from flows.store.telemetry import content_hash
from manifests.explain import as_sentences, find_tool_differences, parse_input, tools_here
from manifests.frozen_run import (
    FOLDER,
    find_differences,
    find_differing_clips,
    list_frozen,
    parameters_that_matter,
    read_frozen,
    seal_run,
)
from manifests.provenance import describe_processor
from manifests.records import FrozenRun
from tasks.errors import InputError

RULES = ("low_speed", "duration_s", "hazard_marking", "wet_friction")
"""Settings that grids gained after runs of them were frozen."""


def freeze_run(grid: str | None = None, *, out: str | None = None) -> dict[str, Any]:
    """Freeze the run of a grid, or freeze again those that ship with the project.

    A run that ships keeps the rules (`RULES`) that it was first frozen under, whatever its grid asks for today: who has
    its name gets the bytes that it always gave. ``out`` freezes a grid as it is.

    Parameters
    ----------
    grid : grid file, or the name of one that ships; None takes every frozen run that ships
    out : file to write; None writes where the project keeps its own, and then the grid has to be one that ships

    Returns
    -------
    ``frozen[]`` with ``name``, ``clips``, ``file``, and ``changed``: whether anything but the record of tools differs
    from what the file held before

    Raises
    ------
    InputError
        For a faulty grid, one that is not the project's own and goes to no file, or one with a catalogue file outside
        the working folder, which nobody would find again.
    """
    names = [grid] if grid is not None else list(list_frozen())
    if out is not None and grid is None:
        raise InputError("--out FILE: name the grid whose run is to be frozen in it")
    if out is not None and Path(out).suffix != ".json":
        raise InputError(f"--out {out}: the file of a frozen run must end in .json; it does not")
    if out is None and (strange := [name for name in names if name not in entry_names("grid")]):
        raise InputError(
            [f"{name}: is no grid of the project: say with --out FILE where to freeze it" for name in strange]
        )
    rows = []
    with progress_bar("frozen", len(names)) as advance:
        for name in names:
            grid_asked = load("grid", name)
            if problems := find_private_entries(grid_asked.settings):
                raise InputError([f"{name}: {problem}" for problem in problems])
            file = Path(out) if out is not None else FOLDER / f"{grid_asked.settings.name}.json"
            refuse_link(file)
            if problems := find_dataset_problems(file, file.parent):
                raise InputError(problems)
            before = _frozen_before(file, out is None)
            run = frozen_run(
                grid_asked if out is not None or before is None else keep_rules(grid_asked, before)
            )
            changed = before is None or any(
                before[key] != run[key] for key in ("grid", "parameters", "clips")
            )
            if changed or out is not None:
                # keys keep their order: that of the axes is the order of the clips
                write_atomically(file, (json.dumps(run, indent=1, allow_nan=False) + "\n").encode())
            rows.append(
                {"name": run["name"], "clips": len(run["clips"]), "file": str(file), "changed": changed}
            )
            advance(name)
    return {"frozen": rows}


def _frozen_before(file: Path, ours: bool) -> FrozenRun | None:
    """The frozen run that a file holds; None where there is no file, or one of ours that is out of date.

    Raises
    ------
    InputError
        If a user's file holds something else, which must not be lost.
    """
    if not file.exists():
        return None
    try:
        return read_frozen(file)
    except InputError as error:
        if ours:
            return None
        raise InputError(
            [
                *error.problems,
                f"{file}: is no frozen run to be frozen anew: move it away or name another file",
            ]
        ) from None


def frozen_run(grid: Grid) -> dict[str, Any]:
    """Return the frozen run of a grid, with the hashes of the telemetry that this machine computes."""
    plan, inputs = _plan_clips(grid)
    ticks = ticks_of(plan, grid.settings)
    return seal_run({
        "name": grid.settings.name,
        "grid": frozen_settings(plan.settings),
        "parameters": _read_parameters(plan, inputs),
        "clips": [clip | {"ticks": ticks[clip["label"]]} for clip in _list_records(plan)],
        "scene": dict(plan.scene),
        **({"scenes": [dict(scene) for scene in plan.scenes]} if plan.scenes else {}),
        "made_with": {key: dict(value) for key, value in plan.made_with.items()},
        "processor": describe_processor(),
    })  # fmt: skip


def keep_rules(grid: Grid, before: FrozenRun) -> Grid:
    """Return a grid under the rules that its frozen run was made by, so that a run that ships stays the same run.

    Parameters
    ----------
    grid : as it is in the catalogue now
    before : its frozen run
    """
    recorded = recorded_grid(before["grid"], f"manifest {before['name']}")
    return replace(
        grid, settings=grid.settings.model_copy(update={name: getattr(recorded, name) for name in RULES})
    )


def frozen_settings(settings: GridFile) -> dict[str, Any]:
    """Return the settings of a grid as a frozen run has them: those that are no default, or that an older record lacks.

    Parameters
    ----------
    settings : of the grid
    """
    kept = settings.model_dump(mode="json", exclude_defaults=True, exclude=set(BEFORE))
    now = settings.model_dump(mode="json", include=set(BEFORE))
    return kept | {name: value for name, value in now.items() if value != BEFORE[name]}


def problems_of(frozen: FrozenRun) -> list[str]:
    """Why a frozen run cannot be made again here, a sentence each; empty when it can.

    Every clip is driven and its telemetry compared: some milliseconds a clip, whatever its frames would cost.
    """
    try:
        grid = _grid_of(frozen)
        plan, inputs = _plan_clips(grid)
    except InputError as error:
        return list(error.problems)
    found = find_differences(frozen, _read_parameters(plan, inputs), _list_records(plan))
    if found:
        return found
    differing = find_differing_clips(frozen, ticks_of(plan, grid.settings))
    if not differing:
        return []
    tools = "; ".join(as_sentences(find_tool_differences(frozen, tools_here()))) or "none that is recorded"
    return [
        f"the telemetry of {len(differing)} of {len(frozen['clips'])} clips comes out otherwise ({differing[0]} first),"
        f" from the same scenarios and parameters; tools that differ: {tools}"
    ]


def reproduce_run(
    manifest: str,
    out: str,
    *,
    runner: RunnerChoice = "auto",
    workers: int | None = None,
    scheduler: str | None = None,
    backend: str = "auto",
) -> tuple[RunReport, list[str]]:
    """Make the dataset of a frozen run again.

    Parameters
    ----------
    manifest : name of a frozen run that ships, or a file
    out : dataset folder, as in `flows.making.generate.generate_dataset`

    Returns
    -------
    The report, and the labels of the clips whose telemetry is not the frozen one, which is none on a machine whose
    workers compute as this one does

    Raises
    ------
    InputError
        Before anything is written, if what is here does not make the frozen telemetry: with each difference.
    """
    frozen = read_frozen(manifest)
    problems = problems_of(frozen)
    if problems:
        raise InputError([
            *(f"manifest {manifest}: {problem}" for problem in cap_problems(problems)),
            f"manifest {manifest}: what to do: musync generate GRID makes a dataset with what is here; musync lab"
            f" freeze freezes it anew; source {frozen['made_with']['code']['source_sha256'][:12]} of version"
            f" {frozen['made_with']['code']['version']} makes it as it was",
        ])  # fmt: skip
    report = generate_dataset(
        _grid_of(frozen), out, runner=runner, workers=workers, scheduler=scheduler, backend=backend
    )
    made = {clip["label"]: clip["content"]["ticks"] for clip in read_manifest(report.layout)["clips"]}
    return report, find_differing_clips(frozen, made)


def ticks_of(plan: Plan, asked: GridFile) -> dict[str, str]:
    """Label to the hash of a clip's telemetry, of every clip of a plan; nothing is written.

    Parameters
    ----------
    plan : the clips
    asked : settings with the vehicle and the surface as they were asked for; the plan may record their names alone
    """
    entries = read_entries(asked)
    grades = {named: grade_of(named or asked.scene) for named in {clip.scenario.scene for clip in plan.clips}}
    rides = (
        simulate_drive(
            cut_coupling(clip.scenario, plan.settings.variant),
            entries.vehicle,
            entries.surface,
            plan.settings.vehicle_mode,
            plan.duration_s,
            entries.steady,
            grades[clip.scenario.scene],
        )[1]
        for clip in plan.clips
    )
    return {
        clip.label: content_hash("ticks", ride.columns) for clip, ride in zip(plan.clips, rides, strict=True)
    }


def _grid_of(frozen: FrozenRun) -> Grid:
    origin = f"manifest {frozen['name']}"
    settings = recorded_grid(frozen["grid"], origin)
    return expand_grid(settings.model_copy(update={"scene": find_scene(frozen["scene"])}), origin)


def _plan_clips(grid: Grid) -> tuple[Plan, dict[str, bytes]]:
    # no id of a clip is kept, so it does not matter which rasteriser the plan names
    return freeze_grid(grid, grid.settings.name, "cpu")


def _read_parameters(plan: Plan, inputs: Mapping[str, bytes]) -> dict[str, Any]:
    parsed = {name: parse_input(name, content) for name, content in inputs.items()}
    return parameters_that_matter(parsed, bool(plan.settings.pictures))


def _list_records(plan: Plan) -> list[dict[str, Any]]:
    kept = ("label", "seed", "scenario", "split", "calibration")
    return [{key: clip[key] for key in kept} for clip in plan.as_json()["clips"]]
