"""Serve a schedule's flow from this process until it is stopped, and leave no run behind that only seems to go on."""

import asyncio
import json
import logging
import os
from collections.abc import Mapping
from inspect import signature
from multiprocessing import active_children
from pathlib import Path
from time import monotonic
from typing import Any, cast
from uuid import UUID

import httpx
from prefect import Flow
from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import (
    FlowRunFilter,
    FlowRunFilterDeploymentId,
    FlowRunFilterState,
    FlowRunFilterStateType,
)
from prefect.client.schemas.objects import StateType
from prefect.deployments.runner import EntrypointType
from prefect.exceptions import PrefectException
from prefect.runner import Runner
from prefect.states import Cancelled

from flows.scheduled.notification import WHEN_NONE_IS_NAMED

AT_ONCE = 1
"""Of two runs that fall due together the second waits: both would want the same processors."""
STOP_S = 30.0
"""For a run to close its workers."""
LOOK_S = 0.5
OPTIONS = "MUSYNC_SCHEDULE"
"""Variable with the options of a schedule's runs as JSON, which the serving process sets for them."""
NOT_A_RUNS = {"notify": None, "notify_on": WHEN_NONE_IS_NAMED}
"""Options that no run's parameter sets: they name commands."""
UNDER_WAY = [StateType.PENDING, StateType.RUNNING, StateType.PAUSED, StateType.CANCELLING]


class StoppableRunner(Runner):
    """Prefect's runner, which a SIGTERM stops: Prefect 3.8's own handler calls a coroutine that nobody awaits."""

    _main: "asyncio.Task[Any] | None" = None

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._asked: dict[int, float] = {}

    async def run(self) -> None:
        """Serve until a SIGTERM, or until the task is cancelled."""
        self._main = asyncio.current_task()
        await self.start()

    def handle_sigterm(self, *_: Any, **__: Any) -> None:
        """End the runs and the polling, wherever in the event loop this finds them."""
        if self._main is not None and not self._main.get_loop().is_closed():
            self._main.get_loop().call_soon_threadsafe(self._end_runs, self._main.get_loop())
            self._main.get_loop().call_soon_threadsafe(self._main.cancel)

    def _end_runs(self, loop: asyncio.AbstractEventLoop) -> None:
        """Ask each run once to end: the runner waits for them, and for one that it is just starting too."""
        for run in active_children():
            if run.pid is not None and run.pid not in self._asked:
                self._asked[run.pid] = monotonic()
                run.terminate()
            elif run.pid is not None and monotonic() - self._asked[run.pid] > STOP_S:
                run.kill()
        loop.call_later(LOOK_S, self._end_runs, loop)


def serve_flow(flow: Flow[..., Any], every: str, options: dict[str, Any]) -> None:
    """Register the flow with its schedule and run what falls due, one run at a time, until stopped.

    Parameters
    ----------
    flow : with ``grid`` among its parameters
    every : cron expression, UTC
    options : of every run, as of `read_options`; those that are parameters of the flow are shown by the server
    """
    os.environ[OPTIONS] = json.dumps(options)
    shown = {name: value for name, value in options.items() if name in signature(flow.fn).parameters}
    # Prefect cancels a connection of its own when it is stopped, and asyncio writes forty lines about that
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)
    runner = StoppableRunner(name=f"musync-{Path(options['grid']).stem}", limit=AT_ONCE)
    deployment = runner.add_flow(
        flow,
        name=runner.name,
        cron=every,
        parameters=shown,
        concurrency_limit=AT_ONCE,
        entrypoint_type=EntrypointType.MODULE_PATH,
    )
    renew_runs(cast(UUID, deployment), shown)  # Prefect's type is that of both its ways to call it
    try:
        asyncio.run(runner.run())
    except (KeyboardInterrupt, asyncio.CancelledError):
        pass  # it was asked to stop
    finally:
        _stop_runs()
        cancel_runs(cast(UUID, deployment))


def read_options(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a run: those of the process that serves its schedule, whatever the run's parameters say.

    A run's parameters come from the server, and may be as old as its database or anybody's who may talk to it.

    Parameters
    ----------
    parameters : of the run, which count on a work pool, where no process serves; ``notify`` and ``notify_on`` never do
    """
    return {**parameters, **NOT_A_RUNS, **json.loads(os.environ.get(OPTIONS, "{}"))}


def _stop_runs() -> None:
    """Stop runs that are still going while the server still answers; this process would wait for them otherwise."""
    running = active_children()
    for run in running:
        run.terminate()
    for run in running:
        run.join(STOP_S)
        run.kill()


def renew_runs(deployment: UUID, parameters: dict[str, Any]) -> None:
    """Give runs that are due the parameters of today: a flow refuses those that it has no longer.

    Parameters
    ----------
    deployment : whose runs
    parameters : of its flow
    """
    with get_client(sync_client=True) as client:
        for run in client.read_flow_runs(flow_run_filter=_runs_in(deployment, [StateType.SCHEDULED])):
            if run.parameters != parameters:
                client.update_flow_run(run.id, parameters=parameters)


def cancel_runs(deployment: UUID) -> None:
    """Mark what the server still takes for under way as cancelled: its process is no more, or never began.

    Parameters
    ----------
    deployment : whose runs
    """
    message = "the schedule was stopped; committed clips are kept, and its next run makes what is missing"
    try:
        with get_client(sync_client=True) as client:
            for run in client.read_flow_runs(flow_run_filter=_runs_in(deployment, UNDER_WAY)):
                client.set_flow_run_state(run.id, Cancelled(message=message), force=True)
    except (httpx.HTTPError, PrefectException):
        logging.getLogger(__name__).warning("the server did not learn that the schedule was stopped")


def _runs_in(deployment: UUID, states: list[StateType]) -> FlowRunFilter:
    return FlowRunFilter(
        deployment_id=FlowRunFilterDeploymentId(any_=[deployment]),
        state=FlowRunFilterState(type=FlowRunFilterStateType(any_=states)),
    )
