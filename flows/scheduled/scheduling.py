"""Datasets made again and again: a dated folder a run, an unfinished one resumed, parameters checked beforehand."""

import os
import re
import signal
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from time import process_time
from typing import Any

from flows.making.generate import generate_dataset
from flows.making.plan import make_plan
from flows.running.prefect_server import prefect_api
from flows.running.runner import RunnerName, list_runner_problems
from flows.scheduled.failure_report import format_stamp
from flows.scheduled.notification import EVENTS, WHEN_NONE_IS_NAMED, notify_problem
from flows.scheduled.retention import dated
from flows.scheduled.run_record import find_run_id, keep_record
from flows.store.address import PREPARED, stored_bytes
from flows.store.layout import Layout
from flows.store.objects import Objects, is_address
from flows.store.sealed import read_manifest
from flows.store.staging import BEGUN
from tasks.errors import InputError

NO_PLAN = ""
"""In place of a run's id: a run that stopped so early that nothing binds its folder to a grid."""


def choose_dataset(grid: str, root: str, backend: str, at: datetime) -> str:
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
    for dataset, run_id in begun(root, dated(name)):
        if run_id in {plan.run_id, NO_PLAN}:
            return dataset
    return f"{root}/{name}-{format_stamp(at)}"


def _begun_in_folder(root: str, dated: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    """Unfinished datasets and their run ids, the latest first."""
    folders = [path for path in Path(root).glob("*") if dated.fullmatch(path.name)]
    for folder in sorted(folders, reverse=True):
        layout = Layout(folder)
        if (layout.staging / BEGUN).is_file() and not layout.plan.is_file():
            yield str(folder), NO_PLAN
        if layout.plan.is_file() and not layout.manifest.is_file():
            run_id = find_run_id(layout.plan.read_bytes(), layout.plan)
            if run_id is not None:
                yield str(folder), run_id


def _begun_in_store(root: str, dated: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    for name in sorted(filter(dated.fullmatch, Objects(root).folders()), reverse=True):
        objects = Objects(f"{root}/{name}")
        plan = objects.read("plan.json")
        if plan is None and all(name.startswith(PREPARED) for name in objects.sizes()):
            yield objects.address, NO_PLAN
        if plan is not None and objects.tag("manifest.json") is None:
            run_id = find_run_id(plan, objects.address)
            if run_id is not None:
                yield objects.address, run_id


def scheduled_run(
    grid: str, root: str, *, at: datetime, backend: str = "auto", **execution: Any
) -> dict[str, Any]:
    """One run of a schedule, of which nothing is kept but its dataset.

    Parameters
    ----------
    grid, root, at, backend : as for `choose_dataset`
    execution : ``runner``, ``workers`` and ``scheduler``, as for generating

    Returns
    -------
    ``dataset``, ``run_id``, ``clips``, ``made``, ``contact_sheet``, ``cpu_s`` [s], ``bytes`` [B] and ``verdicts[]``.
    """
    return _make_at(choose_dataset(grid, root, backend, at), grid, backend=backend, **execution)


def recorded_run(
    grid: str, root: str, *, at: datetime, backend: str = "auto", **execution: Any
) -> dict[str, Any]:
    """`scheduled_run` with a record of how far it is and how it ended (see `flows.scheduled.run_record`)."""
    dataset = choose_dataset(grid, root, backend, at)
    with keep_record(PurePosixPath(dataset).name.rpartition("-")[0], root, dataset, at) as record:
        result = _make_at(dataset, grid, backend=backend, **execution)
        record.run_id, record.clips = result["run_id"], result["clips"]
        record.quarantined = sum(not row["passed"] for row in result["verdicts"] if row["passed"] is not None)
        record.cpu_s, record.bytes = result["cpu_s"], result["bytes"]
    return result


def _make_at(dataset: str, grid: str, *, runner: RunnerName = "dask", **execution: Any) -> dict[str, Any]:
    started = process_time()
    report = generate_dataset(grid, dataset, runner=runner, **execution)
    # clips that threads make side by side each count the whole process
    workers_s = 0.0 if runner == "threads" else report.cost.cpu_s
    clips = read_manifest(report.layout)["clips"]
    return {
        "dataset": str(report.layout),
        "run_id": report.run_id,
        "clips": report.clips,
        "made": report.made,
        "contact_sheet": str(report.layout.previews / "contact_sheet.png"),
        "cpu_s": process_time() - started + workers_s,
        "bytes": stored_bytes(report.layout),
        "verdicts": [
            {
                "clip": clip["label"],
                "passed": clip["verdict"]["passed"],
                "pitch_rmse_deg": clip["verdict"].get("pitch_rmse_deg"),
                "stopping_distance_m": clip["figures"].get("stopping_distance"),
                "reasons": "; ".join(clip["verdict"]["reasons"]),
            }
            for clip in clips
        ],
    }


def checked_parameters(
    grid: str,
    every: str,
    out: str,
    runner: str = "dask",
    workers: int | None = None,
    notify: str | None = None,
    scheduler: str | None = None,
    notify_on: str = WHEN_NONE_IS_NAMED,
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
    problems += _find_folder_problems(out)
    problems += list_runner_problems(runner, scheduler)
    if scheduler is not None and not re.fullmatch(r"(tcp|tls)://[^/]+:\d+", scheduler):
        problems.append(f"--scheduler must be like tcp://host:8786 or tls://host:8786; it is {scheduler!r}")
    problem = notify_problem(notify) if notify is not None else None
    problems += [problem] if problem is not None else []
    unknown = [word for word in notify_on.split(",") if word.strip() not in EVENTS]
    if unknown:
        problems.append(
            f"--notify-on must be some of {', '.join(EVENTS)}, with commas between; it is {notify_on!r}"
        )
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
        "notify_on": notify_on,
    }


def _find_folder_problems(out: str) -> list[str]:
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
    notify: str | None = None,
    notify_on: str = WHEN_NONE_IS_NAMED,
    keep: int | None = None,
    **execution: Any,
) -> None:
    """Serve the generating flow on a schedule from this process, until it is stopped.

    With ``PREFECT_API_URL`` it registers there; else it starts a Prefect server on loopback, and stops it in the end.

    Parameters
    ----------
    grid : grid file or name
    every : cron expression, UTC
    out : folder, or address in an object store, in which each run makes its dated dataset
    notify : who is notified, as of `flows.scheduled.notification.send_notice`
    notify_on : of what, of `flows.scheduled.notification.EVENTS`, with commas between
    keep : how many datasets stay; None keeps all [1]
    execution : ``runner``, ``workers`` and ``scheduler``, as for generating

    Raises
    ------
    InputError
        Listing every parameter that is wrong.
    """
    options = checked_parameters(grid, every, out, notify=notify, notify_on=notify_on, **execution)
    if not is_address(out):
        Path(out).mkdir(parents=True, exist_ok=True)
    # until the runner takes over, and after it
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with prefect_api(pages=True):
        from flows.scheduled.prefect_schedule import serve_schedule

        serve_schedule(every, options | {"keep": keep})
