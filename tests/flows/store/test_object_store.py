"""A dataset at an s3:// address, on a real S3 server in a process of its own: the same promises as in a folder."""

import time
import warnings
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import flows.making.generate
import musync
from flows.auditing.audit import audit_dataset
from flows.auditing.explain import explain_frame
from flows.auditing.repair import repair_dataset
from flows.auditing.signing import sign_dataset, signature_findings
from flows.auditing.verify import collect_garbage, verify_dataset
from flows.cli import main
from flows.making.clip import make_clip
from flows.making.generate import generate_dataset, prepare_dataset
from flows.making.plan import make_plan
from flows.reading.describe import describe_dataset
from flows.reading.query import query_dataset
from flows.scheduled.failure_report import report_failure
from flows.scheduled.scheduling import checked_parameters, choose_dataset, scheduled_run
from flows.store.address import open_for_reading, open_for_writing, want_everything, want_progress
from flows.store.frames import read_clip
from flows.store.layout import Layout
from flows.store.lease import LOCK, hold_lease
from flows.store.objects import Objects
from manifests.signing import ENVELOPE
from tasks.errors import InputError
from tests.flows.keys import write_keys
from tests.flows.objects_server import ask, environment, kill, s3_server, start


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with s3_server(tmp_path_factory.mktemp("s3")) as address:
        yield address


@pytest.fixture
def machine(server, tmp_path, monkeypatch, toy_dataset):
    """This process as a machine that knows the server and the shelf of scenes, and has read nothing yet."""
    variables = environment(server, tmp_path / "cache") | {"MUSYNC_SCENES": str(toy_dataset.root.parent)}
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    return variables


@pytest.fixture(scope="module")
def grid(toy_dataset) -> str:
    return str(toy_dataset.root.parent / "grid.yaml")


@pytest.fixture(scope="module")
def stored(server, grid, tmp_path_factory) -> str:
    """The toy dataset with its frames, made at an address."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment(server, tmp_path_factory.mktemp("cache")).items():
            patch.setenv(name, value)
        assert generate_dataset(grid, "s3://data/sets/toy", runner="threads", workers=1).made == 4
    return "s3://data/sets/toy"


def files_of(layout: Layout) -> dict[str, bytes]:
    return {layout.relative(path): path.read_bytes() for path in layout.root.rglob("*") if path.is_file()}


def objects_of(address: str) -> dict[str, bytes]:
    objects = Objects(address)
    return {name: objects.read(name) for name in objects.sizes()}


def test_the_objects_are_the_files_of_the_same_run_in_a_folder(stored, machine, toy_dataset):
    assert objects_of(stored) == files_of(toy_dataset)


def test_no_folder_of_the_run_is_left(stored, machine, grid, tmp_path):
    assert generate_dataset(grid, stored).made == 0
    assert list((tmp_path / "cache" / "stores").glob("work-*")) == []


def test_it_is_audited_and_questions_bring_no_frames(stored, machine, toy_dataset, tmp_path):
    query = "SELECT label, max(pitch) AS pitch FROM ticks GROUP BY label ORDER BY label"
    assert query_dataset(stored, query) == query_dataset(str(toy_dataset.root), query)
    assert describe_dataset(stored) == describe_dataset(str(toy_dataset.root))
    assert explain_frame(stored, "dry/hump", 4)["agrees"]
    here = [
        path for path in (tmp_path / "cache").rglob("*") if path.is_file() and "frames.zarr" in path.parts
    ]
    assert here and {path.name for path in here} == {"zarr.json"}
    result = audit_dataset(stored, share=0.25, runner="threads", workers=1)
    assert result["verified"] and len(result["rerun"]) == 1


def test_frames_of_an_address_are_made_when_they_are_read_and_nothing_is_sent(machine, grid, toy_dataset):
    address, whole = "s3://data/sets/later", read_clip(toy_dataset.frames, 1, "rgb")
    assert generate_dataset(grid, address, runner="threads", workers=1, pictures="later").made == 4
    before, data = objects_of(address), musync.open(address)
    assert not any(name.startswith("frames.zarr/") for name in before)
    assert np.array_equal(data.torch(window=3, stride=3, clips=["dry/hump"])[1]["rgb"].numpy(), whole[3:6])
    assert np.array_equal(data.frames["rgb"][1], whole) and objects_of(address) == before


def test_analysts_read_single_frames_from_the_store_and_windows_from_their_cache(
    stored, machine, toy_dataset
):
    data = musync.open(stored)
    expected = read_clip(toy_dataset.frames, 2, "rgb")
    assert np.array_equal(data.frames["rgb"][2, 5], expected[5])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of clips in quarantine
        windows = data.torch(window=3, columns=["speed"], quarantined=True)
    assert windows[0]["rgb"].shape[0] == 3


def test_a_missing_object_is_no_black_picture(stored, machine, toy_dataset):
    name = next(name for name in Objects(stored).sizes() if name.startswith("frames.zarr/rgb/c/1/"))
    kept = Objects(stored).read(name)
    Objects(stored).remove([name])
    try:
        data = musync.open(stored)
        assert np.array_equal(data.frames["rgb"][2, 5], read_clip(toy_dataset.frames, 2, "rgb")[5])
        with pytest.raises(InputError, match=r"frames\.zarr/rgb/c/1/.*: missing, with pictures of a clip"):
            data.frames["rgb"][1, 5]
    finally:
        Objects(stored).write(name, kept)


def test_one_flipped_bit_is_named_and_repaired_and_no_reader_gets_it(stored, machine):
    objects = Objects(stored)
    name = "telemetry/ticks/family=snow/part-0000.parquet"
    whole = objects.read(name)
    objects.write(name, whole[:999] + bytes([whole[999] ^ 4]) + whole[1000:])
    found = verify_dataset(stored)
    assert [(row["path"], row["damage"]) for row in found["damaged"]] == [(name, "changed")]
    with pytest.raises(InputError, match=r"part-0000.parquet: not the recorded bytes: musync lab repair"):
        query_dataset(stored, "SELECT count(*) FROM ticks")
    assert repair_dataset(stored, runner="threads", workers=1)["restored"] == [name]
    assert objects.read(name) == whole and verify_dataset(stored)["verified"]


def test_a_killed_run_goes_on_from_what_the_store_holds_on_another_machine(
    machine, grid, toy_dataset, tmp_path, monkeypatch
):
    address = "s3://data/sets/killed"
    command = ["generate", grid, "--out", address, "--runner", "threads", "--workers", "1"]
    run = start(command, machine)
    objects = Objects(address)
    deadline = time.monotonic() + 120
    receipts: set[str] = set()
    while not receipts and time.monotonic() < deadline and run.poll() is None:
        receipts = {
            name for name in objects.sizes() if name.endswith(".json") and name.startswith(".staging/")
        }
        time.sleep(0.02)
    kill(run)
    assert 1 <= len(receipts) < 4
    with pytest.raises(InputError, match="must be finished"):
        query_dataset(address, "SELECT 1")
    monkeypatch.setenv("MUSYNC_CACHE", str(tmp_path / "other machine"))
    assert 0 < generate_dataset(grid, address, runner="threads", workers=1).made < 4
    assert objects_of(address) == files_of(toy_dataset)


def test_workers_on_other_machines_share_no_folder_with_the_run(machine, grid, toy_dataset, monkeypatch):
    def make_elsewhere(layout: Layout, index: int, scene: str) -> dict:
        elsewhere = Layout(Path("/a folder of the other machine/dataset"), layout.origin)
        return make_clip(elsewhere, index, scene)

    monkeypatch.setattr(flows.making.generate, "make_clip", make_elsewhere)
    address = "s3://data/sets/apart"
    assert generate_dataset(grid, address, runner="threads", workers=1).made == 4
    assert objects_of(address) == files_of(toy_dataset)


def test_a_second_run_on_another_machine_is_told_while_the_first_goes_on(
    machine, grid, tmp_path, monkeypatch
):
    address = "s3://data/sets/busy"
    with open_for_writing(address, want_progress) as layout:
        prepare_dataset(layout, *make_plan(grid, "cpu"))
    monkeypatch.setenv("MUSYNC_CACHE", str(tmp_path / "other machine"))
    with (
        hold_lease(Objects(address)),
        pytest.raises(InputError, match=rf"{address}: another run is writing this dataset \(on "),
    ):
        generate_dataset(grid, address, runner="threads")


def test_the_second_writer_is_told_and_the_lock_of_a_dead_one_is_taken(stored, machine, monkeypatch):
    monkeypatch.setattr("flows.store.lease.RENEW_S", 0.2)
    objects = Objects(stored)
    with (
        hold_lease(objects),
        pytest.raises(InputError, match="another run is writing this dataset"),
        hold_lease(objects),
    ):
        pass
    assert objects.tag(LOCK) is None
    objects.write(LOCK, b'{"host": "gone", "pid": 1}')
    monkeypatch.setattr("flows.store.lease.LEASE_S", 1.0)
    with hold_lease(objects):
        assert b"gone" not in objects.read(LOCK)
    assert objects.tag(LOCK) is None


def test_another_grid_does_not_go_into_the_same_dataset(stored, machine, grid, tmp_path):
    other = tmp_path / "other.yaml"
    with open(grid) as source:
        other.write_text(source.read().replace("frames: 11", "frames: 10"))
    with pytest.raises(InputError, match=r"s3://data/sets/toy: holds the dataset of another run: .*frames"):
        generate_dataset(str(other), stored)


def test_what_a_killed_run_left_in_the_store_is_collected(stored, machine):
    objects = Objects(stored)
    objects.write(f".staging/{'0' * 16}.json", b"{}")
    assert len(collect_garbage(stored)["removed"]) == 1
    assert not [name for name in objects.sizes() if name.startswith(".staging/")]


def test_a_schedule_writes_dated_datasets_to_a_store_resumes_there_and_reports_there(
    machine, grid, tmp_path, monkeypatch
):
    root, at = "s3://data/nightly", datetime(2026, 3, 1, 3, tzinfo=UTC)
    monkeypatch.chdir(tmp_path)
    assert checked_parameters(grid, "0 3 * * *", f"{root}/", "threads", 1, None)["root"] == root
    with pytest.raises(InputError, match="--out s3://nowhere/nightly: the bucket does not exist"):
        checked_parameters(grid, "0 3 * * *", "s3://nowhere/nightly", "threads", 1, None)
    with open_for_writing(f"{root}/toy-20260301T030000Z", want_progress) as layout:
        prepare_dataset(layout, *make_plan(grid, "cpu"))
    run = scheduled_run(grid, root, at=at + timedelta(days=1), runner="threads", workers=1)
    assert (run["dataset"], run["made"]) == (f"{root}/toy-20260301T030000Z", 4)
    assert choose_dataset(grid, root, "cpu", at + timedelta(days=2)) == f"{root}/toy-20260303T030000Z"
    report = report_failure("toy", root, at, RuntimeError("no luck"), None)
    assert report.is_relative_to(tmp_path)
    assert Objects(root).read("reports/20260301T030000Z.txt") == report.read_bytes()
    assert not (tmp_path / "s3:").exists()


def test_faults_of_the_store_are_one_sentence_each(server, machine, grid, monkeypatch):
    def told(address: str) -> str:
        with pytest.raises(InputError) as raised:
            open_for_reading(address)
        (sentence,) = raised.value.problems
        return sentence

    assert "must be like s3://bucket/prefix" in told("s3://data")
    assert "must be like s3://bucket/prefix" in told("gs://data/toy")
    assert "the bucket does not exist" in told("s3://nowhere/toy")
    assert "there is no muSync dataset" in told("s3://data/nothing")
    Objects("s3://data/other").write("letter.txt", b"Dear Sir")
    with (
        pytest.raises(InputError, match="it holds other objects"),
        open_for_writing("s3://data/other", lambda _: True),
    ):
        pass
    ask(f"{server}/moto-api/reset-auth", "POST", b"0")
    try:
        assert "refuses the credentials (InvalidAccessKeyId)" in told("s3://data/nothing")
    finally:
        ask(f"{server}/moto-api/reset-auth", "POST", b"inf")
    monkeypatch.setattr("flows.store.objects.RETRIES", 0)
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    assert "no object store answers at http://127.0.0.1:9" in told("s3://data/nothing")
    monkeypatch.setitem(__import__("sys").modules, "obstore", None)
    assert "pip install 'musync-gs[s3]'" in told("s3://data/nothing")


def test_a_command_whose_output_must_be_a_folder_says_so(stored, machine, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["musync", "verify", stored, "--out", "s3://data/reports"])
    with pytest.raises(SystemExit) as end:
        main()
    errors = capsys.readouterr().err
    assert (
        end.value.code == 2 and "--out s3://data/reports: must be a folder or file of this machine" in errors
    )


def test_a_dataset_is_signed_where_it_lies(machine, grid, toy_dataset, tmp_path):
    keys, address, written = write_keys(tmp_path), "s3://data/signed", set(files_of(toy_dataset))
    objects = Objects(address)
    objects.send({name: toy_dataset.root / name for name in written})
    assert sign_dataset(address, key=keys["owner"])["written"]
    assert sign_dataset(address, key=keys["other"])["signatures"] == 2
    assert objects.sizes().keys() - written == {ENVELOPE}
    with open_for_writing(address, want_everything) as layout:
        assert signature_findings(layout, keys["owner.pub"])["signed"] is True
    assert generate_dataset(grid, address).made == 0 and ENVELOPE in objects.sizes()
