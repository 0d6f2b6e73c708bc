"""The pipeline's commands as Prefect flows, for a server, a schedule or a work pool.

Each command of the registry that is a flow stands here under its name, with underscores; its stages (see
`flows.running.orchestration`) become task runs, and the clips fan out on the chosen runner from inside one of them.
Results are never persisted by Prefect: receipts and hashes on disk decide what is done.
"""

from collections.abc import Callable
from datetime import UTC, datetime
from functools import wraps
from pathlib import Path
from typing import Any

from flows.running.prefect_server import set_up_prefect

set_up_prefect()

from prefect import flow  # noqa: E402  (reads the environment when it is imported)
from prefect.logging import get_run_logger  # noqa: E402
from prefect.runtime import flow_run  # noqa: E402

from flows.commands.command import pass_always  # noqa: E402
from flows.registry import COMMANDS, flow_name, import_function  # noqa: E402
from flows.running.prefect_progress import show_progress  # noqa: E402


def make_flow(function: Callable[..., Any], name: str, passed: Callable[[Any], bool] | None = None) -> Any:
    """Return the Prefect flow of a function, whose runs are named by what they are given and when.

    Parameters
    ----------
    function : which
    name : of the command, to which the flow's name adds ``musync-``
    passed : whether a result passes the command's check, for the run's log
    """

    @wraps(function)
    def run(*args: Any, **kwargs: Any) -> Any:
        with show_progress():
            result = function(*args, **kwargs)
        if passed is not None:
            get_run_logger().info("verdict: %s", "passed" if passed(result) else "the check failed")
        return result

    def name_run() -> str:
        given = next((str(value) for value in flow_run.parameters.values() if value is not None), "")
        return f"{name} {Path(given).name}, {datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC"

    description = (function.__doc__ or "").split("\n")[0]
    made = flow(name=f"musync-{name}", flow_run_name=name_run, persist_result=False, description=description)
    return made(run)


def __getattr__(name: str) -> Any:
    """Return the flow of a command by the name of its Python form, such as ``audit_physics``."""
    for command in COMMANDS:
        if command.is_flow and flow_name(command) == name:
            made = make_flow(
                import_function(command),
                name.replace("_", "-"),
                None if command.passed is pass_always else command.passed,
            )
            globals()[name] = made
            return made
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
