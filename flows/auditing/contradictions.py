"""Does all that a dataset says of itself agree, for every reader? No clip is made again."""

from collections.abc import Collection, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from catalogs.documents import parse_json
from catalogs.sentences import cap_problems, shorten
from flows.auditing.grid_again import find_grid_contradictions
from flows.auditing.stored_frames import compare_frame_metadata, compare_sheet
from flows.auditing.stored_tables import compare_tables
from flows.making.gathering import table_parts
from flows.making.identity import identify_clip, identify_run, list_deciding, narrow_deciding
from flows.making.plan import Plan
from flows.making.seal import SHEET
from flows.making.summaries import SUMMARIES, summarise_clips
from flows.store.arrays import arrays_of
from flows.store.layout import OBJECTS, STAGED_TABLES, Layout, encode_json
from flows.store.links import require_file
from flows.store.parquet_files import refuse_footer
from flows.store.sealed import read_plan_record
from flows.store.telemetry import read_columns, table_columns
from manifests.compare import find_row_difference
from manifests.explain import find_value_differences, format_value
from manifests.manifest import recorded_files
from manifests.records import ClipRecord, Manifest
from tasks.conventions import ESSENTIAL
from tasks.errors import InputError

GRID = "inputs/grid.json"


def find_contradictions(
    layout: Layout, manifest: Manifest, damaged: Collection[str], is_same_writer: bool
) -> tuple[list[str], list[str]]:
    """Hold every record of a dataset, and every file that follows from them, against the others.

    Whoever changes a record and its hash must change all that follows from it: the plan follows from the grid, the ids
    are hashes of what decides the bytes, the files are those of the plan, the tables of clips and pairs repeat the
    records of the clips, and every file but the pictures has the bytes that our writer makes of its values.

    Parameters
    ----------
    layout, manifest : of a sealed dataset
    damaged : paths that are known not to be as recorded, and so are not read
    is_same_writer : whether code and libraries are those that wrote the dataset: then every byte counts

    Returns
    -------
    A sentence for each contradiction, and the paths of files in whose values there is none but whose bytes another
    writer made otherwise, so that the bytes are not compared.
    """
    plan = Plan.of(manifest, layout.manifest)
    found = [
        [] if "plan.json" in damaged else list(_compare_plan(layout, manifest)),
        find_grid_contradictions(plan, is_same_writer),
        list(_compare_ids(manifest, plan)),
        list(_compare_files(layout, manifest, plan)),
        list(_compare_parts(layout, plan, damaged)),
        list(_compare_summaries(layout, manifest, plan, damaged)),
    ]
    named = {sentence.partition(": ")[0] for kind in found for sentence in kind}
    known = {*damaged, *named}
    others: list[str] = []
    for path, lies in chain(
        _compare_json(layout, manifest, plan, known),
        compare_tables(layout, manifest, plan, known, is_same_writer),
        compare_frame_metadata(layout, plan, known, is_same_writer),
        compare_sheet(layout, manifest, plan, known),
    ):
        if lies or is_same_writer:
            found.append(
                lies or [f"{path}: must have the bytes that muSync makes of what it shows; it has others"]
            )
        else:
            others.append(path)
    return [sentence for kind in found for sentence in cap_problems(kind)], others


def list_remade(plan: Plan) -> list[str]:
    """Return the paths of the files that `find_contradictions` holds against what our writer makes."""
    names = arrays_of(plan.settings.labels, plan.settings.has_objects) if plan.settings.stores_frames else {}
    return [
        "plan.json",
        GRID,
        *SUMMARIES,
        *chain.from_iterable(table_parts(plan, table) for table in STAGED_TABLES),
        *(f"frames.zarr/{name}zarr.json" for name in (names and ["", *(f"{name}/" for name in names)])),
        *([SHEET] if plan.settings.stores_frames else []),
    ]


def _compare_json(
    layout: Layout, manifest: Manifest, plan: Plan, damaged: Collection[str]
) -> Iterator[tuple[str, list[str]]]:
    settings = encode_json(plan.settings.model_dump(mode="json"))
    for path, wanted in (("plan.json", b"".join(plan.file_pieces())), (GRID, settings)):
        if path in damaged or not (layout.root / path).is_file():
            continue
        try:
            content = require_file(layout.root / path).read_bytes()
            if content != wanted:
                found = parse_json(content, path, "record") if path == GRID else manifest["grid"]
                yield (
                    path,
                    [
                        f"{path}: {field} must be {format_value(a)}, as in manifest.json; it is {format_value(b)}"
                        for field, a, b in find_value_differences(manifest["grid"], found)
                    ],
                )
        except InputError as error:
            yield path, list(error.problems)


def _compare_plan(layout: Layout, manifest: Manifest) -> Iterator[str]:
    try:
        plan: Mapping[str, Any] = read_plan_record(layout)
    except InputError as error:
        yield from error.problems
        return
    recorded: dict[str, Any] = {**manifest, "format": plan["format"]}
    recorded["clips"] = [{name: clip[name] for name in _list_names(ClipRecord)} for clip in manifest["clips"]]  # type: ignore[literal-required]
    for field, a, b in find_value_differences({name: recorded[name] for name in plan}, plan):
        yield f"plan.json: {field} must be {format_value(a)}, as in manifest.json; it is {format_value(b)}"


def _list_names(record: type) -> Collection[str]:
    return record.__annotations__.keys()


def _compare_ids(manifest: Manifest, plan: Plan) -> Iterator[str]:
    deciding = list_deciding(plan.settings, plan.scene, plan.inputs, plan.backend, plan.scenes)
    own = {
        scene: narrow_deciding(deciding, plan.record_of(scene))
        for scene in {clip.scenario.scene for clip in plan.clips}
    }
    for clip in plan.clips:
        if (
            wanted := identify_clip(own[clip.scenario.scene], clip.scenario.as_record(), clip.seed)
        ) != clip.clip_id:
            yield (
                f"manifest.json: the id of clip {clip.label} must be {wanted}, the hash of its inputs, scenario and"
                f" seed; it is {clip.clip_id}"
            )
    ids = (clip.clip_id for clip in plan.clips)
    # the grid as it is recorded: settings that later versions know are no part of an older run's id
    wanted = identify_run(deciding, manifest["grid"], ids, manifest["made_with"])
    if wanted != plan.run_id:
        yield f"manifest.json: run_id must be {wanted}, the hash of its plan; it is {plan.run_id}"


def _compare_files(layout: Layout, manifest: Manifest, plan: Plan) -> Iterator[str]:
    """Yield the files that are recorded and not planned, or planned and not recorded, or recorded of another clip."""
    arrays = arrays_of(plan.settings.labels, plan.settings.has_objects) if plan.settings.stores_frames else {}
    planned: dict[str, str | None] = dict.fromkeys(
        [*list_remade(plan), *(f"inputs/{name}" for name in plan.inputs)]
    )
    for made in plan.clips:
        planned |= {layout.relative(layout.frame_shard(name, made.index)): made.clip_id for name in arrays}
        if plan.settings.has_objects:
            planned[layout.relative(layout.object_table(made.index))] = made.clip_id
    recorded = {path: clip_id for path, (_, clip_id) in recorded_files(manifest).items()}
    for path in sorted(recorded.keys() ^ planned.keys()):
        is_recorded = path in recorded
        yield (
            f"manifest.json: {path} is {'recorded, and' if is_recorded else 'not recorded, but'} a file of"
            + (" no clip of the plan" if is_recorded else " its plan")
        )
    for path in sorted(recorded.keys() & planned.keys()):
        if recorded[path] != planned[path]:
            yield (
                f"manifest.json: {path} must be a file of {_name_owner(planned[path])}; it is recorded as one of"
                f" {_name_owner(recorded[path])}"
            )
    contents = {*STAGED_TABLES, *arrays, *([OBJECTS] if plan.settings.has_objects else [])}
    for clip in manifest["clips"]:
        passed, reasons = clip["verdict"]["passed"], clip["verdict"]["reasons"]
        if (passed is True) == bool(reasons):
            yield (
                f"manifest.json: verdict.passed of clip {clip['label']} must say whether its check gave no reasons; it"
                f" is {passed} with {len(reasons)}"
            )
    for clip in manifest["clips"]:
        for name in sorted(clip["content"].keys() ^ contents):
            yield (
                f"manifest.json: content of clip {clip['label']} must be of {', '.join(sorted(contents))};"
                f" {name} is {'one more' if name in clip['content'] else 'absent'}"
            )


def _name_owner(clip_id: str | None) -> str:
    return "all clips" if clip_id is None else f"clip {clip_id}"


def _compare_parts(layout: Layout, plan: Plan, damaged: Collection[str]) -> Iterator[str]:
    """Yield the tables of ticks and frames that hold other clips than the plan puts there."""
    for table in STAGED_TABLES:
        for path, ids in table_parts(plan, table).items():
            if path in damaged:
                continue
            try:
                found = _list_clips(
                    require_file(layout.root / path), len(ids) * plan.settings.rows_per_clip[table]
                )
            except InputError as error:
                yield from (f"{path}: {problem.partition(': ')[2]}" for problem in error.problems)
                continue
            if found != ids:
                strange = [name for name in found if name not in ids]
                yield (
                    f"{path}: must hold the rows of the {len(ids)} clips that the plan puts there, in order; it holds"
                    f" those of {len(found)}"
                    + (f", {format_value(strange[0])} among them" if strange else "")
                )


def _list_clips(path: Path, most: int) -> list[str]:
    """The ids in a table of at most so many rows, in the order of their first rows."""
    refuse_footer(path, most)
    try:
        table = pq.ParquetFile(path).read(["clip_id"])
        names: list[str] = table["clip_id"].unique().to_pylist()
    except (pa.ArrowException, OSError, ValueError, KeyError) as error:
        raise InputError(f"{path}: must be a table with the column clip_id; {shorten(error)}") from None
    return names


def _compare_summaries(
    layout: Layout, manifest: Manifest, plan: Plan, damaged: Collection[str]
) -> Iterator[str]:
    for path, tables in summarise_clips(plan, manifest["clips"]):
        wanted = table_columns(pa.concat_tables(tables))
        if path in damaged:
            continue
        try:
            rows = len(next(iter(wanted.values())))
            found = read_columns(require_file(layout.root / path), most=rows, exact=False)
        except InputError as error:
            yield from (f"{path}: {problem.partition(': ')[2]}" for problem in error.problems)
            continue
        # the table of an older dataset decides which columns it has
        wanted = {name: values for name, values in wanted.items() if name in found or name in ESSENTIAL}
        row = find_row_difference(found, wanted, list(dict.fromkeys([*wanted, *found])))
        if row is not None:
            yield (
                f"{path}: {row['channel']} in row {row['tick']} must be {format_value(row['remade'])}, as the records"
                f" of the clips say; it is {format_value(row['recorded'])}"
            )
