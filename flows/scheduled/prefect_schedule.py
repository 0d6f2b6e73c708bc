"""The scheduled run as a Prefect flow: retries with back-off, verdicts and contact sheet as artifacts."""

import logging
from datetime import UTC, datetime
from multiprocessing import active_children
from pathlib import Path
from typing import Any

from flows import prefect_flows  # noqa: F401  (first: it sets what Prefect reads when it is imported)

# isort: split
from prefect import flow, task
from prefect.artifacts import create_image_artifact, create_link_artifact, create_table_artifact
from prefect.cache_policies import NO_CACHE
from prefect.deployments.runner import EntrypointType
from prefect.runtime import flow_run
from prefect.tasks import exponential_backoff

from flows.running.runner import RunnerName
from flows.scheduled.failure_report import report_failure
from flows.scheduled.scheduling import scheduled_run
from flows.store.objects import is_address
from tasks.errors import InputError

RETRIES = 3
FIRST_DELAY_S = 10
AT_ONCE = 1
STOP_S = 30.0
"""For a run to close its workers."""


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
)(scheduled_run)


def _report_crash(flow: Any, flow_run: Any, state: Any) -> None:
    """A run whose process was killed cannot report by itself: whoever started it does."""
    asked = flow_run.parameters
    at = flow_run.expected_start_time or datetime.now(UTC)
    report_failure(asked["grid"], asked["root"], at, RuntimeError(state.message), asked.get("notify"))


@flow(name="musync-scheduled", persist_result=False, on_crashed=[_report_crash])
def scheduled(
    grid: str,
    root: str,
    runner: RunnerName = "dask",
    workers: int | None = None,
    scheduler: str | None = None,
    notify: str | None = None,
) -> str:
    """Make one dated dataset of a grid, or finish an unfinished one; returns where it lies."""
    at = flow_run.scheduled_start_time or datetime.now(UTC)
    try:
        result = make_dataset(grid, root, at=at, runner=runner, workers=workers, scheduler=scheduler)
    except Exception as error:
        report_failure(grid, root, at, error, notify)
        raise
    dataset: str = result["dataset"]
    link = dataset if is_address(dataset) else Path(dataset).as_uri()
    create_table_artifact(key="musync-verdicts", table=result["verdicts"], description=dataset)
    create_link_artifact(key="musync-dataset", link=link, link_text=dataset)
    if Path(result["contact_sheet"]).is_file():
        create_image_artifact(key="musync-contact-sheet", image_url=Path(result["contact_sheet"]).as_uri())
    return dataset


def serve_schedule(every: str, parameters: dict[str, Any]) -> None:
    """Register the flow with its schedule and run what falls due, one run at a time, until stopped.

    Parameters
    ----------
    every : cron expression, UTC
    parameters : of `scheduled`
    """
    # Prefect cancels a connection of its own when it is stopped, and asyncio writes forty lines about that
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)
    try:
        # of two runs that fall due together the second waits: both would want the same processors
        scheduled.serve(
            name=f"musync-{Path(parameters['grid']).stem}",
            cron=every,
            parameters=parameters,
            limit=AT_ONCE,
            global_limit=AT_ONCE,
            print_starting_message=False,
            entrypoint_type=EntrypointType.MODULE_PATH,
        )
    finally:
        _stop_runs()


def _stop_runs() -> None:
    """Stop runs that are still going while the server still answers; this process would wait for them otherwise."""
    running = active_children()
    for run in running:
        run.terminate()
    for run in running:
        run.join(STOP_S)
        run.kill()
