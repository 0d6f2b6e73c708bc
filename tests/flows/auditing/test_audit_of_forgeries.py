"""Whoever changes a dataset and seals it again is found out: no stored value and no record is taken on trust."""

import json
import shutil
from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flows.auditing.audit import audit_dataset, draw_clips
from flows.auditing.verify import verify_dataset
from flows.making.plan import Plan
from flows.making.summaries import summarise_clips
from flows.store.layout import Layout, write_json
from flows.store.sealed import read_manifest
from flows.store.telemetry import write_parquet, write_tables
from tests.flows.reseal import reseal

Forge = Callable[[dict[str, Any]], object]


@pytest.fixture
def copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


def audited(layout: Layout, share: float) -> dict[str, Any]:
    """An audit that makes the first clip again, or with share 0 none; the files are those that the forger recorded."""
    assert verify_dataset(str(layout.root))["verified"]
    manifest = json.loads(layout.manifest.read_bytes())
    seed = next(seed for seed in count() if draw_clips(manifest, 0.25, seed)[0]["index"] == 0)
    result = audit_dataset(str(layout.root), share=share, seed=seed, runner="threads", workers=1)
    assert result["damaged"] == result["not_remade"] == [] and result["verdict"].startswith(
        "Not verified: all"
    )
    assert not result["verified"]
    return result


def scale_column(layout: Layout, path: str, name: str) -> None:
    table = pq.read_table(layout.root / path, partitioning=None)
    place = table.column_names.index(name)
    scaled = pa.array(np.asarray(table[name]) * 2)
    write_parquet(table.set_column(place, table.schema.field(name), scaled), layout.root / path)


def change_both(layout: Layout, change: Forge) -> None:
    """Change plan and manifest alike."""
    plan = json.loads(layout.plan.read_text())
    change(plan)
    write_json(layout.plan, plan)
    reseal(layout, change)


def write_summaries(layout: Layout) -> None:
    """Make the tables of clips and pairs agree with the forged records of the clips."""
    manifest = read_manifest(layout)
    plan = Plan.of(manifest, layout.manifest)
    for path, tables in summarise_clips(plan, manifest["clips"]):
        write_tables(tables, layout.root / path)
    reseal(layout)


@pytest.mark.parametrize(("table", "stage"), [("ticks", "vehicle"), ("frames", "frames")])
def test_a_stored_table_that_was_changed(copy, table, stage):
    scale_column(copy, f"telemetry/{table}/family=dry/part-0000.parquet", "speed")
    reseal(copy)
    (row,) = audited(copy, 0.25)["mismatches"]
    assert (row["stage"], row["channel"], row["tick"], row["changed"]) == (stage, "speed", 0, [table])
    assert row["recorded"] == 2 * row["remade"]


def test_pictures_of_two_clips_exchanged(copy):
    first, other = (copy.frame_shard("rgb", index) for index in (0, 2))
    content = first.read_bytes(), other.read_bytes()
    first.write_bytes(content[1])
    other.write_bytes(content[0])
    reseal(copy)
    (row,) = audited(copy, 0.25)["mismatches"]
    assert (row["stage"], row["channel"], row["changed"]) == ("render", "rgb", ["rgb"])


def test_a_shard_with_more_than_its_pixels(copy):
    shard = copy.frame_shard("rgb", 0)
    content, index = shard.read_bytes(), 16 * 11 + 4  # two numbers a frame, and a checksum
    shard.write_bytes(content[:-index] + b"more" + content[-index:])
    reseal(copy)
    (row,) = audited(copy, 0.25)["mismatches"]
    assert (
        row["changed"] == ["rgb"]
        and "its pixels are those made again and its bytes are not" in row["problem"]
    )


@pytest.mark.parametrize(
    ("record", "key", "value", "contradicted"),
    [
        ("figures", "tyre_peak", 0.5, {"telemetry/frames/family=dry/part-0000.parquet"}),
        ("figures", "calibration_extrapolated", True, set()),
        ("verdict", "passed", True, {"manifest.json"}),
    ],
)
def test_a_figure_and_a_verdict_with_the_tables_that_follow_from_them(copy, record, key, value, contradicted):
    def forge(manifest: dict[str, Any]) -> None:
        before = manifest["clips"][0][record][key]
        manifest["clips"][0][record][key] = (not before) if isinstance(before, bool) else value

    reseal(copy, forge)
    write_summaries(copy)
    result = audited(copy, 0.25)
    assert [row["channel"] for row in result["mismatches"]] == [f"{record}.{key}"]
    assert {sentence.partition(": ")[0] for sentence in result["contradictions"]} == contradicted


def test_a_table_that_follows_from_the_records_needs_no_clip_made_again(copy):
    scale_column(copy, "telemetry/pairs.parquet", "peak_pitch_change")
    reseal(copy)
    (told,) = audited(copy, 0.0)["contradictions"]
    assert told.startswith("telemetry/pairs.parquet: peak_pitch_change in row 0 must be ")


def test_names_and_figures_of_two_clips_exchanged_in_the_manifest(copy):
    def forge(manifest: dict[str, Any]) -> None:
        first, other = manifest["clips"][0], manifest["clips"][2]
        for key in ("label", "scenario", "verdict", "figures"):
            first[key], other[key] = other[key], first[key]

    reseal(copy, forge)
    told = audited(copy, 0.0)["contradictions"]
    assert "plan.json: clips.0.label must be snow-3/flat, as in manifest.json; it is dry/flat" in told
    assert any(sentence.startswith("manifest.json: the id of clip snow-3/flat must be") for sentence in told)


def test_an_id_of_a_run_by_which_clips_could_be_drawn(copy):
    change_both(copy, lambda record: record.update(run_id="0" * 16))
    (told,) = audited(copy, 0.0)["contradictions"]
    assert told.startswith("manifest.json: run_id must be ") and told.endswith("it is 0000000000000000")


def test_a_truncated_table_is_a_mismatch_and_no_clip_as_recorded(copy):
    path = copy.telemetry / "ticks" / "family=dry" / "part-0000.parquet"
    path.write_bytes(path.read_bytes()[:1000])
    reseal(copy)
    result = audited(copy, 0.25)
    assert [clip["as_recorded"] for clip in result["remade"]] == [False]
    assert "must be a Parquet table as muSync writes it" in result["mismatches"][0]["problem"]
