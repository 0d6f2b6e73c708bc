"""Under Prefect: the same pipeline as flow and tasks; a scheduled run tried again, shown as artifacts, reported.

One process runs everything, because Prefect's import and temporary server take ten CPU-seconds.
"""

import base64
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from flows.making.generate import generate_dataset
from flows.scheduled.scheduling import checked_parameters
from manifests.provenance import SOURCE_ROOT
from studies import scheduled_runs
from tests.toy_street import write_toy_grid

RUNS = """
import json
import sys

tries = []

def broken(dataset, key=None, out=None):
    raise KeyError("clips")

def end_of(*words):
    sys.argv = ["musync", *words]
    try:
        cli.main()
    except SystemExit as end:
        return end.code

def unlucky_twice(*args, **options):
    tries.append("generate")
    if len(tries) < 3:
        raise ClipsFailed("lightning struck")
    return generate_dataset(*args, **options)

def wrong(*args, **options):
    tries.append("wrong")
    raise InputError("no such street")

def plain_flows():
    state = prefect_flows.generate("grid.yaml", "flow", runner="dask", workers=1, return_state=True)
    with get_client(sync_client=True) as client:
        runs = client.read_task_runs()
    tasks = sorted(run.name.rsplit("-", 1)[0] for run in runs if run.state.type == StateType.COMPLETED)
    facts = {"made": state.result()["made"], "tasks": tasks, "wrong": end_of("verify", "nowhere", "--prefect")}
    prefect_flows.verify = prefect_flows.make_flow(broken, "verify")
    return facts | {"broken": end_of("verify", "nowhere", "--prefect")}

def scheduled_flows():
    delays = list(prefect_schedule.make_dataset.retry_delay_seconds)
    prefect_schedule.make_dataset.retry_delay_seconds = [0.1, 0.1, 0.1]
    asked = {"grid": "grid.yaml", "root": "elsewhere", "scheduler": "tcp://127.0.0.1:9"}
    def serve(root, **more):
        options = {"grid": "grid.yaml", "root": root, "runner": "threads", "workers": 1, "scheduler": None}
        os.environ[serving.OPTIONS] = json.dumps(options | {"notify": "./hook.sh", "keep": None} | more)
    serve("root", keep=1)
    scheduling.generate_dataset = unlucky_twice
    dataset = prefect_schedule.scheduled(**asked)
    serve("bad")
    scheduling.generate_dataset = wrong
    state = prefect_schedule.scheduled(**asked, return_state=True)
    serve("killed")
    now, (hook,) = datetime.now(UTC), prefect_schedule.scheduled.on_crashed_hooks
    hook(None, SimpleNamespace(parameters=asked, expected_start_time=now), SimpleNamespace(message="status code -9"))
    serve("posted")
    posted = SimpleNamespace(parameters=asked | {"notify": "touch pwned"}, expected_start_time=now)
    hook(None, posted, SimpleNamespace(message="status code 1"))
    with get_client(sync_client=True) as client:
        found = {a.key: [a.type, a.data] for a in client.read_artifacts()}
        names = [run.name for run in client.read_flow_runs()]
    return {"delays": delays, "tries": tries, "dataset": dataset, "failed": state.is_failed(), "names": names,
            "artifacts": found, "parameters": list(signature(prefect_schedule.scheduled.fn).parameters)}

def failed_removal():
    said = []
    log = SimpleNamespace(warning=lambda text, *words: said.append(text % words), info=None)
    def full(*_):
        raise OSError("the disk does not answer")
    prefect_schedule.get_run_logger, prefect_schedule.remove_oldest = (lambda: log), full
    prefect_schedule._remove_oldest("toy", "root", 1)
    return said

def rows_of_log():
    APILogWorker.instance().drain()
    with get_client(sync_client=True) as client:
        return [row.message for row in client.read_logs(None, limit=200)]

async def wait_for_ever(self):
    signal.signal(signal.SIGTERM, self.handle_sigterm)  # as Prefect's runner does
    signal.raise_signal(signal.SIGTERM)
    await asyncio.sleep(600)

def stopped_schedule():
    serving.Runner.start = wait_for_ever
    parameters = {"grid": "grid.yaml", "root": "stopped", "notify": "./hook.sh"}
    with get_client(sync_client=True) as client:
        add = serving.Runner.add_flow
        def add_and_submit(self, flow, **options):
            deployment = add(self, flow, **options)
            client.create_flow_run_from_deployment(deployment, state=Submitting())
            client.create_flow_run_from_deployment(deployment, parameters={"grid": "old.yaml", "notify": "true"})
            return deployment
        serving.Runner.add_flow = add_and_submit
        serving.serve_flow(prefect_schedule.scheduled, "0 3 1 1 *", parameters)
        runs = [run for run in client.read_flow_runs() if run.deployment_id]
    due = [run.parameters for run in runs if run.state.type == StateType.SCHEDULED and not run.auto_scheduled]
    return [run.state.name for run in runs if run.state.type != StateType.SCHEDULED], due

if __name__ == "__main__":  # a worker of Dask needs none of this
    import asyncio
    import os
    import signal
    from flows.running.prefect_server import prefect_api
    server = prefect_api(pages=False)
    server.__enter__()
    from datetime import UTC, datetime
    from inspect import signature
    from types import SimpleNamespace
    from flows import cli, prefect_flows
    from flows.running.failures import ClipsFailed
    from flows.scheduled import prefect_schedule, scheduling, serving
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.objects import StateType
    from prefect.logging.handlers import APILogWorker
    from prefect.states import Submitting
    from tasks.errors import InputError

    generate_dataset = scheduling.generate_dataset
    plain = plain_flows()
    print("scheduled:", file=sys.stderr, flush=True)
    made = scheduled_flows()
    print(json.dumps({"plain": plain, "scheduled": made, "rows": rows_of_log(), "stopped": stopped_schedule(),
                      "unremoved": failed_removal()}))
    server.__exit__(None, None, None)
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> dict:
    """Facts about the ``plain`` and the ``scheduled`` flows, their ``folder``, what the plain ones ``said``."""
    folder = tmp_path_factory.mktemp("prefect")
    write_toy_grid(folder, frames=3)
    (folder / "run.py").write_text(RUNS)
    (folder / "hook.sh").write_text('#!/bin/sh\necho "$1" >> told\n')
    (folder / "hook.sh").chmod(0o755)
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PREFECT")}
    done = subprocess.run(
        [sys.executable, "run.py"], cwd=folder, capture_output=True, text=True, timeout=280,
        env=clean | {"PYTHONPATH": str(SOURCE_ROOT)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    facts = json.loads(done.stdout.strip().splitlines()[-1])
    said, _, late = done.stderr.partition("scheduled:\n")
    return facts | {"folder": folder, "said": said, "said_late": late}


@pytest.fixture
def scheduled(runs) -> dict:
    return runs["scheduled"] | {"folder": runs["folder"]}


def test_as_a_prefect_flow_the_stages_are_tasks_and_the_bytes_are_the_same(runs):
    folder, facts = runs["folder"], runs["plain"]
    assert (facts["made"], facts["tasks"]) == (4, ["fan_out", "prepare_dataset", "seal_dataset"])
    assert (folder / ".musync" / "prefect").is_dir(), "Prefect keeps to the project's folder"
    plain = generate_dataset(str(folder / "grid.yaml"), str(folder / "plain"), runner="threads").layout
    assert (folder / "flow" / "manifest.json").read_bytes() == plain.manifest.read_bytes()


def test_a_flow_that_fails_ends_like_the_command_without_prefect(runs):
    assert (runs["plain"]["wrong"], runs["plain"]["broken"]) == (2, 3)
    wrong, broken = (line for line in runs["said"].splitlines() if not line.startswith("clips "))
    assert wrong.startswith("musync: ") and "it has no manifest.json" in wrong
    assert "a defect of muSync" in broken and "KeyError: 'clips'" in broken


def test_clips_that_failed_are_tried_again_with_growing_delays_and_a_wrong_input_is_not(scheduled):
    assert scheduled["delays"] == [10, 20, 40]
    assert scheduled["tries"] == ["generate"] * 3 + ["wrong"]


def test_verdicts_contact_sheet_and_a_link_to_the_dataset_are_artifacts(scheduled):
    (kind, rows), (_, link), (_, picture) = (
        scheduled["artifacts"][f"musync-{name}"] for name in ("verdicts", "dataset", "contact-sheet")
    )
    table = json.loads(rows)
    assert kind == "table" and len(table) == 4
    assert {"clip", "passed", "pitch_rmse_deg", "stopping_distance_m", "reasons"} <= table[0].keys()
    assert f"file://{scheduled['dataset']}" in link
    assert picture.startswith("data:image/jpeg;base64,") and len(picture) < 200_000
    content = np.frombuffer(base64.b64decode(picture.partition(",")[2]), np.uint8)
    small = cv2.imdecode(content, cv2.IMREAD_COLOR)
    sheet = cv2.imread(f"{scheduled['dataset']}/previews/contact_sheet.png")
    assert max(small.shape) <= 1000
    assert (
        abs(cv2.resize(sheet, small.shape[1::-1], interpolation=cv2.INTER_AREA).astype(int) - small).mean()
        < 4
    )


def test_the_fan_out_is_a_table_of_clips_with_the_time_of_each_step(scheduled):
    kind, rows = scheduled["artifacts"]["musync-clips"]
    table = json.loads(rows)
    steps = [f"{step} [CPU-s]" for step in ("surface", "rollout", "frames", "check", "commit")]
    assert kind == "table" and len({row["name"] for row in table}) == len(table) == 4
    for row in table:
        assert list(row) == ["name", "outcome", "check", *steps] and row["outcome"] == "done"
        assert all(row[step] >= 0 for step in steps) and row["frames [CPU-s]"] > 0


def test_a_run_has_rows_in_the_log_a_progress_and_a_name_that_says_what_it_is(runs, scheduled):
    stages = [
        f"stage {name} {word}"
        for name in ("prepare_dataset", "fan_out", "seal_dataset")
        for word in ("begins", "end")
    ]
    rows = "\n".join(runs["rows"])
    for row in [
        *stages,
        "clips 0/4",
        "clips 4/4",
        "verdict: 4 clips, 4 made now, ",
        "removed 0 of the oldest datasets",
        "no such street",
    ]:
        assert row in rows, row
    assert scheduled["artifacts"]["musync-progress"][1] == 100.0
    assert [
        name
        for name in scheduled["names"]
        if re.fullmatch(r"toy, 4 clips, \d{4}-\d\d-\d\d \d\d:\d\d UTC", name)
    ]
    assert [name for name in scheduled["names"] if name.startswith("generate grid.yaml, ")]


def test_the_record_of_a_run_says_how_it_ended_and_its_metrics_are_prometheus_text(scheduled):
    root, bad = scheduled["folder"] / "root" / "runs", scheduled["folder"] / "bad" / "runs"
    (made,), (failed,) = ([json.loads(p.read_text()) for p in place.glob("*.json")] for place in (root, bad))
    assert (made["made"], made["error"], made["clips"]) == (4, None, 4) and made["cpu_s"] > 0
    assert made["bytes"] == sum(
        p.stat().st_size for p in Path(scheduled["dataset"]).rglob("*") if p.is_file()
    )
    assert failed["error"] == "InputError: no such street" and failed["ended"]
    text = (root / "toy.prom").read_text()
    values = {s.name: s.value for f in text_string_to_metric_families(text) for s in f.samples}
    assert (values["musync_run_clips_done"], values["musync_run_succeeded"]) == (4, 1)
    assert values["musync_dataset_bytes"] == made["bytes"]
    assert "musync_run_succeeded" + '{grid="toy"} 0.0' in (bad / "toy.prom").read_text()


def test_a_stopped_schedule_says_nothing_and_leaves_no_run_that_seems_to_go_on(runs):
    assert runs["stopped"][0] == ["Cancelled"]


def test_a_run_that_is_due_from_before_gets_the_parameters_of_today(runs):
    assert runs["stopped"][1] == [{"grid": "grid.yaml", "root": "stopped"}]
    assert "never awaited" not in runs["said_late"]


def test_datasets_that_cannot_be_removed_are_told_and_do_not_fail_the_run(runs):
    assert runs["unremoved"] == ["the oldest datasets could not be removed: the disk does not answer"]


def test_a_run_takes_the_options_of_the_schedule_that_is_served_and_not_its_own_parameters(scheduled):
    """They may be as old as the server's database, or a stranger's."""
    assert Path(scheduled["dataset"]).parent.name == "root"
    assert not {"elsewhere", "pwned"} & {path.name for path in scheduled["folder"].iterdir()}


def test_a_run_that_fails_for_good_is_reported_and_the_hook_told_once(scheduled):
    (report,) = (scheduled["folder"] / "bad" / "reports").iterdir()
    assert scheduled["failed"] and "InputError: no such street" in report.read_text()
    assert (scheduled["folder"] / "told").read_text().splitlines()[:1] == [str(report)]
    assert not (scheduled["folder"] / "root" / "reports").exists()


def test_a_run_that_was_killed_is_reported_by_whoever_started_it(scheduled):
    (report,) = (scheduled["folder"] / "killed" / "reports").iterdir()
    assert "error: RuntimeError: status code -9\n" in report.read_text()
    assert (scheduled["folder"] / "told").read_text().splitlines()[1] == str(report)


def test_the_report_of_a_run_with_an_unknown_parameter_names_it(scheduled):
    (report,) = (scheduled["folder"] / "posted" / "reports").iterdir()
    assert "scheduler, keep; it has notify: post it without (status code 1)" in report.read_text()


def test_the_deployment_for_a_work_pool_names_a_flow_and_parameters_that_exist_and_are_sound(scheduled):
    (deployment,) = yaml.safe_load((SOURCE_ROOT / "prefect.yaml").read_text())["deployments"]
    module, flow = deployment["entrypoint"].split(":")
    (schedule,) = deployment["schedules"]
    given = deployment["parameters"]
    checked = checked_parameters(
        given["grid"],
        schedule["cron"],
        given["root"],
        given["runner"],
        given.get("workers"),
    )
    assert f"def {flow}(" in (SOURCE_ROOT / module).read_text()
    commands = {"notify", "notify_on"}
    assert set(given) <= set(scheduled["parameters"]) == (set(checked) | {"keep"}) - commands
    assert deployment["concurrency_limit"] == 1


@pytest.mark.minutes
def test_served_from_a_clean_home_cron_fires_twice_and_nothing_is_left_when_it_is_stopped(capfd):
    assert scheduled_runs.main() == 0, capfd.readouterr().out
