"""A cluster started by others: as processes of their own, held against this machine, and used."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from threading import Thread

import pytest
from distributed import Client, LocalCluster

from flows.making.clip import warm_up
from flows.making.generate import generate_dataset
from flows.running.cluster import (
    TURNED_AWAY,
    check_cluster,
    check_joining,
    facts_here,
    find_version_problems,
    gpu_for,
    warm_cluster,
)
from flows.store.layout import Layout
from tasks.errors import InputError

HERE = {"muSync": "0.1.0", "python": "3.11", "numpy": "2.4.6"}


def test_equal_workers_have_no_problem():
    assert find_version_problems(HERE, {"tcp://a:1": dict(HERE)}) == []


def test_each_difference_is_told_once_with_both_versions_and_the_workers():
    there = {f"tcp://{name}:1": {**HERE, "numpy": "2.3.0"} for name in "abcde"}
    there["tcp://a:1"] = {**HERE, "python": "3.12"}
    assert find_version_problems(HERE, there) == [
        "worker tcp://a:1: python is 3.12 there and 3.11 here: install the same",
        "workers tcp://b:1, tcp://c:1, tcp://d:1 and 1 more: numpy is 2.3.0 there and 2.4.6 here: install the same",
    ]


def test_a_worker_without_musync_is_told():
    (problem,) = find_version_problems(HERE, {"tcp://a:1": ModuleNotFoundError("No module named 'flows'")})
    assert "cannot run muSync" in problem and "install this version there" in problem


def test_what_only_this_machine_needs_is_not_asked_of_workers():
    assert "prefect" not in facts_here() and {"numpy", "numba", "muSync's source"} <= facts_here().keys()


@pytest.mark.parametrize(
    ("place", "visible", "present", "gpu"),
    [
        (0, None, ["0", "1"], "0"),
        (3, None, ["0", "1"], "1"),  # more workers than GPUs share them evenly
        (1, "2,3", ["0", "1", "2", "3"], "3"),  # what the administrator left visible
        (1, "GPU-8f2e", ["0", "1"], None),  # given its own by Slurm or dask-cuda
        (1, "", ["0", "1"], None),  # told to use none
        (1, None, [], None),
        (1, None, ["0"], None),
    ],
)
def test_workers_of_one_machine_take_its_gpus_in_turn(place, visible, present, gpu):
    assert gpu_for(place, visible, present) == gpu


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen]]]:
    """A scheduler and workers, each a process of its own, as an administrator starts them."""
    folder.mkdir(exist_ok=True)
    file, log = folder / "scheduler.json", (folder / "log").open("w")
    dask = [sys.executable, "-m", "dask"]
    parts = [
        [*dask, "scheduler", "--port", "0", "--no-dashboard", "--host", "127.0.0.1", "--scheduler-file", str(file)],
        *[[*dask, "worker", "--scheduler-file", str(file), "--nthreads", "1", "--no-dashboard", "--no-nanny",
           "--local-directory", str(folder), "--name", str(number)] for number in range(workers)],
    ]  # fmt: skip
    running = [
        subprocess.Popen(part, cwd=folder, stdout=log, stderr=log, start_new_session=True) for part in parts
    ]
    try:
        yield address_in(file), running[1:]
    finally:
        for process in reversed(running):
            process.terminate()
            process.wait(timeout=20)


def address_in(file: Path) -> str:
    for _ in range(400):
        if file.is_file() and file.stat().st_size:
            address: str = json.loads(file.read_text())["address"]
            return address
        time.sleep(0.1)
    raise TimeoutError("no scheduler came up in 40 s")


@pytest.mark.minutes
def test_a_worker_killed_in_the_middle_changes_no_byte(toy_dataset, tmp_path):
    layout = Layout(tmp_path / "data")
    told: dict[str, int] = {}

    def kill_one_when_a_clip_is_there(worker: subprocess.Popen) -> None:
        while not (done := len(list(layout.staging.glob("*.json")))):
            time.sleep(0.01)
        os.kill(worker.pid, signal.SIGKILL)
        told["clips"] = done

    with cluster(tmp_path / "cluster", 2) as (address, workers):
        with Client(address) as client:
            client.wait_for_workers(2, timeout=60)
        watcher = Thread(target=kill_one_when_a_clip_is_there, args=workers[:1], daemon=True)
        watcher.start()
        made = generate_dataset(
            str(toy_dataset.root.parent / "grid.yaml"), str(layout.root), scheduler=address
        )
        assert workers[0].wait(5) == -signal.SIGKILL and workers[1].poll() is None
    assert told["clips"] < made.made == 4
    assert layout.manifest.read_bytes() == toy_dataset.manifest.read_bytes()


def test_a_worker_that_dies_while_it_compiles_is_passed_over(tmp_path):
    mark = tmp_path / "ended"

    def end_the_first() -> None:
        with suppress(FileExistsError):
            mark.mkdir()
            os._exit(1)

    with cluster(tmp_path / "cluster", 2) as (address, workers), Client(address) as client:
        client.wait_for_workers(2, timeout=60)
        warm_cluster(client, end_the_first, address)
        assert mark.is_dir() and [worker.poll() for worker in workers].count(None) == 1


@pytest.fixture
def local():
    """A scheduler in this process."""
    with LocalCluster(n_workers=0, processes=False, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster


def test_a_worker_that_does_not_see_the_folder_is_told(local):
    local.scale(1)
    with Client(local) as client:
        client.wait_for_workers(1, timeout=30)
        with pytest.raises(InputError, match="must be visible on every worker under the same path"):
            warm_cluster(
                client, partial(warm_up, Layout(Path("/nowhere/at/all")), "street"), local.scheduler_address
            )


def test_a_cluster_without_workers_is_refused(local):
    with Client(local) as client, pytest.raises(InputError, match="has no workers"):
        check_cluster(client, local.scheduler_address)


def test_a_worker_that_joins_a_run_with_another_version_is_turned_away_before_it_works(
    local, monkeypatch, capsys
):
    local.scale(1)
    address, own = local.scheduler_address, facts_here()
    with Client(local) as client:
        client.wait_for_workers(1, timeout=30)
        with check_joining(client, address):
            (first,) = client.run(os.getpid)
            monkeypatch.setattr("flows.running.cluster.facts_here", lambda: own | {"numpy": "1.0"})
            calls = client.map(time.sleep, [0.05] * 60, pure=False)
            local.scale(2)
            for _ in range(200):
                if client.get_events(TURNED_AWAY):
                    break
                time.sleep(0.05)
            assert not all(call.done() for call in calls)
            client.gather(calls)
            assert {tuple(workers) for workers in client.who_has(calls).values()} == {(first,)}
    told = capsys.readouterr().err
    assert f"numpy is 1.0 there and {own['numpy']} here: install the same; it was turned away" in told
    assert told.startswith(f"--scheduler {address}: worker ") and told.count("turned away") == 1
