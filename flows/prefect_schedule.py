"""The scheduled run as a Prefect flow: retries with back-off, verdicts and contact sheet as artifacts."""

from datetime import UTC, datetime
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

from flows.runner import RunnerName
from flows.scheduling import report_failure, scheduled_run
from tasks.errors import InputError

RETRIES = 3
FIRST_DELAY_S = 10
AT_ONCE = 1


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


@flow(name="musync-scheduled", persist_result=False)
def scheduled(
    grid: str, root: str, runner: RunnerName = "dask", workers: int | None = None, notify: str | None = None
) -> str:
    """Make one dated dataset of a grid, or finish an unfinished one; returns its folder."""
    at = flow_run.scheduled_start_time or datetime.now(UTC)
    try:
        result = make_dataset(grid, root, at=at, runner=runner, workers=workers)
    except Exception as error:
        report_failure(grid, root, at, error, notify)
        raise
    create_table_artifact(key="musync-verdicts", table=result["verdicts"], description=result["dataset"])
    create_link_artifact(
        key="musync-dataset", link=Path(result["dataset"]).as_uri(), link_text=result["dataset"]
    )
    if Path(result["contact_sheet"]).is_file():
        create_image_artifact(key="musync-contact-sheet", image_url=Path(result["contact_sheet"]).as_uri())
    dataset: str = result["dataset"]
    return dataset


def serve(every: str, parameters: dict[str, Any]) -> None:
    """Register the flow with its schedule and run what falls due, one run at a time, until stopped.

    Parameters
    ----------
    every : cron expression, UTC
    parameters : of `scheduled`
    """
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
