"""A Dask scheduler's share of each clip: it and the driver in this process, hundreds of workers in another.

The workers are Dask's own, each with a thread that sleeps for as long as a clip would take. They answer, transfer and
send heartbeats as ever; what samples a process (profiler, monitors of the system and of memory) is off, because
hundreds of them share one here.
"""

import asyncio
import logging
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from multiprocessing import get_context
from tempfile import TemporaryDirectory
from typing import Any

import dask
import psutil
from distributed import Client, LocalCluster, Worker

from flows.running.runner import run_unordered
from flows.store.layout import Layout

WORKERS, CALLS, CLIP_S = 500, 3000, 20.0
STARTED_AT_ONCE = 20
OF_THEIR_PROCESS = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.interval": "1 h",
    "distributed.admin.tick.interval": "1 h",
}


def wait_out_clip(layout: Layout, index: int, seconds: float) -> dict[str, Any]:
    """Return what a clip returns to its driver, in size, after as long as it takes to make."""
    time.sleep(seconds)
    return {"index": index, "content": dict.fromkeys(range(20), "0" * 64), "cost": {"cpu_s": 0.0}}


def measure_scheduling(
    layout: Layout, workers: int = WORKERS, calls: int = CALLS, clip_s: float = CLIP_S
) -> dict[str, float]:
    """Hand out calls that wait, through the runner's own loop.

    Parameters
    ----------
    layout : that each call carries
    workers, calls : how many [1]
    clip_s : that each call takes [s]

    Returns
    -------
    ``cpu_ms_per_call`` of scheduler and driver [ms], ``busy`` share of the time for which workers had a call, from the
    first call to the last [1], ``start_cpu_s`` of the scheduler for the workers to register [s] and ``memory_mib`` of
    scheduler and driver [MiB].
    """
    process = psutil.Process()
    before, memory = time.process_time(), process.memory_info().rss
    with (
        LocalCluster(n_workers=0, processes=False, dashboard_address=None, silence_logs=40, protocol="tcp") as cluster,
        _start_workers(cluster.scheduler_address, workers),
        Client(cluster) as client,
    ):  # fmt: skip
        client.wait_for_workers(workers)
        started, began = time.process_time(), time.perf_counter()
        with client.get_executor(pure=False) as executor:
            count = _count_ended(executor, layout, calls, clip_s)
        ended, wall_s = time.process_time(), time.perf_counter() - began
        used = process.memory_info().rss - memory
    return {
        "calls": count,
        "cpu_ms_per_call": (ended - started) / count * 1e3,
        "busy": count * clip_s / (workers * wall_s),
        "start_cpu_s": started - before,
        "memory_mib": used / 2**20,
    }


def _count_ended(executor: Executor, layout: Layout, calls: int, clip_s: float) -> int:
    jobs = ((layout, index, clip_s) for index in range(calls))
    return sum(future.exception() is None for _, future in run_unordered(executor, wait_out_clip, jobs))


@contextmanager
def _start_workers(scheduler: str, count: int) -> Iterator[None]:
    process = get_context("spawn").Process(target=_serve_workers, args=(scheduler, count), daemon=True)
    process.start()
    try:
        yield
    finally:
        process.kill()
        process.join()


def _serve_workers(scheduler: str, count: int) -> None:
    logging.getLogger("distributed").setLevel(logging.ERROR)
    with dask.config.set(OF_THEIR_PROCESS), TemporaryDirectory() as folder:
        asyncio.run(_run_workers(scheduler, count, folder))


async def _run_workers(scheduler: str, count: int, folder: str) -> None:
    workers = [
        Worker(scheduler, nthreads=1, name=str(number), memory_limit=0, local_directory=folder)
        for number in range(count)
    ]
    for first in range(0, count, STARTED_AT_ONCE):
        await asyncio.gather(*workers[first : first + STARTED_AT_ONCE])
    await asyncio.gather(*(worker.finished() for worker in workers))
