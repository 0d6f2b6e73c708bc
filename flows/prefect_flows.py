"""The pipeline's commands as Prefect flows, for a server, a schedule or a work pool.

Each command of the registry that is a flow stands here under its name, with underscores; its stages (see
`flows.running.orchestration`) become task runs, and the clips fan out on the chosen runner from inside one of them.
Results are never persisted by Prefect: receipts and hashes on disk decide what is done.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

QUIET_AND_LOCAL = {
    "DO_NOT_TRACK": "1",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "PREFECT_LOGGING_LEVEL": "WARNING",
    # the command says in a sentence why a run ended; the traceback is in the run's log on the server
    "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",
    "PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS": "120",
    "PREFECT_HOME": str(Path.cwd() / ".musync" / "prefect"),
}
for _name, _value in QUIET_AND_LOCAL.items():
    os.environ.setdefault(_name, _value)
# Prefect's database fails to open in a home that does not exist yet
Path(os.environ["PREFECT_HOME"]).mkdir(parents=True, exist_ok=True)

from prefect import flow  # noqa: E402  (reads the environment when it is imported)

from flows.registry import COMMANDS, flow_name, import_function  # noqa: E402


def make_flow(function: Callable[..., Any], name: str) -> Any:
    """Return the Prefect flow of a function.

    Parameters
    ----------
    function : which
    name : of the command, to which the flow's name adds ``musync-``
    """
    description = (function.__doc__ or "").split("\n")[0]
    return flow(name=f"musync-{name}", persist_result=False, description=description)(function)


def __getattr__(name: str) -> Any:
    """Return the flow of a command by the name of its Python form, such as ``audit_physics``."""
    for command in COMMANDS:
        if command.is_flow and flow_name(command) == name:
            made = make_flow(import_function(command), name.replace("_", "-"))
            globals()[name] = made
            return made
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
