"""Datasets made again and again: a dated folder a run, an unfinished one resumed, a report where one fails."""

import json
import os
import shlex
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, get_args

from flows.generate import generate
from flows.plan import make_plan, read_plan
from flows.runner import RunnerName
from flows.store.layout import Layout, read_json, write_atomically
from tasks.errors import InputError

SERVER_START_S = 120.0
NOTIFY_TIMEOUT_S = 60.0
REPORTS = "reports"


def dataset_folder(grid: str, root: Path, backend: str, at: datetime) -> Path:
    """Where a run at that time writes: the latest unfinished dataset of the same plan, or a new dated folder.

    An unfinished dataset of another plan (the grid, the catalogue or the code has changed since) is left alone: its
    clips could not be mixed with those made now.

    Parameters
    ----------
    grid : grid file or name
    root : folder of all datasets of the schedule
    backend : rasteriser
    at : scheduled time of the run
    """
    from tasks.render.backend import select_backend

    plan, _ = make_plan(grid, select_backend(backend).name)
    name = plan.settings.name
    for folder in sorted(root.glob(f"{name}-[0-9]*"), reverse=True):
        layout = Layout(folder)
        if (
            layout.plan.is_file()
            and not layout.manifest.is_file()
            and read_plan(folder).run_id == plan.run_id
        ):
            return folder
    return root / f"{name}-{at.astimezone(UTC):%Y%m%dT%H%M%SZ}"


def scheduled_run(
    grid: str,
    root: str,
    *,
    at: datetime,
    runner: RunnerName = "dask",
    workers: int | None = None,
    scheduler: str | None = None,
    backend: str = "auto",
) -> dict[str, Any]:
    """One run of a schedule.

    Parameters
    ----------
    grid, root, at, backend : as for `dataset_folder`
    runner, workers, scheduler : as for generating

    Returns
    -------
    ``dataset``, ``run_id``, ``clips``, ``made``, ``contact_sheet`` and ``verdicts[]``.
    """
    folder = dataset_folder(grid, Path(root), backend, at)
    report = generate(grid, str(folder), runner=runner, workers=workers, scheduler=scheduler, backend=backend)
    clips = read_json(report.layout.manifest)["clips"]
    return {
        "dataset": str(report.layout.root),
        "run_id": report.run_id,
        "clips": report.clips,
        "made": report.made,
        "contact_sheet": str(report.layout.previews / "contact_sheet.png"),
        "verdicts": [
            {
                "clip": clip["label"],
                "passed": clip["verdict"]["passed"],
                "pitch_rmse_deg": clip["verdict"]["pitch_rmse_deg"],
                "stopping_distance_m": clip["figures"]["stopping_distance"],
                "reasons": "; ".join(clip["verdict"]["reasons"]),
            }
            for clip in clips
        ],
    }


def report_failure(grid: str, root: str, at: datetime, error: BaseException, notify: str | None) -> Path:
    """Write what went wrong for people, and tell the notification hook; returns the report.

    Parameters
    ----------
    grid, root, at : of the run
    error : what ended it
    notify : shell-like command, which gets the report's path as its last argument, or an http(s) address, which
        gets JSON; a hook that fails is noted in the report
    """
    path = Path(root) / REPORTS / f"{at.astimezone(UTC):%Y%m%dT%H%M%SZ}.txt"
    facts = {
        "what": "a scheduled muSync run failed",
        "grid": grid,
        "root": root,
        "scheduled": at.astimezone(UTC).isoformat(),
        "error": f"{type(error).__name__}: {error}",
        "next": "committed clips are kept; the next run of the schedule makes what is missing",
    }
    text = "".join(f"{key}: {value}\n" for key, value in facts.items())
    write_atomically(path, text.encode())
    if notify is not None:
        try:
            _notify(notify, path, facts)
        except (OSError, subprocess.SubprocessError) as fault:
            write_atomically(path, (text + f"notification {notify} failed: {fault}\n").encode())
    return path


def _notify(notify: str, report: Path, facts: dict[str, str]) -> None:
    if _is_webhook(notify):
        body = json.dumps(facts | {"report": str(report)}).encode()
        request = urllib.request.Request(notify, body, {"Content-Type": "application/json"})
        urllib.request.urlopen(request, timeout=NOTIFY_TIMEOUT_S).close()
    else:
        subprocess.run([*shlex.split(notify), str(report)], check=True, timeout=NOTIFY_TIMEOUT_S)


def _is_webhook(notify: str) -> bool:
    return notify.startswith(("http://", "https://"))


def checked_parameters(
    grid: str, every: str, out: str, runner: str, workers: int | None, notify: str | None
) -> dict[str, Any]:
    """The parameters of a schedule's runs, with every fault found now and not at three in the morning.

    Raises
    ------
    InputError
        Listing what is wrong with the grid, the cron expression, the folder, the runner and the hook.
    """
    from cronsim import CronSim, CronSimError

    problems: list[str] = []
    try:
        CronSim(every, datetime.now(UTC))
    except CronSimError as error:
        problems.append(f'--every must be a cron expression like "0 3 * * *"; it is {every!r} ({error})')
    try:
        make_plan(grid, "cpu")
    except InputError as error:
        problems += error.problems
    root = Path(out).resolve()
    nearest = next(folder for folder in (root, *root.parents) if folder.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK):
        problems.append(f"--out {out}: must be a folder that can be written; {nearest} cannot")
    if runner not in get_args(RunnerName):
        problems.append(f"--runner must be one of {', '.join(get_args(RunnerName))}; it is {runner}")
    if notify is not None and not _is_webhook(notify):
        words = shlex.split(notify)
        if not words or shutil.which(words[0]) is None:
            problems.append(f"--notify must be an http(s) address or a command that exists; it is {notify!r}")
    if problems:
        raise InputError(problems)
    source = str(Path(grid).resolve()) if Path(grid).suffix in {".yaml", ".yml"} else grid
    return {"grid": source, "root": str(root), "runner": runner, "workers": workers, "notify": notify}


def schedule(
    grid: str,
    *,
    every: str,
    out: str,
    runner: str = "dask",
    workers: int | None = None,
    notify: str | None = None,
) -> None:
    """Serve the generating flow on a schedule from this process, until it is stopped.

    With ``PREFECT_API_URL`` it registers there; else it starts a Prefect server on loopback, and stops it in the end.

    Parameters
    ----------
    grid : grid file or name
    every : cron expression, UTC
    out : folder in which each run makes its dated dataset
    runner, workers : as for generating
    notify : command or http(s) address that is told of a failed run

    Raises
    ------
    InputError
        Listing every parameter that is wrong.
    """
    parameters = checked_parameters(grid, every, out, runner, workers, notify)
    Path(parameters["root"]).mkdir(parents=True, exist_ok=True)
    with _prefect_api():
        from flows.prefect_schedule import serve

        serve(every, parameters)


@contextmanager
def _prefect_api() -> Iterator[None]:
    """A Prefect server for the length of a schedule; the one that ``PREFECT_API_URL`` names where it names one."""
    if "PREFECT_API_URL" in os.environ:
        yield
        return
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    # before Prefect is imported anywhere: it reads its settings then
    os.environ["PREFECT_API_URL"] = f"http://127.0.0.1:{port}/api"
    from flows import prefect_flows  # noqa: F401  (quiets Prefect and puts its home into the project)

    command = [sys.executable, "-m", "prefect", "server", "start", "--host", "127.0.0.1", "--port", str(port)]
    server = subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        _wait_until_healthy(server, f"http://127.0.0.1:{port}/api/health")
        print(f"Prefect's pages: http://127.0.0.1:{port}", file=sys.stderr)
        yield
    finally:
        server.terminate()
        try:
            server.wait(30)
        except subprocess.TimeoutExpired:
            server.kill()
        del os.environ["PREFECT_API_URL"]


def _wait_until_healthy(server: "subprocess.Popen[bytes]", address: str) -> None:
    deadline = time.monotonic() + SERVER_START_S
    while time.monotonic() < deadline:
        if server.poll() is not None:
            raise RuntimeError(
                f"the Prefect server ended with exit code {server.returncode} before it answered"
            )
        try:
            urllib.request.urlopen(address, timeout=2).close()
            return
        except OSError:
            time.sleep(0.3)
    raise RuntimeError(f"the Prefect server did not answer within {SERVER_START_S:g} s")
