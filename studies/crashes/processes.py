"""A run in processes of its own, and a Dask cluster as an administrator starts one, so that any part can be killed."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

Process = subprocess.Popen[bytes]
MUSYNC = (sys.executable, "-m", "flows.cli")
PATIENCE_S = 60.0
"""How long a cluster may take to start [s]."""


def start_run(
    grid: Path,
    folder: Path,
    scheduler: str | None = None,
    *options: str,
    settings: Mapping[str, str] | None = None,
) -> Process:
    """Start a generating run with two workers, or on a cluster.

    Parameters
    ----------
    grid : grid file
    folder : of the dataset
    scheduler : address of a cluster; None starts worker processes of the run's own
    options : further ones of the command
    settings : further variables of its environment
    """
    place = ["--scheduler", scheduler] if scheduler else ["--runner", "processes", "--workers", "2"]
    return _start_process([*MUSYNC, *_generate(grid, folder), *place, *options], settings)


def finish_command(*words: str, before: Callable[[], object] | None = None) -> tuple[int, str]:
    """Run a command; return its exit code and what it said on its error stream.

    Parameters
    ----------
    words : of the command, without ``musync``
    before : what its process does first
    """
    command = [*MUSYNC, *words]
    done = subprocess.run(command, capture_output=True, text=True, env=_clean(), preexec_fn=before)
    return done.returncode, done.stderr


def finish_run(
    grid: Path, folder: Path, *options: str, before: Callable[[], object] | None = None
) -> tuple[int, str]:
    """Make a dataset in threads, as `finish_command` does.

    Parameters
    ----------
    grid : grid file
    folder : of the dataset
    options : further ones of the command
    before : what its process does first
    """
    return finish_command(*_generate(grid, folder), "--runner", "threads", *options, before=before)


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


def _generate(grid: Path, folder: Path) -> list[str]:
    return ["generate", str(grid), "--out", str(folder)]


def _clean() -> dict[str, str]:
    return {key: value for key, value in os.environ.items() if key != "PREFECT_API_URL"}


def _start_process(command: list[str], settings: Mapping[str, str] | None = None) -> Process:
    return subprocess.Popen(
        command,
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=_clean() | dict(settings or {}),
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
