"""Scheduled runs: dated folders, resuming, reports of failures, and parameters checked when the schedule is made."""

import http.server
import json
import threading
import time
from datetime import UTC, datetime, timedelta

import pytest

import flows.making.generate
from flows.making.clip import make_clip
from flows.running.failures import ClipsFailed
from flows.scheduled.failure_report import report_failure
from flows.scheduled.notification import notify_problem
from flows.scheduled.scheduling import checked_parameters, choose_dataset, scheduled_run
from flows.store.layout import Layout
from tasks.errors import InputError

AT = datetime(2026, 3, 1, 3, 0, tzinfo=UTC)
NIGHT = timedelta(days=1)


@pytest.fixture
def grid(toy_dataset, tmp_path) -> str:
    text = (toy_dataset.root.parent / "grid.yaml").read_text()
    (tmp_path / "grid.yaml").write_text(text.replace("frames: 11", "frames: 2"))
    return str(tmp_path / "grid.yaml")


def test_each_run_makes_its_own_dated_dataset_with_the_same_bytes(grid, tmp_path):
    root = tmp_path / "root"
    runs = [scheduled_run(grid, str(root), at=AT + i * NIGHT, runner="threads") for i in range(2)]
    assert sorted(p.name for p in root.iterdir()) == ["toy-20260301T030000Z", "toy-20260302T030000Z"]
    first, second = (Layout(p).manifest.read_bytes() for p in sorted(root.iterdir()))
    assert first == second
    assert [run["made"] for run in runs] == [4, 4]
    assert {row["clip"] for row in runs[0]["verdicts"]} == {
        "dry/flat",
        "dry/hump",
        "snow-3/flat",
        "snow-3/hump",
    }


def lightning_at_two(layout: Layout, index: int, scene: str) -> dict:
    if index == 2:
        raise RuntimeError("lightning struck")
    return make_clip(layout, index, scene)


def test_an_unfinished_run_is_resumed_and_one_of_another_plan_left_alone(grid, tmp_path, monkeypatch):
    root = tmp_path / "root"
    monkeypatch.setattr(flows.making.generate, "make_clip", lightning_at_two)
    with pytest.raises(ClipsFailed):
        scheduled_run(grid, str(root), at=AT, runner="threads", workers=1)
    monkeypatch.undo()
    other = tmp_path / "other.yaml"
    other.write_text((tmp_path / "grid.yaml").read_text().replace("frames: 2", "frames: 3"))
    apart = scheduled_run(str(other), str(root), at=AT + NIGHT, runner="threads")
    assert apart["dataset"].endswith("toy-20260302T030000Z") and apart["made"] == 4
    resumed = scheduled_run(grid, str(root), at=AT + 2 * NIGHT, runner="threads")
    assert resumed["dataset"].endswith("toy-20260301T030000Z") and 0 < resumed["made"] < 4
    assert len(list(root.iterdir())) == 2


def test_the_place_of_a_run_that_stopped_before_its_plan_is_taken_by_the_next(grid, tmp_path, monkeypatch):
    root = tmp_path / "root"

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(flows.making.generate, "create_frame_arrays", full)
    with pytest.raises(OSError, match="No space"):
        scheduled_run(grid, str(root), at=AT, runner="threads")
    monkeypatch.undo()
    assert scheduled_run(grid, str(root), at=AT + NIGHT, runner="threads")["made"] == 4
    assert [path.name for path in root.iterdir()] == ["toy-20260301T030000Z"]


def test_a_failure_leaves_a_report_and_runs_the_command_with_it(tmp_path):
    (tmp_path / "hook.sh").write_text(
        f'#!/bin/sh\ncp "$2" "{tmp_path}/told"; echo "$1" >> "{tmp_path}/told"\n'
    )
    (tmp_path / "hook.sh").chmod(0o755)
    error = ClipsFailed("2 of 4 clips failed")
    report = report_failure("demo", str(tmp_path), AT, error, f"{tmp_path}/hook.sh 'two words'")
    text = report.read_text()
    assert "2 of 4 clips failed" in text and "2026-03-01T03:00:00+00:00" in text
    assert (tmp_path / "told").read_text() == text + "two words\n"


def test_nothing_that_failed_is_run_or_gets_a_line_of_its_own(tmp_path):
    label = f"$(touch {tmp_path}/pwned) `touch {tmp_path}/pwned`; touch {tmp_path}/pwned\nnext: all is well\x1b[2J"
    hook = f"sh -c 'cat \"$0\" > {tmp_path}/told'"
    report = report_failure(label, str(tmp_path), AT, ClipsFailed(f"1 of 4 clips failed ({label})"), hook)
    assert not (tmp_path / "pwned").exists()
    lines = report.read_text().splitlines()
    assert [line.partition(":")[0] for line in lines] == [
        "what",
        "grid",
        "root",
        "scheduled",
        "error",
        "next",
    ]
    assert r"\x1b[2J" in lines[4] and (tmp_path / "told").read_text() == report.read_text()


def test_a_report_overwrites_no_file_of_another_s(tmp_path):
    theirs = tmp_path / "reports" / "20260301T030000Z.txt"
    theirs.parent.mkdir()
    theirs.write_text("mine")
    with pytest.raises(InputError, match="is not a file that musync schedule wrote"):
        report_failure("demo", str(tmp_path), AT, ClipsFailed("no luck"), None)
    assert theirs.read_text() == "mine"


@pytest.mark.parametrize("plan", ["", "[]", '{"run_id": 1}', "{}"])
def test_an_unfinished_dataset_with_a_damaged_plan_is_left_alone(grid, tmp_path, plan):
    damaged = tmp_path / "root" / "toy-20260228T030000Z"
    damaged.mkdir(parents=True)
    (damaged / "plan.json").write_text(plan)
    assert choose_dataset(grid, str(tmp_path / "root"), "auto", AT).endswith("toy-20260301T030000Z")


def test_a_failure_is_posted_to_a_webhook(tmp_path):
    told = []

    class Hook(http.server.BaseHTTPRequestHandler):
        def do_POST(self):
            told.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Hook) as server:
        threading.Thread(target=server.handle_request, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/hook"
        report = report_failure("demo", str(tmp_path), AT, ClipsFailed("no luck"), address)
    assert told[0]["error"] == "ClipsFailed: no luck" and told[0]["report"] == str(report)
    assert told[0]["title"] == "muSync: a scheduled run failed" and told[0]["event"] == "failed"


def test_a_hook_that_fails_is_noted_and_does_not_hide_the_failure(tmp_path):
    report = report_failure("demo", str(tmp_path), AT, ClipsFailed("no luck"), "false")
    assert "no luck" in report.read_text() and "notification false failed" in report.read_text()


def test_an_address_may_stand_in_a_variable_and_is_told_nowhere(tmp_path, monkeypatch):
    monkeypatch.setenv("TELL", "json://user:secret@127.0.0.1:9/hook")
    assert notify_problem("env:TELL") is None and "env:NOBODY" in str(notify_problem("env:NOBODY"))
    for notify in ("env:TELL", "json://user:secret@127.0.0.1:9/hook"):
        report = report_failure("demo", str(tmp_path), AT, ClipsFailed("no luck"), notify)
        assert "failed: " in report.read_text() and "secret" not in report.read_text()


@pytest.mark.parametrize(
    "notify", ["mailto://me:word@example.org", "https://example.org/hook?key=1", "true 'two words'"]
)
def test_mail_web_addresses_and_commands_can_be_told(notify):
    assert notify_problem(notify) is None


@pytest.mark.parametrize("notify", ["nonsense://example.org", "no-such-command", "slack://x", "true 'two"])
def test_what_can_never_be_told_is_refused(notify):
    assert "--notify must be" in str(notify_problem(notify))


def test_a_run_is_late_that_begins_late_or_still_goes_on_when_the_next_is_due():
    from flows.scheduled.prefect_schedule import (
        watch_lateness,
    )  # imports Prefect, which no other test here needs

    now, told = datetime.now(UTC), []
    with watch_lateness(now - timedelta(hours=2), now + timedelta(seconds=0.01), told.append):
        time.sleep(0.05)
    assert len(told) == 1 and "began 120 min later" in told[0]
    with watch_lateness(now, datetime.now(UTC) + timedelta(seconds=0.01), told.append):
        time.sleep(0.2)
    assert len(told) == 2 and "still goes on" in told[1]
    with watch_lateness(now, datetime.now(UTC) + timedelta(seconds=0.1), told.append):
        pass
    time.sleep(0.15)
    assert len(told) == 2


def test_everything_wrong_with_a_schedule_is_told_when_it_is_made(tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(InputError) as caught:
        checked_parameters(
            "nowhere",
            "every night",
            str(tmp_path / "taken"),
            "fish",
            None,
            "no-such-command",
            "cluster",
            "never",
        )
    text = str(caught.value)
    assert len(caught.value.problems) == 8
    for word in ("--every", "nowhere: no such grid", "--out", "--runner", "--scheduler cluster belongs to",
                 "--scheduler must be like tcp://host:8786", "--notify must",
                 "--notify-on"):  # fmt: skip
        assert word in text


def test_a_hook_with_an_open_quotation_is_told(grid, tmp_path):
    with pytest.raises(InputError, match="--notify must be"):
        checked_parameters(grid, "0 3 * * *", str(tmp_path), "threads", 1, "mail 'me")


def test_parameters_name_files_in_full_so_that_runs_find_them_from_anywhere(grid, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    parameters = checked_parameters("grid.yaml", "0 3 * * *", "root", "threads", 1, None)
    assert (parameters["grid"], parameters["root"]) == (grid, str(tmp_path / "root"))
