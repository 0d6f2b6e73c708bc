"""From measured constants to what a large dataset takes: time, memory, files, requests and money.

Requests are counted by a server on loopback, on clips of telemetry alone. The scheduler's share of each clip is
measured with Dask's own scheduler in this process and hundreds of its workers in another.
"""

import asyncio
import logging
import os
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import dask
import psutil
import yaml
from distributed import Client, LocalCluster, Worker

from flows.making.generate import generate_dataset
from flows.running.runner import IN_FLIGHT, run_unordered
from flows.store.layout import Layout
from studies.scale.copies import grid_of
from tasks.errors import InputError

Row = tuple[str, float, str]
"""Name, value and unit."""
SECONDS_PER_HOUR = 3600
CLIPS = 200
WORKERS, CALLS, CLIP_S = 500, 3000, 20.0
STARTED_AT_ONCE = 20
OF_THEIR_PROCESS = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.interval": "1 h",
    "distributed.admin.tick.interval": "1 h",
}


@dataclass(frozen=True, kw_only=True)
class ClipCosts:
    """Cost of one clip; the defaults are of 81 frames at 480 x 320 on the built-in street (docs/how-to).

    Parameters
    ----------
    cpu_s : of a worker that makes it [s]
    gather_cpu_s : of a worker that gathers its tables with those of others [s]
    driver_cpu_s : of the driver, planning and sealing [s]
    scheduler_cpu_s : of scheduler and driver, handing it out [s]
    frames_bytes, tables_bytes : stored [B]
    manifest_bytes : of its record in the manifest [B]
    files : that stay [1]
    puts, gets : requests to an object store while it is made and sealed [1]
    """

    cpu_s: float = 11.2
    gather_cpu_s: float = 0.012
    driver_cpu_s: float = 0.0015
    scheduler_cpu_s: float = 0.0062
    frames_bytes: float = 29.9e6
    tables_bytes: float = 0.54e6
    manifest_bytes: float = 2000
    files: float = 3.02
    puts: float = 6.02
    gets: float = 3.0


RECIPES = ClipCosts(cpu_s=0.1, frames_bytes=0.0, manifest_bytes=1500, files=0.02, puts=3.02)
"""Of clips whose frames are made when they are read."""


@dataclass(frozen=True, kw_only=True)
class Prices:
    """List prices in dollars.

    Parameters
    ----------
    core_hour : of one virtual core with 4 GB
    put_per_thousand, get_per_thousand : of requests
    gigabyte_month : stored
    """

    core_hour: float = 0.0408
    put_per_thousand: float = 0.005
    get_per_thousand: float = 0.0004
    gigabyte_month: float = 0.023


def plan_production(
    clips: int, workers: int, most_clips: int, costs: ClipCosts | None = None, prices: Prices | None = None
) -> Iterator[Row]:
    """Yield what a production takes, a row at a time.

    Parameters
    ----------
    clips, workers : of the production [1]
    most_clips : of one grid [1]
    costs, prices : None takes the defaults

    Raises
    ------
    InputError
        If there is no clip, no worker, or a clip takes no time.
    """
    c, p = costs or ClipCosts(), prices or Prices()
    asked = {"--clips": clips, "--workers": workers, "--cpu-s": c.cpu_s}
    if wrong := [
        f"{name} must be more than 0; it is {value:g}" for name, value in asked.items() if not value > 0
    ]:
        raise InputError(wrong)
    work_s = clips * (c.cpu_s + c.gather_cpu_s)
    making_s, driver_s = work_s / workers, clips * (c.driver_cpu_s + c.scheduler_cpu_s)
    size = clips * (c.frames_bytes + c.tables_bytes)
    requests = clips * (c.puts * p.put_per_thousand + c.gets * p.get_per_thousand) / 1000
    yield "datasets, one a grid", ceil(clips / most_clips), "1"
    yield "clips handed out a second", clips / making_s, "1/s"
    yield "workers' time", work_s / SECONDS_PER_HOUR, "CPU-h"
    yield "making, all workers busy", making_s / SECONDS_PER_HOUR, "h"
    yield "driver and scheduler", driver_s / SECONDS_PER_HOUR, "CPU-h"
    yield "workers that one driver keeps busy", min(c.cpu_s / c.scheduler_cpu_s, IN_FLIGHT), "1"
    yield "stored", size / 1e12, "TB"
    yield "written a second", size / making_s / 1e6, "MB/s"
    yield "manifest of one dataset", min(clips, most_clips) * c.manifest_bytes / 1e6, "MB"
    yield "files", clips * c.files / 1e6, "million"
    yield "requests to a store", clips * (c.puts + c.gets) / 1e6, "million"
    yield "requests a second", clips * (c.puts + c.gets) / making_s, "1/s"
    yield "cores", work_s / SECONDS_PER_HOUR * p.core_hour, "$"
    yield "requests", requests, "$"
    yield "a month of storage", size / 1e9 * p.gigabyte_month, "$"


class _Counting(logging.Handler):
    """Counts the requests that the server logs, by their method."""

    def __init__(self) -> None:
        super().__init__()
        self.methods: Counter[str] = Counter()

    def emit(self, record: logging.LogRecord) -> None:
        for method in ("PUT", "GET", "POST", "DELETE", "HEAD"):
            if f'"{method} /' in record.getMessage():
                self.methods[method] += 1


def count_requests(clips: int = CLIPS) -> dict[str, float]:
    """Requests a clip by method [1], those of the run as a whole among them."""
    import boto3
    from moto.server import ThreadedMotoServer

    server, counting = ThreadedMotoServer(port=0), _Counting()
    log = logging.getLogger("werkzeug")
    log.setLevel(logging.INFO)
    log.addHandler(counting)
    server.start()
    host, port = server.get_host_and_port()
    address = f"http://{host}:{port}"
    with tempfile.TemporaryDirectory() as folder:
        variables = {
            "AWS_ENDPOINT_URL": address,
            "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": "somebody",
            "AWS_SECRET_ACCESS_KEY": "secret",
        }
        grid = Path(folder) / "grid.yaml"
        grid.write_text(yaml.safe_dump(grid_of(clips), sort_keys=False))
        with patch.dict(os.environ, variables):
            boto3.client("s3").create_bucket(Bucket="data")
            counting.methods.clear()
            report = generate_dataset(
                str(grid), "s3://data/sets/counted", runner="threads", workers=1, pictures=False
            )
    server.stop()
    return {method: count / report.clips for method, count in counting.methods.items()}


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
