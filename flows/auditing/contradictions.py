"""Does a manifest agree with its plan, its ids, and the tables that follow from its records? No clip is made again."""

from collections.abc import Collection, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from catalogs.sentences import shorten
from flows.making.gathering import table_parts
from flows.making.identity import identify_clip, identify_run, list_deciding
from flows.making.plan import Plan
from flows.making.summaries import SUMMARIES, summarise_clips
from flows.store.arrays import arrays_of
from flows.store.layout import STAGED_TABLES, Layout
from flows.store.links import require_file
from flows.store.sealed import read_plan_record
from flows.store.telemetry import read_columns, table_columns
from manifests.compare import find_row_difference
from manifests.explain import find_value_differences, format_value
from manifests.manifest import recorded_files
from manifests.records import ClipRecord, Manifest
from tasks.conventions import ESSENTIAL
from tasks.errors import InputError

SHOWN = 8
"""Sentences about one kind of contradiction."""


def find_contradictions(layout: Layout, manifest: Manifest, damaged: Collection[str]) -> list[str]:
    """Return a sentence for each record of a dataset that another record does not agree with.

    Whoever changes a record and its hash must change all that follows from it: the plan says the same of each clip, the
    ids are hashes of what decides the bytes, the files are those of the plan, and the tables of clips and pairs repeat
    the records of the clips.

    Parameters
    ----------
    layout, manifest : of a sealed dataset
    damaged : paths that are known not to be as recorded, and so are not read
    """
    plan = Plan.of(manifest, layout.manifest)
    found = [
        [] if "plan.json" in damaged else list(_compare_plan(layout, manifest)),
        list(_compare_ids(manifest, plan)),
        list(_compare_files(layout, manifest, plan)),
        list(_compare_parts(layout, plan, damaged)),
        list(_compare_summaries(layout, manifest, plan, damaged)),
    ]
    return [
        sentence
        for kind in found
        for sentence in [*kind[:SHOWN], *([f"and {len(kind) - SHOWN} more"] if len(kind) > SHOWN else [])]
    ]


def _compare_plan(layout: Layout, manifest: Manifest) -> Iterator[str]:
    try:
        plan: Mapping[str, Any] = read_plan_record(layout)
    except InputError as error:
        yield from error.problems
        return
    recorded: dict[str, Any] = {**manifest, "format": plan["format"]}
    recorded["clips"] = [{name: clip[name] for name in _list_names(ClipRecord)} for clip in manifest["clips"]]  # type: ignore[literal-required]
    for place, a, b in find_value_differences({name: recorded[name] for name in plan}, plan):
        yield f"plan.json: {place} must be {format_value(a)}, as in manifest.json; it is {format_value(b)}"


def _list_names(record: type) -> Collection[str]:
    return record.__annotations__.keys()


def _compare_ids(manifest: Manifest, plan: Plan) -> Iterator[str]:
    deciding = list_deciding(plan.settings, plan.scene, plan.inputs, plan.backend)
    for clip in plan.clips:
        if (wanted := identify_clip(deciding, clip.scenario.as_row(), clip.seed)) != clip.clip_id:
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
    """Yield the files of data that are recorded and not planned, or planned and not recorded."""
    arrays = arrays_of(plan.settings.labels) if plan.settings.pictures else {}
    planned = {
        *SUMMARIES,
        *chain.from_iterable(table_parts(plan, table) for table in STAGED_TABLES),
        *(layout.relative(layout.frame_shard(name, clip.index)) for name in arrays for clip in plan.clips),
        *(layout.relative(layout.frames / name / "zarr.json") for name in (arrays and ["", *arrays])),
    }
    recorded = {path for path in recorded_files(manifest) if path.startswith(("telemetry/", "frames.zarr/"))}
    for path in sorted(recorded ^ planned):
        is_recorded = path in recorded
        yield (
            f"manifest.json: {path} is {'recorded, and' if is_recorded else 'not recorded, but'} a file of"
            + (" no clip of the plan" if is_recorded else " its plan")
        )


def _compare_parts(layout: Layout, plan: Plan, damaged: Collection[str]) -> Iterator[str]:
    """Yield the tables of ticks and frames that hold other clips than the plan puts there."""
    for table in STAGED_TABLES:
        for path, ids in table_parts(plan, table).items():
            if path in damaged:
                continue
            try:
                found = _list_clips(require_file(layout.root / path))
            except InputError as error:
                yield from error.problems
                continue
            if found != ids:
                strange = [name for name in found if name not in ids]
                yield (
                    f"{path}: must hold the rows of the {len(ids)} clips that the plan puts there, in order; it holds"
                    f" those of {len(found)}"
                    + (f", {format_value(strange[0])} among them" if strange else "")
                )


def _list_clips(path: Path) -> list[str]:
    """The ids in a table in the order of their first rows."""
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
            found = read_columns(require_file(layout.root / path))
        except InputError as error:
            yield from error.problems
            continue
        # the table of an older dataset decides which columns it has
        wanted = {name: values for name, values in wanted.items() if name in found or name in ESSENTIAL}
        row = find_row_difference(found, wanted, list(dict.fromkeys([*wanted, *found])))
        if row is not None:
            yield (
                f"{path}: {row['channel']} in row {row['tick']} must be {format_value(row['remade'])}, as the records"
                f" of the clips say; it is {format_value(row['recorded'])}"
            )
