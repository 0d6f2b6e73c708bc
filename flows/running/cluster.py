"""A Dask cluster that others started: do its workers compute as this machine does, and are their kernels compiled?"""

import asyncio
import os
import re
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from distributed import WorkerPlugin
from distributed.comm import CommClosedError
from distributed.core import Status

from flows.running.terminal import print_lines
from manifests.provenance import code_version, library_versions
from tasks.errors import InputError

NOT_ON_WORKERS = ("prefect",)
"""Recorded libraries that no worker imports."""
SHOWN_WORKERS = 3
VISIBLE = "CUDA_VISIBLE_DEVICES"
TURNED_AWAY = "musync-turned-away"
"""Dask's topic of events about workers that joined a run and may not work for it."""


def facts_here() -> dict[str, str]:
    """Return the facts that must be equal on every machine that makes a dataset: its manifest records one of each."""
    code, libraries = code_version(), library_versions()
    libraries["python"] = libraries["python"].rpartition(".")[0]
    kept = {name: version for name, version in libraries.items() if name not in NOT_ON_WORKERS}
    return {"muSync": code["version"], "muSync's source": code["source_sha256"][:12]} | kept


def find_version_problems(
    here: Mapping[str, str], there: Mapping[str, Mapping[str, str] | BaseException]
) -> list[str]:
    """How workers differ from this machine, workers with one difference in one sentence.

    Parameters
    ----------
    here : `facts_here` of this machine
    there : the same of each worker by its address, or what asking it raised
    """
    found: dict[str, list[str]] = {}
    for address, facts in there.items():
        if isinstance(facts, BaseException):
            found.setdefault(
                f"cannot run muSync ({type(facts).__name__}: {facts}): install this version there", []
            ).append(address)
            continue
        for name, version in here.items():
            if facts.get(name) != version:
                sentence = f"{name} is {facts.get(name, 'absent')} there and {version} here: install the same"
                found.setdefault(sentence, []).append(address)
    return [f"{_name_some(addresses)}: {sentence}" for sentence, addresses in found.items()]


def check_cluster(client: Any, address: str) -> None:
    """Refuse a cluster without workers, or with workers that are not set up like this machine.

    Parameters
    ----------
    client : `distributed.Client` of the cluster
    address : of its scheduler

    Raises
    ------
    InputError
        Listing every difference.
    """
    if not client.scheduler_info(n_workers=-1)["workers"]:
        raise InputError(
            f"--scheduler {address}: the cluster has no workers: start some and run the command again"
        )
    problems = find_version_problems(facts_here(), client.run(facts_here, on_error="return"))
    if problems:
        raise InputError([f"--scheduler {address}: {problem}" for problem in problems])


@contextmanager
def check_joining(client: Any, address: str) -> Iterator[None]:
    """Turn away workers that join while a run goes on and are not set up like this machine, and print why.

    Clusters replace workers and grow (`SLURMCluster.adapt`, a pod that starts again); what came later computes as well.

    Parameters
    ----------
    client : `distributed.Client` of the cluster
    address : of its scheduler
    """
    check = JoiningCheck(facts_here())
    seen = set(client.get_events(TURNED_AWAY))

    def report(event: tuple[float, str]) -> None:
        if event not in seen:
            seen.add(event)
            print_lines(f"--scheduler {address}: {event[1]}", error=True)

    client.subscribe_topic(TURNED_AWAY, report)
    client.register_plugin(check)
    try:
        yield
    finally:
        client.unregister_worker_plugin(check.name)
        client.unsubscribe_topic(TURNED_AWAY)
        # the scheduler keeps what it could not deliver in time
        for event in client.get_events(TURNED_AWAY):
            report(event)


class JoiningCheck(WorkerPlugin):
    """Makes a worker leave its cluster, before it is given work, where it is not set up like the driver.

    Parameters
    ----------
    here : `facts_here` of the driver's machine
    """

    name = "musync-joining-check"

    def __init__(self, here: Mapping[str, str]):
        self.here = here

    async def setup(self, worker: Any) -> None:
        """Hold the worker's facts against the driver's, and have the scheduler report each difference."""
        problems = find_version_problems(self.here, {worker.address: facts_here()})
        if problems:
            worker.status = Status.closing_gracefully  # begins nothing from here on
            for problem in problems:
                # a call with an answer: what a worker sends on the side is lost where it closes
                await worker.scheduler.log_event(topic=TURNED_AWAY, msg=f"{problem}; it was turned away")
            await worker.scheduler.retire_workers(workers=[worker.address], close_workers=False, remove=True)
            # not from here: a worker that closes while it registers stays half open
            worker.loop.add_callback(worker.close, reason="it is not set up like the driver")


def share_gpus(client: Any) -> None:
    """Give every worker one GPU of its machine, in turn, before anything on it looks for one.

    Parameters
    ----------
    client : `distributed.Client` of the cluster
    """
    indices = {worker: index for workers in _by_host(client).values() for index, worker in enumerate(workers)}
    client.run(_take_gpu, indices)


def gpu_for(index: int, visible: str | None, present: Sequence[str]) -> str | None:
    """Return the GPU of a worker; None where Slurm or dask-cuda has already assigned one.

    Parameters
    ----------
    index : of the worker among those of its machine, from 0
    visible : ``CUDA_VISIBLE_DEVICES`` of the worker, None where it is not set
    present : GPUs of the machine
    """
    choice = list(present) if visible is None else [name for name in visible.split(",") if name]
    return choice[index % len(choice)] if len(choice) > 1 else None


def _take_gpu(indices: Mapping[str, int], dask_worker: Any) -> None:
    present = sorted(re.findall(r"^nvidia(\d+)$", "\n".join(os.listdir("/dev")), flags=re.M), key=int)
    chosen = gpu_for(indices[dask_worker.address], os.environ.get(VISIBLE), present)
    if chosen is not None:
        os.environ[VISIBLE] = chosen


def _by_host(client: Any) -> dict[str, list[str]]:
    """Workers of each machine, in the order of their addresses."""
    hosts: dict[str, list[str]] = {}
    for worker, host in sorted(client.run(socket.gethostname, on_error="ignore").items()):
        hosts.setdefault(host, []).append(worker)
    return hosts


def warm_cluster(client: Any, warm: Callable[[], Any], address: str) -> None:
    """Compile every kernel on each worker before work is handed out: one worker a machine first, whose cache all share.

    Parameters
    ----------
    client : `distributed.Client` of the cluster
    warm : compiles and loads what a clip needs
    address : of its scheduler

    A worker that dies meanwhile is passed over: the scheduler gives it no work.

    Raises
    ------
    InputError
        If a worker cannot read what it needs, the dataset's folder above all.
    """
    hosts = _by_host(client)
    first = [workers[0] for workers in hosts.values()]
    rest = [worker for workers in hosts.values() for worker in workers[1:]]
    for wave in (first, rest):
        # not as tasks: one that is bound to a worker that dies waits for it for ever
        answers = client.run(_call_in_thread, warm, workers=wave, on_error="return") if wave else {}
        for worker, error in answers.items():
            if isinstance(error, InputError | OSError) and not isinstance(error, CommClosedError):
                raise InputError(
                    f"--scheduler {address}: worker {worker} cannot begin ({error}): the dataset's folder and the scene"
                    " must be visible on every worker under the same path"
                )
            if isinstance(error, Exception) and not isinstance(error, CommClosedError):
                raise error


async def _call_in_thread(function: Callable[[], Any]) -> None:
    """Call a function beside a worker's event loop, which goes on telling the scheduler that the worker lives."""
    await asyncio.to_thread(function)


def _name_some(addresses: list[str]) -> str:
    shown = ", ".join(addresses[:SHOWN_WORKERS])
    rest = len(addresses) - SHOWN_WORKERS
    return f"workers {shown} and {rest} more" if rest > 0 else f"worker {shown}"
