"""The whole pipeline on a toy street: a few Gaussians, a few frames, every promise of a dataset."""

import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import flows.making.generate
from flows.auditing.audit import audit_dataset
from flows.making.clip import make_clip
from flows.making.freezing import freeze_run
from flows.making.generate import generate_dataset
from flows.reading.describe import describe_dataset
from flows.running.failures import ClipsFailed
from flows.store.frames import read_clip
from flows.store.layout import Layout
from flows.store.telemetry import read_columns
from manifests.canonical import canonical_bytes, sha256_of_file
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.render.labels import MARK_BITS


@pytest.fixture
def grid(toy_dataset) -> str:
    return str(toy_dataset.root.parent / "grid.yaml")


@pytest.fixture
def dataset(toy_dataset) -> Layout:
    return toy_dataset


@pytest.fixture
def copy(dataset, tmp_path) -> Layout:
    shutil.copytree(dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


def manifest_of(layout: Layout) -> dict:
    return json.loads(layout.manifest.read_bytes())


def test_a_dataset_has_telemetry_frames_a_preview_and_a_canonical_manifest(dataset):
    manifest = manifest_of(dataset)
    assert dataset.manifest.read_bytes() == canonical_bytes(manifest)
    assert len(manifest["clips"]) == 4
    assert not dataset.staging.exists()
    assert (dataset.previews / "contact_sheet.png").stat().st_size > 1000
    ticks = pq.read_table(dataset.telemetry / "ticks")
    assert ticks.num_rows == 4 * 1001
    assert {channel.name for channel in TICK_CHANNELS} <= set(ticks.column_names)
    assert pq.read_table(dataset.telemetry / "frames").num_rows == 4 * 11
    assert pq.read_table(dataset.telemetry / "clips.parquet").num_rows == 4


def test_every_file_of_the_dataset_is_in_the_manifest(dataset):
    manifest = manifest_of(dataset)
    recorded = set(manifest["artifacts"]).union(*(clip["artifacts"] for clip in manifest["clips"]))
    present = {dataset.relative(f) for f in dataset.root.rglob("*") if f.is_file()} - {"manifest.json"}
    assert present == recorded


def test_frame_rows_are_the_ticks_they_name(dataset):
    clip = manifest_of(dataset)["clips"][0]
    family = f"family={clip['scenario']['weather']}"
    ticks = read_columns(dataset.telemetry / "ticks" / family, clip["clip_id"], most=10_000, exact=False)
    frames = read_columns(dataset.telemetry / "frames" / family, clip["clip_id"], most=10_000, exact=False)
    for channel in TICK_CHANNELS:
        np.testing.assert_array_equal(frames[channel.name], ticks[channel.name][frames["tick"]])
    np.testing.assert_array_equal(frames["t_ns"], np.arange(11) * 100_000_000)


def test_snow_is_both_seen_and_felt(dataset):
    clips = {clip["label"]: clip for clip in manifest_of(dataset)["clips"]}
    dry, snow = clips["dry/flat"], clips["snow-3/flat"]
    assert snow["figures"]["tyre_peak"] < 0.5 * dry["figures"]["tyre_peak"]
    pictures = [read_clip(dataset.frames, clip["index"], "rgb")[0] for clip in (dry, snow)]
    road = read_clip(dataset.frames, dry["index"], "class")[0] == 1
    assert pictures[1][road].mean() > pictures[0][road].mean() + 30


def test_the_hump_is_both_seen_and_felt(dataset):
    clips = {clip["label"]: clip for clip in manifest_of(dataset)["clips"]}
    flat, hump = (
        read_clip(dataset.frames, clips[f"dry/{road}"]["index"], "depth")[0] for road in ("flat", "hump")
    )
    nearer = np.nan_to_num(flat - hump)
    assert nearer.max() > 0.1, "the hump hides the road behind it"
    assert clips["dry/hump"]["figures"]["peak_pitch"] > np.deg2rad(0.5)


def test_processes_make_the_same_bytes_as_threads(dataset, grid, tmp_path):
    """Dask does so with a worker killed in ``tests/flows/running``, and below Prefect in ``tests/flows/scheduled``."""
    again = generate_dataset(grid, str(tmp_path / "again"), runner="processes", workers=1).layout
    assert again.manifest.read_bytes() == dataset.manifest.read_bytes()
    for path in manifest_of(dataset)["artifacts"]:
        assert sha256_of_file(again.root / path) == sha256_of_file(dataset.root / path), path


def test_a_finished_dataset_is_not_made_again(dataset, grid):
    assert generate_dataset(grid, str(dataset.root), runner="threads").made == 0


def test_labels_come_where_the_grid_asks_for_them_and_an_audit_makes_them_again(grid, tmp_path):
    labelled = tmp_path / "labelled.yaml"
    labelled.write_text(Path(grid).read_text().replace("frames: 11", "frames: 4") + "labels: true\n")
    layout = generate_dataset(str(labelled), str(tmp_path / "data"), runner="threads", workers=2).layout
    hump = next(clip for clip in manifest_of(layout)["clips"] if clip["label"] == "snow-3/hump")
    marks, flow, road = (read_clip(layout.frames, hump["index"], name) for name in ("marks", "flow", "road"))
    on_hump = (marks[0] & MARK_BITS["hazard"]) > 0
    assert 0 < on_hump.mean() < 0.5
    assert (np.abs(road[0][on_hump][:, 0] - 4) < 3.7 / 2 + 0.01).all()
    assert ((marks & MARK_BITS["snow"]) > 0).any() and ((marks & MARK_BITS["particles"]) > 0).any()
    seen = np.isfinite(read_clip(layout.frames, hump["index"], "depth"))
    assert np.isfinite(flow[0][seen[0]]).mean() > 0.99 and np.isnan(flow[-1]).all()
    assert audit_dataset(str(layout.root), share=0.2, runner="threads")["verified"]


def test_a_clip_whose_pose_check_sees_too_little_is_not_in_quarantine_and_says_why(dataset, grid):
    """One second of a toy street is too little for the gates."""
    verdicts = {clip["label"]: clip["verdict"] for clip in manifest_of(dataset)["clips"]}
    assert all(verdict["passed"] is None for verdict in verdicts.values())
    assert all(verdict["reasons"][0].startswith("not judged: ") for verdict in verdicts.values())
    assert generate_dataset(grid, str(dataset.root), runner="threads").quarantined == {}
    columns = ["label", "quarantined", "check_passed"]
    rows = pq.read_table(dataset.telemetry / "clips.parquet", columns=columns).to_pylist()
    assert [(row["quarantined"], row["check_passed"]) for row in rows] == [(False, None)] * len(verdicts)


def broken_on_two(layout: Layout, index: int, scene: str) -> dict:
    if index == 2:
        raise RuntimeError("lightning struck")
    return make_clip(layout, index, scene)


def full_on_two(layout: Layout, index: int, scene: str) -> dict:
    if index == 2:
        raise OSError(28, "No space left on device")
    return make_clip(layout, index, scene)


@pytest.mark.parametrize(
    ("fault", "error", "sentence"),
    [(broken_on_two, ClipsFailed, "lightning struck"), (full_on_two, InputError, "the disk is full")],
)
def test_what_is_made_before_a_failure_is_kept_and_resuming_makes_the_rest(
    dataset, grid, tmp_path, monkeypatch, fault, error, sentence
):
    monkeypatch.setattr(flows.making.generate, "make_clip", fault)
    layout = Layout(tmp_path / "data")
    with pytest.raises(error, match=sentence):
        generate_dataset(grid, str(layout.root), runner="threads", workers=1)
    assert not layout.manifest.exists()
    kept = sorted(path.name for path in layout.staging.glob("*.json"))
    assert len(kept) >= 2
    with pytest.raises(InputError, match=f"{len(kept)} of 4 clips are made"):
        describe_dataset(str(layout.root))
    monkeypatch.undo()
    assert generate_dataset(grid, str(layout.root), runner="threads", workers=1).made == 4 - len(kept)
    assert layout.manifest.read_bytes() == dataset.manifest.read_bytes()


def test_another_grid_does_not_go_into_the_same_folder_and_the_difference_is_named(dataset, grid, tmp_path):
    other = tmp_path / "other.yaml"
    other.write_text(Path(grid).read_text().replace("frames: 11", "frames: 12"))
    before = dataset.manifest.read_bytes()
    with pytest.raises(InputError, match=r"grid\.frames is 11 there and 12 here"):
        generate_dataset(str(other), str(dataset.root), runner="threads")
    assert dataset.manifest.read_bytes() == before


@pytest.mark.parametrize("write", [generate_dataset, lambda grid, out: freeze_run("demo", out=f"{out}.json")])
def test_nothing_is_made_inside_another_dataset(copy, grid, write):
    before = sorted(copy.root.rglob("*"))
    for place in ("more", "inputs/more"):
        with pytest.raises(
            InputError, match=r"more(\.json)?: must lie outside the dataset copy, whose files are all"
        ):
            write(grid, str(copy.root / place))
    assert sorted(copy.root.rglob("*")) == before


def test_a_second_writer_is_told(dataset, grid, tmp_path):
    from flows.store.lock import sole_writer

    layout = Layout(tmp_path / "data")
    with sole_writer(layout), pytest.raises(InputError, match="another run is writing"):
        generate_dataset(grid, str(layout.root), runner="threads")


def test_describe_lists_each_clip_with_its_stop_and_verdict(dataset):
    facts = describe_dataset(str(dataset.root))
    assert [clip["label"] for clip in facts["clips"]] == [
        "dry/flat",
        "dry/hump",
        "snow-3/flat",
        "snow-3/hump",
    ]
    assert all({"stopping_distance", "peak_pitch", "passed"} <= clip.keys() for clip in facts["clips"])


def test_a_faulty_grid_s_missing_entries_are_listed_with_its_other_faults(tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(
        "{name: bad, scene: nowhere, vehicle: tank, colour: red, axes: {w: {a: {precipitation_mm_h: -1}}}}"
    )
    with pytest.raises(InputError) as caught:
        generate_dataset(str(path), str(tmp_path / "data"))
    text = "\n".join(caught.value.problems)
    for fault in ("colour: unknown key", "precipitation_mm_h must not be negative", "tank", "nowhere"):
        assert fault in text
    assert len(caught.value.problems) == 4


def test_faults_of_vehicle_and_runner_are_listed_together(grid, tmp_path):
    with pytest.raises(InputError) as caught:
        generate_dataset(
            grid, str(tmp_path / "data"), vehicle="nope", runner="threads", scheduler="tcp://127.0.0.1:1"
        )
    first, second = caught.value.problems
    assert first.startswith("--scheduler tcp://127.0.0.1:1 belongs to --runner dask") and "nope" in second
