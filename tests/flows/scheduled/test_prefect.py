"""Under Prefect: the same pipeline as flow and tasks; a scheduled run tried again, shown as artifacts, reported.

One process runs everything, because Prefect's import and temporary server take ten CPU-seconds.
"""

import json
import os
import subprocess
import sys

import pytest
import yaml

from benchmarks import scheduled_runs
from flows.making.generate import generate_dataset
from flows.scheduled.scheduling import checked_parameters
from manifests.provenance import SOURCE_ROOT
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
    return generate(*args, **options)

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
    options = {"grid": "grid.yaml", "root": "root", "runner": "threads", "workers": 1, "notify": "./hook.sh"}
    scheduling.generate = unlucky_twice
    dataset = prefect_schedule.scheduled(**options)
    scheduling.generate = wrong
    state = prefect_schedule.scheduled(**options | {"root": "bad"}, return_state=True)
    run = SimpleNamespace(parameters=options | {"root": "killed"}, expected_start_time=datetime.now(UTC))
    (hook,) = prefect_schedule.scheduled.on_crashed_hooks
    hook(None, run, SimpleNamespace(message="status code -9"))
    with get_client(sync_client=True) as client:
        found = {a.key: [a.type, a.data] for a in client.read_artifacts()}
    return {"delays": delays, "tries": tries, "dataset": dataset, "failed": state.is_failed(),
            "artifacts": found, "parameters": list(signature(prefect_schedule.scheduled.fn).parameters)}

if __name__ == "__main__":  # a worker of Dask needs none of this
    from datetime import UTC, datetime
    from inspect import signature
    from types import SimpleNamespace
    from flows import cli, prefect_flows
    from flows.running.failures import ClipsFailed
    from flows.scheduled import prefect_schedule, scheduling
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.objects import StateType
    from tasks.errors import InputError

    generate = scheduling.generate
    plain = plain_flows()
    print("scheduled:", file=sys.stderr, flush=True)
    print(json.dumps({"plain": plain, "scheduled": scheduled_flows()}))
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
    return facts | {"folder": folder, "said": done.stderr.split("scheduled:\n")[0]}


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
    assert wrong.startswith("musync: ") and "manifest.json: no such file" in wrong
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
    assert f"file://{scheduled['dataset']}" in link and scheduled["dataset"] in picture


def test_a_run_that_fails_for_good_is_reported_and_the_hook_told_once(scheduled):
    (report,) = (scheduled["folder"] / "bad" / "reports").iterdir()
    assert scheduled["failed"] and "InputError: no such street" in report.read_text()
    assert (scheduled["folder"] / "told").read_text().splitlines()[:1] == [str(report)]
    assert not (scheduled["folder"] / "root" / "reports").exists()


def test_a_run_that_was_killed_is_reported_by_whoever_started_it(scheduled):
    (report,) = (scheduled["folder"] / "killed" / "reports").iterdir()
    assert "status code -9" in report.read_text()
    assert (scheduled["folder"] / "told").read_text().splitlines()[1:] == [str(report)]


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
        given.get("notify"),
    )
    assert f"def {flow}(" in (SOURCE_ROOT / module).read_text()
    assert set(given) <= set(scheduled["parameters"]) == set(checked)
    assert deployment["concurrency_limit"] == 1


@pytest.mark.minutes
def test_served_from_a_clean_home_cron_fires_twice_and_nothing_is_left_when_it_is_stopped(capfd):
    assert scheduled_runs.main() == 0, capfd.readouterr().out
