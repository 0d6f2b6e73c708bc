"""A cluster started by others: as processes of their own, held against this machine, and used."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from flows.cluster import check_cluster, facts_here, version_problems, warm_cluster
from flows.generate import generate
from flows.store.layout import Layout
from tasks.errors import InputError

HERE = {"muSync": "0.1.0", "python": "3.11", "numpy": "2.4.6"}


def test_equal_workers_have_no_problem():
    assert version_problems(HERE, {"tcp://a:1": dict(HERE)}) == []


def test_each_difference_is_told_once_with_both_versions_and_the_workers():
    there = {f"tcp://{name}:1": {**HERE, "numpy": "2.3.0"} for name in "abcde"}
    there["tcp://a:1"] = {**HERE, "python": "3.12"}
    assert version_problems(HERE, there) == [
        "worker tcp://a:1: python is 3.12 there and 3.11 here: install the same",
        "workers tcp://b:1, tcp://c:1, tcp://d:1 and 1 more: numpy is 2.3.0 there and 2.4.6 here: install the same",
    ]


def test_a_worker_without_musync_is_told():
    (problem,) = version_problems(HERE, {"tcp://a:1": ModuleNotFoundError("No module named 'flows'")})
    assert "cannot run muSync" in problem and "install this version there" in problem


def test_what_only_this_machine_needs_is_not_asked_of_workers():
    assert "prefect" not in facts_here() and {"numpy", "numba", "muSync's source"} <= facts_here().keys()


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """A scheduler and a worker, each a process of its own, as an administrator starts them."""
    folder = tmp_path_factory.mktemp("cluster")
    file, log = folder / "scheduler.json", (folder / "log").open("w")
    dask = [sys.executable, "-m", "dask"]
    parts = [
        [*dask, "scheduler", "--port", "0", "--no-dashboard", "--host", "127.0.0.1", "--scheduler-file", str(file)],
        [*dask, "worker", "--scheduler-file", str(file), "--nthreads", "1", "--no-dashboard", "--no-nanny",
         "--local-directory", str(folder)],
    ]  # fmt: skip
    running = [
        subprocess.Popen(part, cwd=folder, stdout=log, stderr=log, start_new_session=True) for part in parts
    ]
    try:
        yield address_in(file)
    finally:
        for process in reversed(running):
            process.terminate()
            process.wait(timeout=20)


def address_in(file: Path) -> str:
    import json

    for _ in range(200):
        if file.is_file() and file.stat().st_size:
            address: str = json.loads(file.read_text())["address"]
            return address
        time.sleep(0.1)
    raise TimeoutError("no scheduler came up in 20 s")


def test_the_bytes_made_on_a_cluster_are_those_made_here(toy_dataset, scheduler, tmp_path):
    from distributed import Client

    with Client(scheduler) as client:
        client.wait_for_workers(1, timeout=30)
    grid = str(toy_dataset.root.parent / "grid.yaml")
    made = generate(grid, str(tmp_path / "data"), scheduler=scheduler)
    assert made.made == 4
    assert made.layout.manifest.read_bytes() == toy_dataset.manifest.read_bytes()


def test_a_worker_that_does_not_see_the_folder_is_told(scheduler):
    from functools import partial

    from distributed import Client

    from flows.clip import warm_up

    with Client(scheduler) as client:
        client.wait_for_workers(1, timeout=30)
        with pytest.raises(InputError, match="must be visible on every worker under the same path"):
            warm_cluster(client, partial(warm_up, Layout(Path("/nowhere/at/all"))), scheduler)


def test_a_cluster_without_workers_is_refused(tmp_path):
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=0, processes=False, dashboard_address=None) as cluster,
        Client(cluster) as client,
        pytest.raises(InputError, match="has no workers"),
    ):
        check_cluster(client, cluster.scheduler_address)
