"""Every command, registered once: the parser, the Prefect flows and the functions behind them are derived from here."""

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from flows.commands import audits, datasets, measured, scenes, vehicles
from flows.commands.command import Command

LABORATORY = "studies.commands"
"""Where the laboratory beside the house lists its commands; it may be absent."""


def list_laboratory() -> tuple[Command, ...]:
    """Return the commands of the laboratory, which ``musync lab`` runs beside its own."""
    if find_spec("studies") is None:
        return ()
    commands: tuple[Command, ...] = import_module(LABORATORY).COMMANDS
    return commands


COMMANDS: tuple[Command, ...] = (
    *datasets.COMMANDS,
    *audits.COMMANDS,
    *vehicles.COMMANDS,
    *measured.COMMANDS,
    *scenes.COMMANDS,
    *list_laboratory(),
)


def import_function(command: Command) -> Callable[..., Any]:
    """Return the function of a command; its module, and the libraries it needs, are imported now."""
    module, _, name = command.function.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function


def flow_name(command: Command) -> str:
    """Return the name of a command's Prefect flow in `flows.prefect_flows`."""
    return command.name.replace(" ", "_").replace("-", "_")
