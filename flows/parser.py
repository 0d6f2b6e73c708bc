"""The parser of ``musync``, built from the registry, and the call of a command's function."""

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib.metadata import version
from inspect import Parameter, Signature
from typing import Annotated, Any

import typer

from flows.commands.command import REQUIRED, Command, Option
from flows.printing import print_json, print_result
from flows.registry import COMMANDS, flow_name, import_function
from flows.running.failures import CHECK_FAILED
from flows.running.terminal import print_lines
from tasks.errors import InputError

SUBCOMMANDS = {
    "scene": "Build a scene from recordings or from other tools.",
    "vehicle": "Describe a car of your own, check what its file says, and calibrate it.",
    "lab": "Judges, audits and studies beyond daily work: one heading each.",
}
"""Help of the words that stand before the names of several commands."""
GROUPS = "Groups"
"""Heading of `musync --help` below which these words stand."""
AS_JSON = Option(name="json", kind=bool, help="Print the whole result as JSON.", default=False)
AS_FLOW = Option(
    name="prefect", kind=bool, help="Run as a Prefect flow; implied by PREFECT_API_URL.", default=False
)


def build_parser() -> typer.Typer:
    """Return the Typer application with every command of the registry, below the heading of its group."""
    app = typer.Typer(
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        help="Make driving video whose weather, grip, motion and camera agree; audit it, judge it, and learn from"
        " measured drives.",
    )
    app.callback()(_accept_version)
    words: dict[str, typer.Typer] = {}
    for command in COMMANDS:
        word, _, name = command.name.rpartition(" ")
        if word and word not in words:
            words[word] = typer.Typer(no_args_is_help=True, help=SUBCOMMANDS[word])
            app.add_typer(words[word], name=word, rich_help_panel=GROUPS)
        parent = words.get(word, app)
        parent.command(name, help=command.sentence, rich_help_panel=command.group)(_make_callback(command))
    return app


def run_function(command: Command, given: Mapping[str, Any], as_flow: bool) -> Any:
    """Run the function of a command, as a Prefect flow where this is wanted.

    Parameters
    ----------
    command : which
    given : value of each of its options, by their names
    as_flow : whether to run as a Prefect flow

    Raises
    ------
    InputError
        If an option that must be a folder is an address in an object store.
    """
    _refuse_addresses(command, given)
    if command.one_thread:
        # many small linear systems: the threads of a BLAS spend more time waiting for each other than computing
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        if not (as_flow and command.is_flow):
            return import_function(command)(**given)
        from flows.running.prefect_server import prefect_api

        with prefect_api(pages=False):
            from flows import prefect_flows

            return getattr(prefect_flows, flow_name(command))(**given)
    except (EOFError, BrokenPipeError) as error:
        # Typer takes these for the end of its own streams, and ends with the code of a failed check
        raise RuntimeError(f"{type(error).__name__}: {error}") from error


def _refuse_addresses(command: Command, given: Mapping[str, Any]) -> None:
    problems = [
        f"{'' if option.positional else f'--{option.keyword} '}{given[option.name]}: must be a folder or file of this"
        " machine; only datasets may lie in an object store"
        for option in command.options
        if not option.in_store and str(given[option.name]).startswith("s3://")
    ]
    if problems:
        raise InputError(problems)


def _print_version(wanted: bool) -> None:
    if not wanted:
        return
    # imported here: it is not needed by --help
    from manifests.provenance import git_commit

    checkout = git_commit()
    changed = ", changed since" if checkout and checkout["changed"] else ""
    commit = f" (commit {checkout['commit'][:12]}{changed})" if checkout else ""
    print_lines(f"musync {version('musync-gs')}{commit}")
    raise typer.Exit


def _accept_version(
    _version: Annotated[
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_print_version, help="Print the version, and the git commit."
        ),
    ] = False,
) -> None:
    """Take the options that stand before the name of a command."""


def _make_callback(command: Command) -> Callable[..., None]:
    """Return the function that Typer calls, whose signature carries the command's options."""

    def callback(**words: Any) -> None:
        given = {option.name: _read_value(option, words) for option in command.options}
        as_flow = words.get(AS_FLOW.name, False) or "PREFECT_API_URL" in os.environ
        result = run_function(command, given, as_flow)
        as_json = words.get(AS_JSON.name, False) or given.get(command.json_with, False)
        _print_as_asked(command, result, as_json)
        if not command.passed(result):
            raise typer.Exit(CHECK_FAILED)

    options = [
        *command.options,
        *([AS_FLOW] if command.is_flow else []),
        *([AS_JSON] if command.output != "nothing" else []),
    ]
    parameters = [_make_parameter(one) for option in options for one in _list_flags(option)]
    callback.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    callback.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return callback


def _list_flags(option: Option) -> list[Option]:
    """Return an option, whose value is a word, and the flag that is short for one of its words."""
    if not option.values:
        return [option]
    word = next(word for word, value in option.values.items() if value == option.default)
    flag = Option(
        name=f"no_{option.name}",
        spelling=f"no_{option.keyword}",
        kind=bool,
        help=f"The same as --{option.keyword} {option.off}.",
        default=False,
    )
    return [replace(option, default=word), *([flag] if option.off else [])]


def _read_value(option: Option, words: Mapping[str, Any]) -> Any:
    """Return what the function takes for an option of the command line."""
    word = option.off if words.get(f"no_{option.name}") else words[option.name]
    if option.values and word not in option.values:
        raise InputError(f"--{option.keyword} must be one of {', '.join(option.values)}; it is {word}")
    return option.values[word] if option.values else word


def _make_parameter(option: Option) -> Parameter:
    details: dict[str, Any] = {
        "help": _keep_brackets(option.help),
        "show_default": option.shown_default or True,
        "min": option.minimum,
        "max": option.maximum,
    }
    if option.kind is bool:
        details["metavar"] = ""  # a flag takes no value
    if option.known:
        details["autocompletion"] = lambda incomplete: _complete_value(option, incomplete)
    word = option.keyword.replace("_", "-")
    if option.positional:
        declared = typer.Argument(**details)
    elif option.kind is bool and option.default is True:
        declared = typer.Option(f"--{word}/--no-{word}", **details)
    else:
        declared = typer.Option(f"--{word}", **details)
    default = Parameter.empty if option.default is REQUIRED else option.default
    kind: Any = Annotated[option.kind, declared]
    # the option's own name: its spelling may be a word of Python, such as from
    return Parameter(option.name, Parameter.KEYWORD_ONLY, default=default, annotation=kind)


def _keep_brackets(text: str) -> str:
    """Return a text whose units in brackets Rich prints, and does not take for markup."""
    return text.replace("[", "\\[")


def _complete_value(option: Option, incomplete: str) -> list[str]:
    """Return the known values of an option that begin with the text typed so far."""
    from manifests.provenance import SOURCE_ROOT

    known = option.known
    values = sorted(path.stem for path in SOURCE_ROOT.glob(known)) if isinstance(known, str) else known
    return [value for value in values if value.startswith(incomplete)]


def _print_as_asked(command: Command, result: Any, as_json: bool) -> None:
    if command.output == "nothing":
        return
    if as_json:
        print_json(result)
    elif command.output == "sentences":
        module = sys.modules[import_function(command).__module__]
        print_lines(module.format_text(result).removesuffix("\n"))
    else:
        print_result(command.brief(result))
