"""The same pipeline under Prefect: a flow with task runs, on a temporary local server."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from flows.making.generate import generate_dataset
from manifests.provenance import SOURCE_ROOT
from tests.toy_street import write_toy_grid

FLOW = """
import json, sys
from flows import cli, prefect_flows
from prefect.client.orchestration import get_client
from prefect.client.schemas.objects import StateType

def broken(dataset, key=None, out=None):
    raise KeyError("clips")

def end_of(*words):
    sys.argv = ["musync", *words]
    try:
        cli.main()
    except SystemExit as end:
        return end.code

if __name__ == "__main__":
    state = prefect_flows.generate("grid.yaml", "flow", runner="dask", workers=2, return_state=True)
    with get_client(sync_client=True) as client:
        runs = client.read_task_runs()
    tasks = sorted(run.name.rsplit("-", 1)[0] for run in runs if run.state.type == StateType.COMPLETED)
    facts = {"made": state.result()["made"], "tasks": tasks, "wrong": end_of("verify", "nowhere", "--prefect")}
    prefect_flows.verify = prefect_flows.make_flow(broken, "verify")
    print(json.dumps(facts | {"broken": end_of("verify", "nowhere", "--prefect")}))
"""


@pytest.fixture(scope="module")
def flow_run(tmp_path_factory) -> tuple[Path, dict, str]:
    """A folder, what a process printed that ran three flows in it, and its standard error: a server takes seconds."""
    folder = tmp_path_factory.mktemp("prefect")
    write_toy_grid(folder, frames=5)
    (folder / "run.py").write_text(FLOW)
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PREFECT")}
    done = subprocess.run(
        [sys.executable, "run.py"], cwd=folder, capture_output=True, text=True, timeout=280,
        env=clean | {"PYTHONPATH": str(SOURCE_ROOT)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return folder, json.loads(done.stdout.strip().splitlines()[-1]), done.stderr


def test_as_a_prefect_flow_the_stages_are_tasks_and_the_bytes_are_the_same(flow_run):
    folder, facts, _ = flow_run
    assert (facts["made"], facts["tasks"]) == (4, ["fan_out", "prepare_dataset", "seal_dataset"])
    assert (folder / ".musync" / "prefect").is_dir(), "Prefect keeps to the project's folder"
    plain = generate_dataset(str(folder / "grid.yaml"), str(folder / "plain"), runner="threads").layout
    assert (folder / "flow" / "manifest.json").read_bytes() == plain.manifest.read_bytes()


def test_a_flow_that_fails_ends_like_the_command_without_prefect(flow_run):
    _, facts, told = flow_run
    assert (facts["wrong"], facts["broken"]) == (2, 3)
    wrong, broken = (line for line in told.splitlines() if not line.startswith("clips "))
    assert wrong.startswith("musync: ") and "manifest.json: no such file" in wrong
    assert "a defect of muSync" in broken and "KeyError: 'clips'" in broken
