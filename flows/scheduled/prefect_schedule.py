"""The scheduled run as a Prefect flow: named, logged, tried again; verdicts and contact sheet as artifacts."""

import base64
from collections.abc import Mapping
from datetime import UTC, datetime
from inspect import signature
from pathlib import Path
from typing import Any
from uuid import UUID

import cv2

from flows import prefect_flows  # noqa: F401  (first: it sets what Prefect reads when it is imported)

# isort: split
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from threading import Timer

from prefect import flow, get_run_logger, task
from prefect.artifacts import create_image_artifact, create_link_artifact, create_table_artifact
from prefect.cache_policies import NO_CACHE
from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import (
    FlowRunFilter,
    FlowRunFilterDeploymentId,
    FlowRunFilterState,
    FlowRunFilterStateType,
)
from prefect.client.schemas.objects import StateType
from prefect.client.schemas.sorting import FlowRunSort
from prefect.runtime import deployment, flow_run
from prefect.tasks import exponential_backoff

from catalogs.entries import load
from catalogs.sentences import shorten
from flows.running.prefect_progress import show_progress
from flows.running.runner import RunnerName, end_with_parent
from flows.scheduled.failure_report import report_failure, report_run, wants_notice
from flows.scheduled.retention import remove_oldest
from flows.scheduled.scheduling import recorded_run
from flows.scheduled.serving import read_options, serve_flow
from flows.store.objects import is_address
from tasks.errors import InputError

RETRIES = 3
FIRST_DELAY_S = 10
SHEET_PX, SHEET_QUALITY = 1000, 75
"""Longer side of the contact sheet that Prefect keeps [px], and its JPEG quality [1 to 100]."""
LATE_AFTER = timedelta(minutes=10)
"""Between the time of a run and its beginning."""


def _worth_trying_again(_task: Any, _run: Any, state: Any) -> bool:
    """A wrong input stays wrong; a clip that failed for want of memory or disk may not."""
    return not isinstance(state.result(raise_on_failure=False), InputError)


make_dataset = task(
    name="make-dataset",
    retries=RETRIES,
    retry_delay_seconds=exponential_backoff(FIRST_DELAY_S),
    retry_condition_fn=_worth_trying_again,
    persist_result=False,
    cache_policy=NO_CACHE,
)(recorded_run)


def _name_run() -> str:
    """Grid, clips and time of a run; a faulty grid has no number of clips, and fails later with its faults."""
    asked = read_options(flow_run.parameters)["grid"]
    try:
        grid = load("grid", asked)
        what = f"{grid.settings.name}, {len(grid.scenarios)} clips"
    except InputError:
        what = Path(asked).stem
    at = flow_run.scheduled_start_time or datetime.now(UTC)
    return f"{what}, {at.astimezone(UTC):%Y-%m-%d %H:%M} UTC"


def _report_crash(flow: Any, flow_run: Any, state: Any) -> None:
    """A run whose process was killed cannot report by itself: whoever started it does."""
    options = read_options(flow_run.parameters)
    at = flow_run.expected_start_time or datetime.now(UTC)
    notify = options["notify"] if wants_notice("failed", options["notify_on"]) else None
    report_failure(
        options["grid"], options["root"], at, _explain_crash(flow_run.parameters, state.message), notify
    )


def _explain_crash(parameters: Mapping[str, Any], message: str) -> Exception:
    """What ended a run from outside; Prefect ends one that has parameters of other names, and says no more of it."""
    known = signature(scheduled.fn).parameters
    if unknown := [name for name in parameters if name not in known]:
        return InputError(
            f"a run may have the parameters {', '.join(known)}; it has {shorten(', '.join(unknown))}: post it without"
            f" ({message})"
        )
    return RuntimeError(message)


@flow(name="musync-scheduled", flow_run_name=_name_run, persist_result=False, on_crashed=[_report_crash])
def scheduled(
    grid: str,
    root: str,
    runner: RunnerName = "dask",
    workers: int | None = None,
    scheduler: str | None = None,
    keep: int | None = None,
) -> str:
    """Make one dated dataset of a grid, or finish an unfinished one; returns where it lies.

    The parameters count on a work pool alone (see `flows.scheduled.serving.read_options`).
    """
    end_with_parent()
    given = {"runner": runner, "workers": workers, "scheduler": scheduler}
    return _make_dataset_at(
        flow_run.scheduled_start_time or datetime.now(UTC),
        **read_options({"grid": grid, "root": root, "keep": keep, **given}),
    )


def _make_dataset_at(
    at: datetime, grid: str, root: str, keep: int | None, notify: str | None, notify_on: str, **execution: Any
) -> str:
    log = get_run_logger()

    def report(event: str, facts: dict[str, str]) -> None:
        if notify is not None and wants_notice(event, notify_on):
            report_run(event, grid, root, at, facts, notify)

    try:
        with (
            show_progress(),
            watch_lateness(at, _next_time(), lambda sentence: report("late", {"why": sentence})),
        ):
            result = make_dataset(grid, root, at=at, **execution)
    except Exception as error:
        report_failure(grid, root, at, error, notify if wants_notice("failed", notify_on) else None)
        raise
    dataset: str = result["dataset"]
    wrong = [row["clip"] for row in result["verdicts"] if row["passed"] is False]
    verdict = f"{result['clips']} clips, {result['made']} made now, {len(wrong)} in quarantine"
    log.info("verdict: %s%s", verdict, f" ({', '.join(wrong)})" if wrong else "")
    _show_result(result)
    report("done", {"dataset": dataset, "verdict": verdict})
    if keep is not None:
        _remove_oldest(Path(dataset).name.rpartition("-")[0], root, keep)
    return dataset


def _remove_oldest(grid: str, root: str, keep: int) -> None:
    log = get_run_logger()
    try:
        removed, used = remove_oldest(grid, root, keep)
    except (InputError, OSError) as error:  # the dataset is made all the same
        log.warning("the oldest datasets could not be removed: %s", error)
        return
    log.info("removed %d of the oldest datasets: %s", len(removed), ", ".join(removed) or "none")
    if used:
        log.warning("in use, kept until the next run: %s", ", ".join(used))


def _show_result(result: dict[str, Any]) -> None:
    dataset, sheet = result["dataset"], Path(result["contact_sheet"])
    link = dataset if is_address(dataset) else Path(dataset).as_uri()
    create_table_artifact(key="musync-verdicts", table=result["verdicts"], description=dataset)
    create_link_artifact(key="musync-dataset", link=link, link_text=dataset)
    if sheet.is_file():
        create_image_artifact(key="musync-contact-sheet", image_url=embed_picture(sheet), description=dataset)


def embed_picture(path: Path) -> str:
    """A small copy of a picture as a data URI, because a page from a server may not load files of this machine."""
    picture = cv2.imread(str(path))
    if picture is None:
        raise RuntimeError(f"{path}: is no picture")
    scale = min(1.0, SHEET_PX / max(picture.shape[:2]))
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    _, content = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, SHEET_QUALITY])
    return f"data:image/jpeg;base64,{base64.b64encode(content.tobytes()).decode()}"


def _next_time() -> datetime | None:
    """When the deployment's next run is due, as the server has planned it; None outside a deployment."""
    if deployment.id is None:
        return None
    planned = FlowRunFilter(
        deployment_id=FlowRunFilterDeploymentId(any_=[UUID(str(deployment.id))]),
        state=FlowRunFilterState(type=FlowRunFilterStateType(any_=[StateType.SCHEDULED])),
    )
    with get_client(sync_client=True) as client:
        runs = client.read_flow_runs(
            flow_run_filter=planned, sort=FlowRunSort.EXPECTED_START_TIME_ASC, limit=1
        )
    return runs[0].expected_start_time if runs else None


def serve_schedule(every: str, options: dict[str, Any]) -> None:
    """Serve `scheduled` (see `flows.scheduled.serving.serve_flow`)."""
    serve_flow(scheduled, every, options)


@contextmanager
def watch_lateness(at: datetime, next_at: datetime | None, report: Callable[[str], object]) -> Iterator[None]:
    """Report, once, a run that is late while the block makes it.

    Parameters
    ----------
    at : scheduled time of the run
    next_at : of the next run; None where none is planned
    report : called with a sentence, from another thread where the next run falls due
    """
    now = datetime.now(UTC)
    if now - at > LATE_AFTER:
        late_min = (now - at).total_seconds() / 60
        report(f"it was due at {_format(at)} and began {late_min:.0f} min later")
        next_at = None
    if next_at is None or next_at <= now:
        yield
        return
    sentence = (
        f"it was due at {_format(at)} and still goes on at {_format(next_at)}, when the next run is due"
    )
    timer = Timer((next_at - now).total_seconds(), report, [sentence])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _format(at: datetime) -> str:
    return f"{at.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
