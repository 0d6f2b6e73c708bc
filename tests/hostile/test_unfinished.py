"""Unfinished datasets from a stranger: going on with one reaches no other files and takes no receipt on trust."""

import json
import shutil
from collections.abc import Callable
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flows.store.layout import STAGED_TABLES
from flows.store.telemetry import write_parquet
from tests.hostile.stage import COMMANDS, Stage, endure, listing, refused, unrefused

GOES_ON = ("verify", "gc --dry-run", "generate", "gc")
"""Commands that look at receipts; all others ask for a manifest first."""


@pytest.fixture
def begun(stage) -> Stage:
    """The dataset as a killed run leaves it: three clips made, one to go."""
    layout = stage.dataset
    clips = stage.manifest()["clips"]
    for clip in clips:
        family = f"family={clip['scenario']['weather']}"
        for table in STAGED_TABLES:
            rows = pq.read_table(
                layout.telemetry / table / family / "part-0000.parquet",
                filters=[("clip_id", "==", clip["clip_id"])], partitioning=None,
            )  # fmt: skip
            write_parquet(rows, layout.staged(clip["clip_id"], table))
        layout.receipt(clip["clip_id"]).write_text(json.dumps(clip))
    layout.receipt(clips[3]["clip_id"]).unlink()
    shutil.rmtree(layout.telemetry)
    shutil.rmtree(layout.previews)
    layout.manifest.unlink()
    return stage


def edit_receipt(stage: Stage, change: Callable[[Any], object], number: int = 0) -> None:
    path = stage.dataset.receipt(clip_of(stage, number))
    receipt = json.loads(path.read_text())
    change(receipt)
    path.write_text(json.dumps(receipt))


def clip_of(stage: Stage, number: int) -> str:
    return str(json.loads(stage.dataset.plan.read_text())["clips"][number]["clip_id"])


def staged_link(stage: Stage) -> None:
    path = stage.dataset.staged(clip_of(stage, 0), "ticks")
    path.unlink()
    path.symlink_to(stage.victim / "clips.parquet")


def change_rows(stage: Stage, change: Callable[[pa.Table], pa.Table], table: str = "frames") -> None:
    path = stage.dataset.staged(clip_of(stage, 0), table)
    write_parquet(change(pq.read_table(path)), path)


def change_column(table: pa.Table, name: str, value: Any = None, unit: str = "") -> pa.Table:
    """Give a column one value in every row, or another unit."""
    place = table.schema.get_field_index(name)
    field, column = table.schema.field(place), table[name]
    if unit:
        field = field.with_metadata(field.metadata | {b"units": unit.encode()})
    if value is not None:
        column = pa.array([value] * len(table), field.type)
    return table.set_column(place, field, column)


def lock_link(stage: Stage) -> None:
    lock = stage.dataset.staging / "lock"
    lock.unlink(missing_ok=True)
    lock.symlink_to(stage.victim / "id_rsa")


RECEIPTS: dict[str, Callable[[Stage], object]] = {
    "that names a file outside": lambda s: edit_receipt(
        s, lambda r: r["artifacts"].update({"../../victim/id_rsa": "0" * 64})
    ),
    "of another clip": lambda s: edit_receipt(s, lambda r: r.update(clip_id=clip_of(s, 1))),
    "with an index that is another's": lambda s: edit_receipt(s, lambda r: r.update(index=2)),
    "without files": lambda s: edit_receipt(s, lambda r: r.update(artifacts={})),
    "of another scenario": lambda s: edit_receipt(s, lambda r: r["scenario"].update(initial_speed_km_h=5.0)),
    "of a clip that is not there": lambda s: shutil.rmtree(s.dataset.frames / "rgb" / "c" / "0"),
    "whose rows are a link": staged_link,
    "whose pictures are another clip's": lambda s: shutil.copyfile(
        s.dataset.frame_shard("rgb", 1), s.dataset.frame_shard("rgb", 0)
    ),
    "whose rows are another clip's": lambda s: shutil.copyfile(
        s.dataset.staged(clip_of(s, 1), "ticks"), s.dataset.staged(clip_of(s, 0), "ticks")
    ),
    "whose rows are too many": lambda s: change_rows(s, lambda table: pa.concat_tables([table, table])),
    "whose ticks have another value": lambda s: change_rows(s, lambda t: change_column(t, "speed", 1.0), "ticks"),
    "whose frames have another grip": lambda s: change_rows(s, lambda t: change_column(t, "surface_friction", 0.1)),
    "whose ticks have a column more": lambda s: change_rows(
        s, lambda t: t.append_column("wisdom", pa.array([1.0] * len(t))), "ticks"
    ),
    "beside a lock that is a link": lock_link,
    "beside a shard to be made that is a link": lambda s: (
        s.dataset.frame_shard("rgb", 3).unlink(), s.dataset.frame_shard("rgb", 3).symlink_to(s.victim / "id_rsa")
    ),
    "beside metadata with a codec of pickles": lambda s: (s.dataset.frames / "rgb" / "zarr.json").write_text(
        (s.dataset.frames / "rgb" / "zarr.json").read_text().replace('"bytes"', '"numcodecs.pickle"', 1)
    ),
}  # fmt: skip


@pytest.mark.parametrize("attack", RECEIPTS)
def test_a_receipt(begun, attack):
    labels = [clip["label"] for clip in json.loads(begun.dataset.plan.read_text())["clips"]]
    RECEIPTS[attack](begun)
    outcomes = endure(begun, *GOES_ON)
    assert refused(outcomes["verify"])
    if not refused(outcomes["generate"]):
        assert outcomes["generate"].made == 2, (
            "the clip of the receipt is made again beside the one that lacks"
        )
        assert [clip["label"] for clip in begun.manifest()["clips"]] == labels
        assert not refused(COMMANDS["verify"](begun))


def test_without_a_manifest_no_reader_and_no_repair_begins(begun):
    outcomes = endure(begun, "describe", "sql", "open tables", "audit", "repair", "sign")
    assert unrefused(outcomes) == []


def test_what_a_run_without_a_plan_left_is_cleared_in_the_dataset_alone(stage):
    """`begun` tells a run that inputs and frames are its own: a stranger's may be links to somebody's folders."""
    layout = stage.dataset
    shutil.rmtree(layout.root)
    layout.staging.mkdir(parents=True)
    (layout.staging / "begun").write_text("")
    for name in ("inputs", "frames.zarr"):
        (layout.root / name).symlink_to(stage.victim / "photos")
    endure(stage, "gc", "generate")


def test_a_folder_of_somebody_s_files_is_no_place_for_a_dataset(stage):
    layout = stage.dataset
    shutil.rmtree(layout.root)
    (layout.root / "inputs").mkdir(parents=True)
    (layout.root / "inputs" / "letters.txt").write_text("mine")
    (layout.root / "frames.zarr").write_text("mine")
    before = listing(layout.root)
    endure(stage, "gc", "sign", "repair", "generate")
    assert listing(layout.root) == before
