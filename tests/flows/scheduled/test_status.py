"""The state of datasets as an operator asks for it: running, stopped, finished; what failed; how long yet."""

import os
import shutil
from datetime import UTC, datetime

import pytest
from typer.testing import CliRunner

import flows.making.generate
from flows.cli import app
from flows.making.clip import make_clip
from flows.running.failures import ClipsFailed
from flows.scheduled.failure_report import report_failure
from flows.scheduled.progress_of_clips import Seen, describe_seen, estimate_left
from flows.scheduled.run_record import RunRecord, record_name
from flows.scheduled.scheduling import recorded_run
from flows.scheduled.status import format_text, report_status
from flows.store.layout import Layout
from flows.store.lock import sole_writer
from tasks.errors import InputError

AT = datetime(2026, 3, 1, 3, 0, tzinfo=UTC)
NAME = "toy-20260301T030000Z"


def lightning_at_two(layout: Layout, index: int, scene: str) -> dict:
    if index == 2:
        raise RuntimeError("lightning struck")
    return make_clip(layout, index, scene)


@pytest.fixture(scope="module")
def stopped(toy_dataset, tmp_path_factory):
    """The folder of a schedule with one run, of which a clip failed."""
    root = tmp_path_factory.mktemp("schedule") / "root"
    text = (toy_dataset.root.parent / "grid.yaml").read_text()
    grid = root.parent / "grid.yaml"
    grid.write_text(text.replace("frames: 11", "frames: 2"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flows.making.generate, "make_clip", lightning_at_two)
        with pytest.raises(ClipsFailed) as failed:
            recorded_run(str(grid), str(root), at=AT, runner="threads", workers=1)
    report_failure(str(grid), str(root), AT, failed.value, None)
    return root


def test_a_run_that_failed_is_stopped_with_its_missing_clips_and_what_ended_it(stopped):
    status = report_status(str(stopped))
    (row,), (failure,) = status["datasets"], status["failures"]
    assert (row["dataset"], row["state"], row["clips"], row["done"]) == (NAME, "stopped", 4, 3)
    assert row["failed"] == row["missing"] == ["snow-3/flat"] and "lightning struck" in row["error"]
    assert failure["scheduled"] == "2026-03-01T03:00:00+00:00" and "lightning" in failure["error"]
    assert report_status(str(stopped / NAME))["datasets"] == [row]
    text = format_text(status)
    assert f"{NAME}: stopped, 3 of 4 clips\n  failed: snow-3/flat\n  missing: snow-3/flat\n" in text


def test_a_dataset_whose_lock_is_held_is_running_and_its_clips_give_the_time_left(stopped):
    layout = Layout(stopped / NAME)
    with sole_writer(layout):
        begun = os.stat(layout.staging / "lock").st_mtime
        for number, receipt in enumerate(sorted(layout.staging.glob("*.json")), start=1):
            os.utime(receipt, (begun + 1e6, begun + 1e6 + 20 * number))  # the pace is theirs, not the lock's
        (row,) = report_status(str(stopped))["datasets"]
    assert (row["state"], row["missing"], row["error"]) == ("running", [], None)
    assert row["left_s"] == pytest.approx(20 + 1e6 + 60, abs=60)
    assert report_status(str(stopped))["datasets"][0]["state"] == "stopped"


def test_a_finished_dataset_is_finished_and_the_command_prints_it(toy_dataset):
    done = CliRunner().invoke(app, ["status", str(toy_dataset.root)])
    assert done.output == f"{toy_dataset.root.name}: finished, 4 of 4 clips\n"


def test_a_place_without_datasets_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="there is no muSync dataset"):
        report_status(str(tmp_path))


def test_a_damaged_plan_record_or_report_is_no_failure_of_the_command(tmp_path):
    for name, text in {f"{NAME}/plan.json": "[", record_name(NAME): '{"format": "musync-run/1"}',
                       "reports/20260301T030000Z.txt": "rubbish\n"}.items():  # fmt: skip
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (row,) = report_status(str(tmp_path))["datasets"]
    assert (row["state"], row["clips"]) == ("begun", None)


def test_in_a_store_the_same_is_seen_and_a_lock_counts_while_it_is_renewed(stopped, tmp_path, monkeypatch):
    obstore = pytest.importorskip("obstore")

    def open_store(bucket: str, prefix: str, **_: object) -> object:
        return obstore.store.LocalStore(tmp_path / bucket / prefix, mkdir=True)

    monkeypatch.setattr("obstore.store.S3Store", open_store)
    shutil.copytree(stopped, tmp_path / "data" / "nightly")
    lock = tmp_path / "data" / "nightly" / NAME / ".staging" / "lock"
    lock.write_text("{}")
    monkeypatch.setattr("flows.scheduled.status.WATCH_S", 0.001)
    monkeypatch.setattr("flows.scheduled.status.RENEW_S", 0.01)
    (dead,) = report_status("s3://data/nightly")["datasets"]
    assert dead == report_status(str(stopped))["datasets"][0]
    monkeypatch.setattr("time.sleep", lambda _: lock.write_text(lock.read_text() + " "))
    (alive,) = report_status(f"s3://data/nightly/{NAME}")["datasets"]
    assert (alive["state"], alive["done"]) == ("running", 3)


def test_the_pace_is_that_of_the_run_that_goes_on_now():
    assert estimate_left([0.0, 10.0, 20.0], 25.0, 3) == pytest.approx(3 * 10 - 5)
    resumed = [0.0, 1.0, 2.0, 5000.0, 5010.0, 5020.0]
    assert estimate_left(resumed, 5020.0, 2) == pytest.approx(20)
    assert estimate_left([5.0], 9.0, 3) is None


def test_where_no_times_are_known_the_record_of_the_run_gives_the_pace():
    now = datetime.now(UTC)
    record = RunRecord(
        dataset="d", grid="g", scheduled="", began=AT.isoformat(), made=6,
        updated=AT.replace(minute=1).isoformat(),
    )  # fmt: skip
    seen = Seen(
        name="d", clips={"a": "one", "b": "two"}, receipts={"a": None}, finished=False, running=True, since=None,
        record=record,
    )  # fmt: skip
    assert describe_seen(seen, AT.replace(minute=1).timestamp())["left_s"] == pytest.approx(10)
    record.ended = now.isoformat()
    assert describe_seen(seen, now.timestamp())["left_s"] is None
