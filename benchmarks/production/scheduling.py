"""Time that a Dask scheduler takes for each clip: hundreds of workers in this process, and clips that do nothing."""

import time
from concurrent.futures import Executor
from typing import Any

import psutil
from distributed import Client, LocalCluster

from flows.running.runner import run_unordered
from flows.store.layout import Layout

WORKERS, CALLS = 100, 1500


def do_nothing(layout: Layout, index: int, scene: str) -> dict[str, Any]:
    """Return what a clip returns to its driver, in size."""
    return {"index": index, "content": dict.fromkeys(range(20), "0" * 64), "cost": {"cpu_s": 0.0}}


def measure_scheduling(layout: Layout, workers: int = WORKERS, calls: int = CALLS) -> dict[str, float]:
    """Hand out calls that do nothing through the runner's own loop; a scheduler and all its workers share one core.

    Parameters
    ----------
    layout : that each call carries
    workers, calls : how many [1]

    Returns
    -------
    ``cpu_ms_per_call`` of scheduler, workers and driver together [ms], ``start_cpu_s_per_worker`` [s] and
    ``memory_mib`` of scheduler and workers together [MiB].
    """
    process = psutil.Process()
    before, memory = time.process_time(), process.memory_info().rss
    with (
        LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=40
        ) as cluster,
        Client(cluster) as client,
    ):
        started = time.process_time()
        with client.get_executor(pure=False) as executor:
            count = _count_ended(executor, layout, calls)
        ended = time.process_time()
        used = process.memory_info().rss - memory
    return {
        "calls": count,
        "cpu_ms_per_call": (ended - started) / count * 1e3,
        "start_cpu_s_per_worker": (started - before) / workers,
        "memory_mib": used / 2**20,
    }


def _count_ended(executor: Executor, layout: Layout, calls: int) -> int:
    jobs = ((layout, index, "street") for index in range(calls))
    return sum(future.exception() is None for _, future in run_unordered(executor, do_nothing, jobs))
