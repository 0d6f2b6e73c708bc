"""A run in processes of its own, and a Dask cluster as an administrator starts one, so that any part can be killed."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

Process = subprocess.Popen[bytes]
PATIENCE_S = 60.0
"""How long a cluster may take to start [s]."""


def start_run(grid: Path, folder: Path, scheduler: str | None = None) -> Process:
    """Start a generating run with two workers, or on a cluster.

    Parameters
    ----------
    grid : grid file
    folder : of the dataset
    scheduler : address of a cluster; None starts worker processes of the run's own
    """
    place = ["--scheduler", scheduler] if scheduler else ["--runner", "processes", "--workers", "2"]
    command = [sys.executable, "-m", "flows.cli", "generate", str(grid), "--out", str(folder), *place]
    return _start_process(command)


def list_children(process: Process) -> list[int]:
    """Process ids of a run's workers: the children that run Python for it."""
    found = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    pids = [int(pid) for pid in found.read_text().split()] if found.exists() else []
    return [pid for pid in pids if b"spawn_main" in _command_of(pid)]


def kill_group(process: Process) -> None:
    """Kill a process and all that it started, and wait for it."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


class Cluster:
    """A scheduler and two workers without nannies.

    Parameters
    ----------
    folder : for its files; made here
    """

    def __init__(self, folder: Path):
        folder.mkdir(parents=True)
        file = folder / "scheduler.json"
        dask = [sys.executable, "-m", "dask"]
        self.scheduler = _start_process(
            [
                *dask,
                "scheduler",
                "--port",
                "0",
                "--no-dashboard",
                "--host",
                "127.0.0.1",
                "--scheduler-file",
                str(file),
            ]
        )
        worker = [*dask, "worker", "--scheduler-file", str(file), "--nthreads", "1", "--no-dashboard", "--no-nanny",
                  "--local-directory", str(folder)]  # fmt: skip
        self.workers = [_start_process(worker) for _ in range(2)]
        self.address = _address_in(file)

    @property
    def is_whole(self) -> bool:
        """Whether every part of it lives."""
        return all(process.poll() is None for process in (self.scheduler, *self.workers))

    def stop(self) -> None:
        """Kill whatever lives of it."""
        for process in (*self.workers, self.scheduler):
            kill_group(process)


def _start_process(command: list[str]) -> Process:
    clean = {key: value for key, value in os.environ.items() if key != "PREFECT_API_URL"}
    return subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=clean
    )


def _address_in(file: Path) -> str:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        try:
            return str(json.loads(file.read_text())["address"])
        except (OSError, ValueError, KeyError):
            time.sleep(0.05)
    raise TimeoutError(f"no scheduler came up in {PATIENCE_S:g} s")


def _command_of(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""
