"""A scheduled run under Prefect: tried again with back-off, shown as artifacts, reported when it fails for good."""

import json
import os
import subprocess
import sys

import pytest
import yaml

from benchmarks import scheduled_runs
from flows.scheduled.scheduling import checked_parameters
from manifests.provenance import SOURCE_ROOT

RUN = """
import json, sys
from datetime import UTC, datetime
from inspect import signature
from types import SimpleNamespace
from flows.scheduled import prefect_schedule, scheduling
from flows.running.failures import ClipsFailed
from prefect.client.orchestration import get_client
from tasks.errors import InputError

made, tries = scheduling.generate, []

def unlucky_twice(*args, **options):
    tries.append("generate")
    if len(tries) < 3:
        raise ClipsFailed("lightning struck")
    return made(*args, **options)

def wrong(*args, **options):
    tries.append("wrong")
    raise InputError("no such street")

if __name__ == "__main__":
    delays = list(prefect_schedule.make_dataset.retry_delay_seconds)
    prefect_schedule.make_dataset.retry_delay_seconds = [0.1, 0.1, 0.1]
    options = {"grid": sys.argv[1], "root": "root", "runner": "threads", "workers": 1, "notify": "./hook.sh"}
    scheduling.generate = unlucky_twice
    dataset = prefect_schedule.scheduled(**options)
    scheduling.generate = wrong
    state = prefect_schedule.scheduled(**options | {"root": "bad"}, return_state=True)
    run = SimpleNamespace(parameters=options | {"root": "killed"}, expected_start_time=datetime.now(UTC))
    (hook,) = prefect_schedule.scheduled.on_crashed_hooks
    hook(None, run, SimpleNamespace(message="status code -9"))
    with get_client(sync_client=True) as client:
        found = {a.key: [a.type, a.data] for a in client.read_artifacts()}
    print(json.dumps({"delays": delays, "tries": tries, "dataset": dataset, "failed": state.is_failed(),
                      "artifacts": found,
                      "parameters": list(signature(prefect_schedule.scheduled.fn).parameters)}))
"""


@pytest.fixture(scope="module")
def told(toy_dataset, tmp_path_factory) -> dict:
    folder = tmp_path_factory.mktemp("scheduled")
    (folder / "run.py").write_text(RUN)
    (folder / "hook.sh").write_text('#!/bin/sh\necho "$1" >> told\n')
    (folder / "hook.sh").chmod(0o755)
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PREFECT")}
    done = subprocess.run(
        [sys.executable, "run.py", str(toy_dataset.root.parent / "grid.yaml")],
        cwd=folder,
        env=clean | {"PYTHONPATH": str(SOURCE_ROOT)},
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return {"folder": folder} | json.loads(done.stdout.strip().splitlines()[-1])


def test_clips_that_failed_are_tried_again_with_growing_delays_and_a_wrong_input_is_not(told):
    assert told["delays"] == [10, 20, 40]
    assert told["tries"] == ["generate"] * 3 + ["wrong"]


def test_verdicts_contact_sheet_and_a_link_to_the_dataset_are_artifacts(told):
    (kind, rows), (_, link), (_, picture) = (
        told["artifacts"][f"musync-{name}"] for name in ("verdicts", "dataset", "contact-sheet")
    )
    table = json.loads(rows)
    assert kind == "table" and len(table) == 4
    assert {"clip", "passed", "pitch_rmse_deg", "stopping_distance_m", "reasons"} <= table[0].keys()
    assert f"file://{told['dataset']}" in link and told["dataset"] in picture


def test_a_run_that_fails_for_good_is_reported_and_the_hook_told_once(told):
    (report,) = (told["folder"] / "bad" / "reports").iterdir()
    assert told["failed"] and "InputError: no such street" in report.read_text()
    assert (told["folder"] / "told").read_text().splitlines()[:1] == [str(report)]
    assert not (told["folder"] / "root" / "reports").exists()


def test_a_run_that_was_killed_is_reported_by_whoever_started_it(told):
    (report,) = (told["folder"] / "killed" / "reports").iterdir()
    assert "status code -9" in report.read_text()
    assert (told["folder"] / "told").read_text().splitlines()[1:] == [str(report)]


def test_the_deployment_for_a_work_pool_names_a_flow_and_parameters_that_exist_and_are_sound(told):
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
    assert set(given) <= set(told["parameters"]) == set(checked)
    assert deployment["concurrency_limit"] == 1


@pytest.mark.minutes
def test_served_from_a_clean_home_cron_fires_twice_and_nothing_is_left_when_it_is_stopped(capfd):
    assert scheduled_runs.main() == 0, capfd.readouterr().out
