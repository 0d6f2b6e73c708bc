"""Datasets made again and again: a dated place a run, an unfinished one resumed, parameters checked beforehand."""

import os
import re
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

from catalogs.documents import parse_json
from flows.making.generate import generate_dataset
from flows.making.plan import make_plan
from flows.running.runner import RunnerName
from flows.scheduled.failure_report import format_stamp, is_webhook
from flows.store.address import PREPARED
from flows.store.layout import Layout
from flows.store.objects import Objects, is_address
from flows.store.sealed import read_manifest
from flows.store.staging import BEGUN
from tasks.errors import InputError

SERVER_START_S = 120.0


NO_PLAN = ""
"""In place of a run's id: a run that stopped so early that nothing binds its place to a grid."""


def dataset_place(grid: str, root: str, backend: str, at: datetime) -> str:
    """Where a run at that time writes: the latest unfinished dataset of the same plan, or a new dated one.

    An unfinished dataset of another plan (the grid, the catalogue or the code has changed since) is left alone: its
    clips could not be mixed with those made now.

    Parameters
    ----------
    grid : grid file or name
    root : folder of all datasets of the schedule, or address in an object store
    backend : rasteriser
    at : scheduled time of the run
    """
    from tasks.render.rasterise.backend import select_backend

    plan, _ = make_plan(grid, select_backend(backend).name)
    name = plan.settings.name
    begun = _begun_in_store if is_address(root) else _begun_in_folder
    for place, run_id in begun(root, re.compile(rf"{re.escape(name)}-\d{{8}}T\d{{6}}Z")):
        if run_id in {plan.run_id, NO_PLAN}:
            return place
    return f"{root}/{name}-{format_stamp(at)}"


def _begun_in_folder(root: str, dated: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    """Unfinished datasets and their run ids, the latest first."""
    folders = [path for path in Path(root).glob("*") if dated.fullmatch(path.name)]
    for folder in sorted(folders, reverse=True):
        layout = Layout(folder)
        if (layout.staging / BEGUN).is_file() and not layout.plan.is_file():
            yield str(folder), NO_PLAN
        if layout.plan.is_file() and not layout.manifest.is_file():
            run_id = _run_id(layout.plan.read_bytes(), layout.plan)
            if run_id is not None:
                yield str(folder), run_id


def _begun_in_store(root: str, dated: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    for name in sorted(filter(dated.fullmatch, Objects(root).folders()), reverse=True):
        objects = Objects(f"{root}/{name}")
        plan = objects.read("plan.json")
        if plan is None and all(name.startswith(PREPARED) for name in objects.sizes()):
            yield objects.address, NO_PLAN
        if plan is not None and objects.tag("manifest.json") is None:
            run_id = _run_id(plan, objects.address)
            if run_id is not None:
                yield objects.address, run_id


def _run_id(plan: bytes, place: object) -> str | None:
    """Of a plan; None where it is damaged, so that there is nothing to go on with."""
    try:
        content = parse_json(plan, place, "plan")
    except InputError:
        return None
    run_id = content.get("run_id") if isinstance(content, dict) else None
    return run_id if isinstance(run_id, str) else None


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
    grid, root, at, backend : as for `dataset_place`
    runner, workers, scheduler : as for generating

    Returns
    -------
    ``dataset``, ``run_id``, ``clips``, ``made``, ``contact_sheet`` and ``verdicts[]``.
    """
    place = dataset_place(grid, root, backend, at)
    report = generate_dataset(
        grid, place, runner=runner, workers=workers, scheduler=scheduler, backend=backend
    )
    clips = read_manifest(report.layout)["clips"]
    return {
        "dataset": str(report.layout),
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


def checked_parameters(
    grid: str,
    every: str,
    out: str,
    runner: str,
    workers: int | None,
    notify: str | None,
    scheduler: str | None = None,
) -> dict[str, Any]:
    """The parameters of a schedule's runs, with every fault found now and not at three in the morning.

    Raises
    ------
    InputError
        Listing what is wrong with the grid, the cron expression, the folder or address, the runner, the scheduler and
        the hook.
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
    root = out.rstrip("/") if is_address(out) else str(Path(out).resolve())
    problems += _place_problems(out)
    if runner not in get_args(RunnerName):
        problems.append(f"--runner must be one of {', '.join(get_args(RunnerName))}; it is {runner}")
    if scheduler is not None and runner != "dask":
        problems.append(f"--scheduler {scheduler} belongs to --runner dask; the runner is {runner}")
    if scheduler is not None and not re.fullmatch(r"(tcp|tls)://[^/]+:\d+", scheduler):
        problems.append(f"--scheduler must be like tcp://host:8786 or tls://host:8786; it is {scheduler!r}")
    if notify is not None and not is_webhook(notify):
        try:
            words = shlex.split(notify)
        except ValueError:  # a quotation that does not end
            words = []
        if not words or shutil.which(words[0]) is None:
            problems.append(f"--notify must be an http(s) address or a command that exists; it is {notify!r}")
    if problems:
        raise InputError(problems)
    source = str(Path(grid).resolve()) if Path(grid).suffix in {".yaml", ".yml"} else grid
    return {
        "grid": source,
        "root": root,
        "runner": runner,
        "workers": workers,
        "scheduler": scheduler,
        "notify": notify,
    }


def _place_problems(out: str) -> list[str]:
    if is_address(out):
        try:
            Objects(out).folders()
        except InputError as error:
            return [f"--out {problem}" for problem in error.problems]
        return []
    root = Path(out).resolve()
    nearest = next(folder for folder in (root, *root.parents) if folder.exists())
    if nearest.is_dir() and os.access(nearest, os.W_OK):
        return []
    return [f"--out {out}: must be a folder that can be written; {nearest} cannot"]


def serve_grid(
    grid: str,
    *,
    every: str,
    out: str,
    runner: str = "dask",
    workers: int | None = None,
    scheduler: str | None = None,
    notify: str | None = None,
) -> None:
    """Serve the generating flow on a schedule from this process, until it is stopped.

    With ``PREFECT_API_URL`` it registers there; else it starts a Prefect server on loopback, and stops it in the end.

    Parameters
    ----------
    grid : grid file or name
    every : cron expression, UTC
    out : folder, or address in an object store, in which each run makes its dated dataset
    runner, workers, scheduler : as for generating
    notify : command or http(s) address that is told of a failed run

    Raises
    ------
    InputError
        Listing every parameter that is wrong.
    """
    parameters = checked_parameters(grid, every, out, runner, workers, notify, scheduler)
    if not is_address(out):
        Path(out).mkdir(parents=True, exist_ok=True)
    with _prefect_api():
        from flows.scheduled.prefect_schedule import serve_schedule

        serve_schedule(every, parameters)


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
            urllib.request.urlopen(address, timeout=2).close()  # noqa: S310  (our own server on loopback)
            return
        except OSError:
            time.sleep(0.3)
    raise RuntimeError(f"the Prefect server did not answer within {SERVER_START_S:g} s")
