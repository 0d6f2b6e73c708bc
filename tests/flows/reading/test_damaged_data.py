"""Damage to a finished dataset is told where it is read, and never becomes black pictures or other numbers."""

import json
import shutil
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

import musync
from flows.auditing.explain import explain_frame
from flows.exporting.export import export_dataset
from flows.reading.describe import describe_dataset
from flows.reading.previews import make_films
from flows.reading.report import make_report
from flows.store.layout import Layout
from flows.store.telemetry import read_table
from studies.evaluation.evaluation import evaluate_dataset
from studies.negative_controls.study import run_controls
from studies.paper.sheets import draw_sheets
from studies.physics_judge.audit_physics import audit_physics
from tasks.errors import InputError


@pytest.fixture
def dataset_copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


READ_PICTURES = {
    "a picture": lambda root: musync.open(root)["dry/flat"].picture(3),
    "the arrays": lambda root: musync.open(root).frames,
    "a window": lambda root: musync.open(root).torch(window=4, clips="dry/flat")[0],
    "an export": lambda root: export_dataset(
        str(root), "webdataset", out=str(root.with_name("out")), clips=["dry/flat"]
    ),
}


@pytest.mark.parametrize("reader", READ_PICTURES)
def test_a_clip_whose_pictures_are_missing_is_no_black_clip(dataset_copy, reader):
    READ_PICTURES[reader](dataset_copy.root)
    shutil.rmtree(dataset_copy.root.with_name("out"), ignore_errors=True)
    dataset_copy.frame_shard("rgb", 0).unlink()
    with pytest.raises(InputError, match=r"missing.* musync lab repair makes it again"):
        READ_PICTURES[reader](dataset_copy.root)


def flip_a_number(path: Path) -> None:
    """Change a bit of the values of ``speed``: what is compressed unpacks all the same."""
    file = pq.ParquetFile(path)
    place = file.schema_arrow.names.index("speed")
    chunk = file.metadata.row_group(0).column(place)
    content = bytearray(path.read_bytes())
    content[chunk.data_page_offset + chunk.total_compressed_size // 2] ^= 1
    path.write_bytes(content)


READ_TABLES = {
    "of muSync": lambda root, path: read_table(path, most=100),
    "of pyarrow": lambda root, path: musync.open(root).telemetry("frames").to_table(),
    "of torch": lambda root, path: musync.open(root).torch(
        window=4, columns="speed", arrays=[], quarantined=True
    ),
}


@pytest.mark.parametrize("reader", READ_TABLES)
def test_a_flipped_bit_in_a_table_is_an_error_and_not_a_number(dataset_copy, reader):
    path = dataset_copy.telemetry / "frames" / "family=dry" / "part-0000.parquet"
    READ_TABLES[reader](dataset_copy.root, path)
    flip_a_number(path)
    with pytest.raises((InputError, OSError), match=r"checksum|CRC"):
        READ_TABLES[reader](dataset_copy.root, path)


@pytest.mark.parametrize(
    "read", [describe_dataset, lambda root: musync.open(root), lambda root: export_dataset(root, "tum")]
)
def test_a_manifest_that_was_edited_by_hand_is_not_believed(dataset_copy, read):
    manifest = json.loads(dataset_copy.manifest.read_bytes())
    manifest["grid"]["frame_rate_hz"] = 20
    dataset_copy.manifest.write_text(json.dumps(manifest))
    with pytest.raises(InputError, match=r"manifest\.json: must be as it was sealed"):
        read(str(dataset_copy.root))


USE_INPUTS = {
    "evaluate": lambda root: evaluate_dataset(root, out=f"{root}-out"),
    "audit-physics": lambda root: audit_physics(root),
    "explain": lambda root: explain_frame(root, "dry/flat", 3),
    "export": lambda root: export_dataset(root, "tum", out=f"{root}-out", clips=["dry/flat"]),
    "report": lambda root: make_report(root, out=f"{root}-out"),
}


@pytest.mark.parametrize("command", USE_INPUTS)
@pytest.mark.parametrize("name", ["inputs/camera.yaml", "plan.json"])
def test_a_camera_or_a_rate_that_was_edited_by_hand_is_not_believed(dataset_copy, command, name):
    path = dataset_copy.root / name
    path.write_text(path.read_text().replace("value: 80", "value: 160").replace('_hz": 10', '_hz": 20'))
    with pytest.raises(InputError, match=f"{name}: must be as recorded"):
        USE_INPUTS[command](str(dataset_copy.root))


def test_a_clip_that_lost_rows_is_not_read_as_a_shorter_one(dataset_copy):
    path = dataset_copy.telemetry / "frames" / "family=dry" / "part-0000.parquet"
    rows = pq.read_table(path)
    whole = sum(label == "dry/flat" for label in rows["label"].to_pylist())
    pq.write_table(rows.slice(3), path)
    with pytest.raises(
        InputError, match=f"must hold {whole} rows of clip .*; it holds {whole - 3}: musync lab repair"
    ):
        explain_frame(str(dataset_copy.root), "dry/flat", 3)


def test_a_table_of_clips_that_lost_rows_is_not_judged_as_if_it_were_whole(dataset_copy):
    path = dataset_copy.telemetry / "clips.parquet"
    pq.write_table(pq.read_table(path).slice(0, 2), path)
    with pytest.raises(InputError, match="a row of each of the manifest's 4 clips"):
        audit_physics(str(dataset_copy.root))


SHOW_CLIPS = {
    "preview": ("frames", lambda root: make_films(root, f"{root}-out", clips=["dry/flat"])),
    "report": ("ticks", lambda root: make_report(root, out=f"{root}-out", clips=["dry/flat"])),
    "sheets": ("frames", lambda root: draw_sheets(root, f"{root}-out")),
    "evaluate": ("frames", lambda root: evaluate_dataset(root, out=f"{root}-out")),
    "controls": ("frames", lambda root: run_controls(root, out=f"{root}-out")),
    "export": ("frames", lambda root: export_dataset(root, "tum", out=f"{root}-out", clips=["dry/flat"])),
}


@pytest.mark.parametrize("command", SHOW_CLIPS)
def test_a_speed_or_a_picture_that_was_edited_by_hand_is_not_shown(dataset_copy, command):
    table, show = SHOW_CLIPS[command]
    path = dataset_copy.telemetry / table / "family=dry" / "part-0000.parquet"
    rows = pq.read_table(path)
    place = rows.schema.get_field_index("speed")
    pq.write_table(rows.set_column(place, rows.field(place), pc.multiply(rows["speed"], 2.0)), path)
    shard = dataset_copy.frame_shard("rgb", 0)
    shard.write_bytes(shard.read_bytes()[::-1])
    with pytest.raises(InputError) as told:
        show(str(dataset_copy.root))
    for edited in (path, shard):
        line = (
            f"{edited.relative_to(dataset_copy.root)}: must be as recorded; it is changed: musync lab repair"
        )
        assert line in str(told.value)
