"""The same pipeline under Prefect: a flow with task runs, on a temporary local server."""

import json
import os
import subprocess
import sys

from catalogs.scenes import write_scene
from flows.making.generate import generate
from manifests.provenance import SOURCE_ROOT
from tests.flows.test_pipeline import GRID
from tests.toy_street import TOY_CAMERA, toy_street

FLOW = """
import json, sys
from flows import prefect_flows
from prefect.client.orchestration import get_client
from prefect.client.schemas.objects import StateType

if __name__ == "__main__":
    state = prefect_flows.generate(sys.argv[1], sys.argv[2], runner="dask", workers=2, return_state=True)
    with get_client(sync_client=True) as client:
        runs = client.read_task_runs()
    print(json.dumps({"made": state.result().made, "tasks": sorted(
        run.name.rsplit("-", 1)[0] for run in runs if run.state.type == StateType.COMPLETED)}))
"""


def test_as_a_prefect_flow_the_stages_are_tasks_and_the_bytes_are_the_same(tmp_path):
    write_scene(toy_street(), tmp_path / "scene", {})
    (tmp_path / "camera.yaml").write_text(TOY_CAMERA)
    (tmp_path / "grid.yaml").write_text(
        GRID.format(scene=tmp_path / "scene", camera=tmp_path / "camera.yaml", frames=5)
    )
    (tmp_path / "run.py").write_text(FLOW)
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PREFECT")}
    done = subprocess.run(
        [sys.executable, "run.py", "grid.yaml", "flow"],
        cwd=tmp_path,
        env=clean | {"PYTHONPATH": str(SOURCE_ROOT)},
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    facts = json.loads(done.stdout.strip().splitlines()[-1])
    assert facts == {"made": 4, "tasks": ["fan_out", "prepare", "seal"]}
    assert (tmp_path / ".musync" / "prefect").is_dir(), "Prefect keeps to the project's folder"
    plain = generate(str(tmp_path / "grid.yaml"), str(tmp_path / "plain"), runner="threads").layout
    assert (tmp_path / "flow" / "manifest.json").read_bytes() == plain.manifest.read_bytes()
