"""One pipeline, two ways to run it: as a Prefect flow whose stages are tasks, or as plain Python."""

import sys
from collections.abc import Callable
from functools import wraps
from time import perf_counter
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def run_as_stage(function: Callable[P, R]) -> Callable[P, R]:
    """Run the function as a Prefect task inside a flow run, and as itself outside one.

    Outside a flow Prefect is not even imported: its import and temporary server cost seconds that a
    command on one machine has no use for.
    """

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        if "prefect" in sys.modules:
            from prefect import task
            from prefect.cache_policies import NO_CACHE
            from prefect.context import FlowRunContext
            from prefect.logging import get_run_logger

            if FlowRunContext.get() is not None:
                # results stay in memory and arguments are not hashed: receipts and files are our record
                stage = task(persist_result=False, cache_policy=NO_CACHE)(function)
                log, started = get_run_logger(), perf_counter()
                log.info("stage %s begins", function.__name__)
                result = stage(*args, **kwargs)
                log.info("stage %s ended after %.1f s", function.__name__, perf_counter() - started)
                return result
        return function(*args, **kwargs)

    return run
