"""Gathering: the staged tables of a hundred clips become one file of the dataset, on whichever worker is free."""

from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path

from flows.making.plan import Plan
from flows.running.runner import run_unordered
from flows.store.address import fetch_files, find_local, send_files
from flows.store.layout import STAGED_TABLES, Layout
from flows.store.parquet_files import CLIPS_PER_FILE
from flows.store.telemetry import read_parts, write_tables
from manifests.canonical import sha256_of_file


def gather_tables(layout: Layout, plan: Plan, executor: Executor | None) -> dict[str, str]:
    """Gather the staged tables of all clips into the dataset's files; returns the SHA-256 of each by its path."""
    parts = [
        (layout, table, path, clip_ids, plan.settings.rows_per_clip[table])
        for table in STAGED_TABLES
        for path, clip_ids in table_parts(plan, table).items()
    ]
    if executor is None:
        return {part[2]: gather_part(*part) for part in parts}
    return {part[2]: future.result() for part, future in run_unordered(executor, gather_part, parts)}


def gather_part(layout: Layout, table: str, path: str, clip_ids: Sequence[str], rows: int) -> str:
    """Gather the staged tables of some clips into one file, where their store is; returns its SHA-256.

    Parameters
    ----------
    layout : of the dataset, which may lie on another machine
    table : ticks or frames
    path : of the file in the dataset
    clip_ids : whose rows it gets, in this order
    rows : of each clip [1]
    """
    local = find_local(layout)
    fetch_files(local, [local.staged(clip_id, table) for clip_id in clip_ids])
    file = write_part(local, table, path, clip_ids, rows)
    send_files(local, [file])
    return sha256_of_file(file)


def table_parts(plan: Plan, table: str) -> dict[str, list[str]]:
    """The files of one kind of table and the clips in each: one a weather and hundred clips, in plan order."""
    by_weather: dict[str, list[str]] = {}
    for clip in plan.clips:
        by_weather.setdefault(clip.scenario.weather, []).append(clip.clip_id)
    return {
        f"telemetry/{table}/family={weather}/part-{part:04d}.parquet": clip_ids[
            start : start + CLIPS_PER_FILE
        ]
        for weather, clip_ids in by_weather.items()
        for part, start in enumerate(range(0, len(clip_ids), CLIPS_PER_FILE))
    }


def write_part(layout: Layout, table: str, path: str, clip_ids: Sequence[str], rows: int) -> Path:
    """Gather the staged tables of some clips, each of so many ``rows`` [1], into one file of the dataset."""
    parts = read_parts([layout.staged(clip_id, table) for clip_id in clip_ids], rows)
    write_tables(parts, layout.root / path)
    return layout.root / path
