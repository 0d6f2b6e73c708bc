"""A flipped bit is found and named, what is broken is made again byte for byte, left-overs go."""

import json
import os
import random
import shutil

import pytest

from flows.auditing.repair import repair_dataset
from flows.auditing.verify import collect_garbage, verify_dataset
from flows.store.frames import read_clip, write_clip
from flows.store.layout import PARTIAL, Layout
from flows.store.lock import sole_writer
from manifests.canonical import canonical_bytes
from manifests.manifest import recorded_files
from tasks.errors import InputError
from tests.flows.reseal import reseal


@pytest.fixture
def copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


def files_of(layout: Layout) -> dict[str, bytes]:
    return {layout.relative(p): p.read_bytes() for p in layout.root.rglob("*") if p.is_file()}


def flip(layout: Layout, path: str, bit: int) -> None:
    content = bytearray((layout.root / path).read_bytes())
    content[bit // 8 % len(content)] ^= 1 << bit % 8
    (layout.root / path).write_bytes(content)


def test_a_sound_dataset_verifies(toy_dataset):
    result = verify_dataset(str(toy_dataset.root))
    assert result["verified"] and result["damaged"] == [] and result["unrecorded"] == []
    assert result["files"] == len(files_of(toy_dataset))


def test_a_flipped_bit_of_every_file_is_found_and_the_file_named(copy):
    """The manifest's too; the bit is drawn by a seed."""
    draw = random.Random(6)
    for path in sorted(files_of(copy)):
        original = (copy.root / path).read_bytes()
        flip(copy, path, draw.randrange(8 * len(original)))
        try:
            result = verify_dataset(str(copy.root))
        finally:
            (copy.root / path).write_bytes(original)
        assert not result["verified"] and [row["path"] for row in result["damaged"]] == [path]


def test_a_dataset_that_was_compressed_otherwise_is_repaired_in_its_own_compression(copy):
    """As earlier versions did: Blosc's own blocks."""
    pixels = read_clip(copy.frames, 0, "class")
    path = copy.frames / "class" / "zarr.json"
    metadata = json.loads(path.read_text())
    metadata["codecs"][0]["configuration"]["codecs"][1]["configuration"] |= {"blocksize": 0, "clevel": 3}
    path.write_text(json.dumps(metadata))
    before = copy.frame_shard("class", 0).read_bytes()
    write_clip(copy.frames, 0, {"class": pixels})
    group = json.loads((copy.frames / "zarr.json").read_text())
    group["consolidated_metadata"]["metadata"]["class"] = metadata
    (copy.frames / "zarr.json").write_text(json.dumps(group))
    reseal(copy)
    kept = copy.frame_shard("class", 0).read_bytes()
    assert kept != before
    copy.frame_shard("class", 0).unlink()
    assert repair_dataset(str(copy.root), runner="threads", workers=1)["repaired"]
    assert copy.frame_shard("class", 0).read_bytes() == kept


def test_a_manifest_that_was_written_anew_with_other_figures_does_not_verify(copy):
    forged = json.loads(copy.manifest.read_bytes())
    forged["clips"][0]["figures"]["peak_pitch"] = 0.1
    copy.manifest.write_bytes(canonical_bytes(forged))
    assert verify_dataset(str(copy.root))["damaged"][0]["path"] == "manifest.json"
    with pytest.raises(InputError, match="put back a copy of the manifest"):
        repair_dataset(str(copy.root))


def test_a_file_among_the_data_that_nobody_recorded_is_damage(copy):
    (copy.telemetry / "ticks" / "family=dry" / "part-0009.parquet").write_bytes(b"PAR1")
    (copy.root / "notes.txt").write_text("mine")
    result = verify_dataset(str(copy.root))
    assert [row["damage"] for row in result["damaged"]] == ["not recorded"]
    assert len(result["unrecorded"]) == 2
    repaired = repair_dataset(str(copy.root))
    (told,) = repaired["left_to_do"]
    assert not repaired["repaired"] and told.startswith(
        f"{copy.root}/telemetry/ticks/family=dry/part-0009.parquet: "
    )
    assert (
        told.endswith("remove it")
        and (copy.telemetry / "ticks" / "family=dry" / "part-0009.parquet").exists()
    )


def test_a_folder_that_is_no_dataset_is_told_before_it_is_walked(tmp_path, monkeypatch):
    monkeypatch.setattr("flows.auditing.verify.foreign_entries", lambda root: pytest.fail("walked"))
    with pytest.raises(InputError, match=r"must be a finished dataset; it has no manifest\.json"):
        verify_dataset(str(tmp_path))


def test_everything_but_the_manifest_is_made_again_with_equal_bytes(toy_dataset, copy):
    for path in recorded_files(json.loads(copy.manifest.read_bytes())):
        (copy.root / path).unlink()
    result = repair_dataset(str(copy.root), runner="threads", workers=1)
    assert result["repaired"] and result["failed"] == []
    assert files_of(copy) == files_of(toy_dataset)


@pytest.mark.parametrize(
    "path",
    [
        "frames.zarr/rgb/c/2/0/0/0/0", "telemetry/frames/family=snow/part-0000.parquet", "telemetry/clips.parquet",
        "inputs/vehicle.yaml",
    ],
)  # fmt: skip
def test_one_broken_file_is_repaired_and_no_other_is_touched(toy_dataset, copy, path):
    before = {name: (copy.root / name).stat().st_mtime_ns for name in files_of(copy)}
    flip(copy, path, 4001)
    assert repair_dataset(str(copy.root), runner="threads", workers=1)["restored"] == [path]
    assert files_of(copy) == files_of(toy_dataset)
    changed = [name for name, when in before.items() if (copy.root / name).stat().st_mtime_ns != when]
    assert changed == [path]


def test_bytes_that_come_out_otherwise_are_not_put_in_place(copy):
    """A file recorded with a hash that no run gives stays as it is and is named."""
    from manifests.manifest import seal_of

    forged = json.loads(copy.manifest.read_bytes())
    forged["artifacts"]["telemetry/clips.parquet"] = "0" * 64
    copy.manifest.write_bytes(canonical_bytes(forged | {"seal": seal_of(forged)}))
    before = (copy.telemetry / "clips.parquet").read_bytes()
    result = repair_dataset(str(copy.root), runner="threads", workers=1)
    assert not result["repaired"] and result["failed"] == ["telemetry/clips.parquet"]
    assert (copy.telemetry / "clips.parquet").read_bytes() == before


def test_left_overs_of_killed_runs_go_and_nothing_else(toy_dataset, copy, tmp_path):
    (copy.telemetry / f"clips.parquet.77{PARTIAL}").write_bytes(b"half")
    for name in ("dead", "live"):
        (copy.staging / f"scratch-{name}" / ".staging").mkdir(parents=True)
        (copy.staging / f"scratch-{name}" / ".staging" / "lock").touch()
    # killed, or just about to make its lock
    begun = [copy.staging / f"scratch-{maker}-abc" for maker in (2**22 + 1, os.getpid())]
    for folder in begun:
        folder.mkdir()
    (copy.staging / f"{'0' * 16}.json").write_text("{}")
    mine = [
        copy.staging / "notes.txt", copy.root / "thesis.partial.tex", tmp_path / ".audit-2025" / ".staging" / "lock"
    ]  # fmt: skip
    for path in mine:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    with sole_writer(Layout(copy.staging / "scratch-live")):
        named = collect_garbage(str(copy.root), dry_run=True)["removed"]
        assert (copy.staging / f"{'0' * 16}.json").exists()
        assert collect_garbage(str(copy.root))["removed"] == named
        assert len(named) == 4
        assert [folder.exists() for folder in begun] == [False, True]
        assert (copy.staging / "scratch-live").exists()
    assert not (copy.staging / "scratch-dead").exists()
    assert all(path.exists() for path in mine)


def test_of_a_collected_dataset_no_staging_folder_stays(toy_dataset, copy):
    copy.staging.mkdir()
    (copy.staging / f"{'0' * 16}.ticks.parquet").touch()
    assert len(collect_garbage(str(copy.root))["removed"]) == 1
    assert files_of(copy) == files_of(toy_dataset) and not copy.staging.exists()


def test_a_dataset_that_is_being_written_is_left_alone(copy):
    with sole_writer(copy), pytest.raises(InputError, match="another run is writing"):
        collect_garbage(str(copy.root))
