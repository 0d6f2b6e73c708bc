"""Repair of a finished dataset: damaged and missing files are made again byte for byte, or a sentence says why not."""

from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath
from typing import Any

from flows.auditing.stored_frames import draw_sheet_again
from flows.auditing.verify import compare_files
from flows.making.gathering import table_parts, write_part
from flows.making.generate import create_frame_arrays, fan_out, open_workers
from flows.making.input_changes import recorded_inputs
from flows.making.plan import Plan, read_plan
from flows.making.seal import SHEET
from flows.making.summaries import SUMMARIES, summarise_clips
from flows.running.orchestration import run_as_stage
from flows.running.runner import RunnerName, check_runner
from flows.store.address import open_for_writing, send_files, want_everything
from flows.store.layout import STAGED_TABLES, Layout, write_atomically, write_json
from flows.store.lock import sole_writer
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest
from flows.store.staging import left_overs, remove_staged, remove_staging, scratch_dataset
from flows.store.telemetry import write_tables
from manifests.canonical import sha256_of_file
from manifests.explain import as_sentences, find_tool_differences, tools_here
from manifests.manifest import recorded_files
from manifests.records import Manifest
from tasks.errors import InputError


def repair_dataset(
    dataset: str,
    *,
    out: str | None = None,
    runner: RunnerName = "dask",
    workers: int | None = None,
    scheduler: str | None = None,
) -> dict[str, Any]:
    """Make the damaged and missing files of a dataset again; nothing is replaced but by its recorded bytes.

    Parameters
    ----------
    dataset : a sealed dataset folder
    out : folder for ``repair.json``; None writes none
    runner, workers, scheduler : where clips are made again, as for generating

    Returns
    -------
    ``repaired`` (all is well now), ``damaged[]`` as found, ``restored[]`` paths, ``failed[]`` paths whose bytes
    came out otherwise, the ``differences`` of the tools that can be why, and ``left_to_do[]``, a sentence for each file
    that nobody recorded.

    Raises
    ------
    InputError
        The manifest itself is damaged, inputs that clips follow from cannot be found any more, or there is no such
        runner.
    """
    check_runner(runner, scheduler)
    results = Outputs(out, "lab repair", "repair.json")
    with open_for_writing(dataset, want_everything) as layout:
        result = _repair_locked(layout, runner, workers, scheduler)
    results.write_json("repair.json", result)
    return result


def _repair_locked(
    layout: Layout, runner: RunnerName, workers: int | None, scheduler: str | None
) -> dict[str, Any]:
    if not layout.manifest.is_file():
        read_manifest(layout)  # says what is missing, before anything is written there
    with sole_writer(layout):
        remove_staged(left_overs(layout))
        found = run_as_stage(compare_files)(layout)
        if any(row["path"] == "manifest.json" for row in found["damaged"]):
            raise InputError(
                f"{layout}/manifest.json: {found['damaged'][0]['damage']}, so nothing says what the other files should"
                " be: put back a copy of the manifest, or generate the grid again into another folder"
            )
        manifest = read_manifest(layout)
        paths = [row["path"] for row in found["damaged"] if row["damage"] != "not recorded"]
        _refuse_files_as_folders(layout, paths)
        restored = (
            run_as_stage(restore_files)(layout, manifest, paths, runner, workers, scheduler) if paths else []
        )
        send_files(layout, [layout.root / path for path in restored])
        remove_staging(layout)
    return {
        "repaired": run_as_stage(compare_files)(layout)["verified"],
        "damaged": found["damaged"],
        "restored": restored,
        "failed": sorted(set(paths) - set(restored)),
        "differences": as_sentences(find_tool_differences(manifest, tools_here())),
        "left_to_do": [
            f"{layout}/{row['path']}: nobody recorded this file, and readers would take it for data: remove it"
            for row in found["damaged"]
            if row["damage"] == "not recorded"
        ],
    }


def _refuse_files_as_folders(layout: Layout, paths: Iterable[str]) -> None:
    """Raise `InputError` where a folder is expected and something else exists, or a folder exists instead of a file."""
    folders = {folder for path in paths for folder in PurePosixPath(path).parents} - {PurePosixPath(".")}
    wrong = [path for path in folders if (layout.root / path).is_file()]
    wrong += [PurePosixPath(path) for path in paths if (layout.root / path).is_dir()]
    if wrong:
        raise InputError(
            [
                f"{layout.root / path}: must not be a file where the dataset has a folder, nor a folder where it has a"
                " file: move it away and repair again"
                for path in sorted(wrong)
            ]
        )


def restore_files(
    layout: Layout,
    manifest: Manifest,
    paths: list[str],
    runner: RunnerName,
    workers: int | None,
    scheduler: str | None,
) -> list[str]:
    """Make files again in a scratch folder beside the dataset, and move in those with the recorded bytes."""
    restored: list[str] = []
    wanted = {path: digest for path, (digest, _) in recorded_files(manifest).items() if path in paths}

    def move_in(scratch: Layout, candidates: Iterable[str]) -> None:
        for path in candidates:
            source = scratch.root / path
            if path in wanted and source.is_file() and sha256_of_file(source) == wanted[path]:
                write_atomically(layout.root / path, source.read_bytes())
                restored.append(path)

    with scratch_dataset(layout) as scratch:
        plan = _prepare_scratch(layout, scratch, manifest)
        move_in(scratch, [path for path in paths if (scratch.root / path).is_file()])
        _compress_as_recorded(layout, scratch, paths)
        parts = {table: table_parts(plan, table) for table in STAGED_TABLES}
        broken = [(t, path, ids) for t in parts for path, ids in parts[t].items() if path in wanted]
        again = {clip_id for _, _, ids in broken for clip_id in ids}
        again |= {clip["clip_id"] for clip in manifest["clips"] if wanted.keys() & clip["artifacts"].keys()}
        indices = [clip.index for clip in plan.clips if clip.clip_id in again]
        if indices:
            with open_workers(scratch, plan, runner, workers, scheduler) as executor:
                fan_out(scratch, plan, indices, executor)
        move_in(scratch, [path for clip in manifest["clips"] for path in clip["artifacts"]])
        for table, path, ids in broken:
            write_part(scratch, table, path, ids, plan.settings.rows_per_clip[table])
        move_in(scratch, [path for _, path, _ in broken])
        _remake_summaries(layout, scratch, plan, manifest, wanted)
        move_in(scratch, [*SUMMARIES, SHEET])
    return sorted(restored)


def _prepare_scratch(layout: Layout, scratch: Layout, manifest: Manifest) -> Plan:
    """Plan, inputs and empty arrays in the scratch folder, from the dataset, the manifest or the catalogue."""
    plan = Plan.of(manifest, "manifest.json")
    write_json(scratch.plan, plan.as_json())
    write_json(scratch.inputs / "grid.json", plan.settings.model_dump(mode="json"))
    inputs = recorded_inputs(layout, manifest)
    if lost := manifest["inputs"].keys() - inputs.keys():
        raise InputError(
            [
                f"{layout.inputs / name}: damaged, and nothing here has or gives its bytes"
                f" (SHA-256 {manifest['inputs'][name][:12]}...): put the file back and repair again"
                for name in sorted(lost)
            ]
        )
    for name, content in inputs.items():
        write_atomically(scratch.inputs / name, content)
    create_frame_arrays(scratch, plan)
    return read_plan(scratch.root)


def _compress_as_recorded(layout: Layout, scratch: Layout, damaged: list[str]) -> None:
    """Give the scratch arrays the dataset's own metadata: an earlier version may have compressed otherwise."""
    for made in sorted(scratch.frames.glob("*/zarr.json")):
        kept = scratch.relative(made)
        if kept not in damaged:
            write_atomically(made, (layout.root / kept).read_bytes())


def _remake_summaries(
    layout: Layout, scratch: Layout, plan: Plan, manifest: Manifest, wanted: Mapping[str, str]
) -> None:
    """Tables of clips and the contact sheet, which follow from the manifest and the other files."""
    for path, tables in summarise_clips(plan, manifest["clips"]):
        write_tables(tables, scratch.root / path)
    if SHEET in wanted:
        write_atomically(scratch.root / SHEET, draw_sheet_again(layout, manifest, plan))
