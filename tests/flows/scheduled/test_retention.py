"""Old datasets are removed: only a schedule's own, only finished ones, and none that is in use."""

import json
import shutil

import pytest

from flows.scheduled.retention import remove_oldest
from flows.scheduled.run_record import FORMAT, record_name
from flows.store.layout import Layout
from flows.store.lock import sole_writer

NAMES = [f"toy-2026030{day}T030000Z" for day in range(1, 6)]


@pytest.fixture
def root(toy_dataset, tmp_path):
    """Five datasets with the records that a schedule wrote of them, in a bucket's folder."""
    root = tmp_path / "data" / "nightly"
    run_id = json.loads(toy_dataset.manifest.read_text())["run_id"]
    times = dict.fromkeys(("scheduled", "began", "updated"), "2026-03-01T03:00:00+00:00")
    for name in NAMES:
        (root / name).mkdir(parents=True)
        for file in ("manifest.json", "plan.json"):
            shutil.copy(toy_dataset.root / file, root / name / file)
        (root / record_name(name)).parent.mkdir(exist_ok=True)
        record = {"format": FORMAT, "dataset": name, "grid": "toy", "run_id": run_id, **times}
        (root / record_name(name)).write_text(json.dumps(record))
    return root


def left(root) -> list[str]:
    return sorted(path.name for path in root.iterdir() if path.name != "runs")


def test_the_oldest_beyond_the_number_go_with_their_records(root):
    assert remove_oldest("toy", str(root), 4) == (NAMES[:1], [])
    assert left(root) == NAMES[1:] and not (root / record_name(NAMES[0])).exists()
    assert remove_oldest("toy", str(root), 4) == ([], [])


def test_what_the_schedule_did_not_make_or_did_not_finish_stays(root, tmp_path):
    (root / record_name(NAMES[0])).unlink()  # somebody else's
    record = root / record_name(NAMES[1])
    record.write_text(record.read_text().replace('"run_id": "', '"run_id": "other'))  # put there in its place
    (root / NAMES[2] / "manifest.json").unlink()  # unfinished
    outside = tmp_path / "outside"
    (root / NAMES[3]).rename(outside)
    (root / NAMES[3]).symlink_to(outside)
    (root / "toy-notes").mkdir()
    before = left(root)
    assert remove_oldest("toy", str(root), 1) == ([], [])
    assert remove_oldest("other", str(root), 1) == ([], [])
    assert left(root) == before and (outside / "manifest.json").is_file()


def test_a_dataset_that_is_written_or_read_stays_until_the_next_time(root):
    with sole_writer(Layout(root / NAMES[0])), (root / NAMES[1] / "plan.json").open():
        assert remove_oldest("toy", str(root), 1) == (NAMES[2:4], NAMES[:2])
    assert left(root) == [*NAMES[:2], NAMES[4]]
    assert not (root / NAMES[1] / ".staging").exists(), "nothing is written into a dataset that is read"
    assert remove_oldest("toy", str(root), 1) == (NAMES[:2], [])


def test_what_a_killed_removal_has_left_goes_the_next_time(root):
    (root / NAMES[0]).rename(root / f".removed-{NAMES[0]}")
    (root / ".removed-letters").mkdir()
    remove_oldest("toy", str(root), 5)
    assert left(root) == [".removed-letters", *NAMES[1:]]
    assert not (root / record_name(NAMES[0])).exists()


def test_a_removal_that_is_killed_leaves_no_record_without_its_dataset(root, monkeypatch):
    def be_killed(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("flows.scheduled.retention.shutil.rmtree", be_killed)
    with pytest.raises(KeyboardInterrupt):
        remove_oldest("toy", str(root), 4)
    monkeypatch.undo()
    assert not (root / record_name(NAMES[0])).exists()
    remove_oldest("toy", str(root), 4)
    assert left(root) == NAMES[1:]


def test_in_a_store_objects_go_and_the_manifest_last(root, tmp_path, monkeypatch):
    obstore = pytest.importorskip("obstore")
    gone = []
    monkeypatch.setattr(
        "obstore.store.S3Store",
        lambda bucket, prefix, **_: obstore.store.LocalStore(tmp_path / bucket / prefix, mkdir=True),
    )
    remove = obstore.delete
    monkeypatch.setattr("obstore.delete", lambda store, names: (gone.extend(names), remove(store, names)))
    (root / NAMES[0] / ".staging").mkdir()
    (root / NAMES[0] / ".staging" / "clip.json").write_text("{}")
    assert remove_oldest("toy", "s3://data/nightly", 4) == (NAMES[:1], [])
    assert gone == [
        "plan.json",
        ".staging/clip.json",
        "manifest.json",
        ".staging/lock",
        record_name(NAMES[0]),
    ]
    assert not [path for path in (root / NAMES[0]).rglob("*") if path.is_file()]
