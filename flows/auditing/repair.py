"""Making again what is broken or missing in a finished dataset, byte for byte, or saying why that cannot be."""

import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from flows.auditing.verify import compare_files
from flows.making.generate import create_frame_arrays, fan_out
from flows.making.input_changes import recorded_input
from flows.making.plan import Plan, input_sources, read_plan
from flows.making.seal import clips_table, pairs_table, preview_sheet, table_parts, write_part
from flows.running.orchestration import stage
from flows.running.runner import RunnerName
from flows.store.address import everything, publish, working
from flows.store.layout import STAGED_TABLES, Layout, read_json, write_atomically, write_json
from flows.store.lock import sole_writer
from flows.store.telemetry import write_parquet
from manifests.canonical import sha256_of_file
from manifests.explain import as_sentences, tool_differences, tools_here
from manifests.manifest import recorded_files
from tasks.errors import InputError

SUMMARIES = {"telemetry/clips.parquet": clips_table, "telemetry/pairs.parquet": pairs_table}
"""Tables that follow from the clips' records."""
WHOLE_NUMBERS = {"index", "failed_frames"}
"""Keys of a clip's record that are integers; canonical JSON writes a float 0.0 as 0 too."""


def repair(
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
    came out otherwise, and the ``differences`` of the tools that can be why.

    Raises
    ------
    InputError
        The manifest itself is damaged, or inputs that clips follow from cannot be found any more.
    """
    with working(dataset, everything) as layout:
        result = _repaired(layout, runner, workers, scheduler)
    if out is not None:
        write_json(Path(out) / "repair.json", result)
    return result


def _repaired(
    layout: Layout, runner: RunnerName, workers: int | None, scheduler: str | None
) -> dict[str, Any]:
    found = stage(compare_files)(layout)
    if any(row["path"] == "manifest.json" for row in found["damaged"]):
        raise InputError(
            f"{layout}/manifest.json: {found['damaged'][0]['damage']}, so nothing says what the other files should be:"
            " put back a copy of the manifest, or generate the grid again into another folder"
        )
    manifest = read_json(layout.manifest)
    paths = [row["path"] for row in found["damaged"] if row["damage"] != "not recorded"]
    with sole_writer(layout):
        restored = stage(restore)(layout, manifest, paths, runner, workers, scheduler) if paths else []
        publish(layout, [layout.root / path for path in restored])
        shutil.rmtree(layout.staging)
    return {
        "repaired": stage(compare_files)(layout)["verified"],
        "damaged": found["damaged"],
        "restored": restored,
        "failed": sorted(set(paths) - set(restored)),
        "differences": as_sentences(tool_differences(manifest, tools_here())),
    }


def restore(
    layout: Layout,
    manifest: Mapping[str, Any],
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

    with tempfile.TemporaryDirectory(prefix=".repair-", dir=layout.root.parent) as folder:
        scratch = Layout(Path(folder))
        with sole_writer(scratch):
            plan = _prepare(layout, scratch, manifest)
            move_in(scratch, [path for path in paths if (scratch.root / path).is_file()])
            parts = {table: table_parts(plan, table) for table in STAGED_TABLES}
            broken = [(t, path, ids) for t in parts for path, ids in parts[t].items() if path in wanted]
            again = {clip_id for _, _, ids in broken for clip_id in ids}
            again |= {
                clip["clip_id"] for clip in manifest["clips"] if wanted.keys() & clip["artifacts"].keys()
            }
            indices = [clip.index for clip in plan.clips if clip.clip_id in again]
            if indices:
                fan_out(scratch, plan, indices, runner, workers, scheduler)
            move_in(scratch, [path for clip in manifest["clips"] for path in clip["artifacts"]])
            for table, path, ids in broken:
                write_part(scratch, table, path, ids)
            move_in(scratch, [path for _, path, _ in broken])
            _remake_summaries(layout, scratch, plan, manifest, wanted)
            move_in(scratch, [*SUMMARIES, "previews/contact_sheet.png"])
    return sorted(restored)


def _prepare(layout: Layout, scratch: Layout, manifest: Mapping[str, Any]) -> Plan:
    """Plan, inputs and empty arrays in the scratch folder, from the dataset, the manifest or the catalogue."""
    plan = plan_of(manifest)
    write_json(scratch.plan, plan.as_json())
    write_json(scratch.inputs / "grid.json", plan.settings.model_dump(mode="json"))
    sources = input_sources(plan.settings)
    problems = []
    for name, digest in manifest["inputs"].items():
        source = recorded_input(layout, sources, name, digest)
        if source is None:
            problems.append(
                f"{layout.inputs / name}: damaged, and the catalogue here has no entry with its bytes"
                f" (SHA-256 {digest[:12]}...): put the file back and repair again"
            )
            continue
        (scratch.inputs / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, scratch.inputs / name)
    if problems:
        raise InputError(problems)
    create_frame_arrays(scratch, plan)
    return read_plan(scratch.root)


def plan_of(manifest: Mapping[str, Any]) -> Plan:
    """The plan that a manifest was frozen from."""
    return Plan.of({**manifest, "clips": [_as_written(clip) for clip in manifest["clips"]]})


def _remake_summaries(
    layout: Layout, scratch: Layout, plan: Plan, manifest: Mapping[str, Any], wanted: Mapping[str, str]
) -> None:
    """Tables of clips and the contact sheet, which follow from the manifest and the other files."""
    receipts = [_as_written(clip) for clip in manifest["clips"]]
    for path, table_of in SUMMARIES.items():
        write_parquet(table_of(receipts), scratch.root / path)
    if "previews/contact_sheet.png" in wanted:
        for path, ids in table_parts(plan, "frames").items():
            for clip_id in ids:
                rows = pq.read_table(layout.root / path, filters=[("clip_id", "==", clip_id)])
                write_parquet(rows, scratch.staged(clip_id, "frames"))
        write_atomically(
            scratch.previews / "contact_sheet.png", preview_sheet(scratch, layout.frames, plan, receipts)
        )


def _as_written(value: Any, key: str = "") -> Any:
    """A clip's record with the floats that canonical JSON shortens to integers."""
    if isinstance(value, dict):
        return {name: _as_written(entry, name) for name, entry in value.items()}
    if isinstance(value, int) and not isinstance(value, bool) and key not in WHOLE_NUMBERS:
        return float(value)
    return value
