"""What every command shares: its options, how it reaches its function, and how it prints what came back."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

import typer

from flows.running.failures import CHECK_FAILED
from flows.running.terminal import open_console, say, visible
from tasks.errors import InputError

DATASETS, WRITE_DATASETS = {"dataset", "a", "b"}, {"generate", "reproduce", "schedule"}
"""Arguments that may be addresses in an object store, and functions that may write to one."""

Json = Annotated[bool, typer.Option("--json", help="Print the JSON instead of text.")]
Out = Annotated[str | None, typer.Option(help="Folder for the JSON this command writes.")]
Runner = Annotated[str, typer.Option(help="threads, processes or dask.")]
Workers = Annotated[int | None, typer.Option(help="How many at once; by default one a processor.", min=1)]
Scheduler = Annotated[str | None, typer.Option(help="tcp:// or tls:// address of a running Dask scheduler.")]
Prefect = Annotated[
    bool, typer.Option("--prefect", help="Run as a Prefect flow; implied by PREFECT_API_URL.")
]


def one_thread() -> None:
    # many small linear systems: the threads of a BLAS spend more time waiting for each other than computing
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def call(name: str, prefect: bool, /, *args: Any, **kwargs: Any) -> Any:
    """Call a pipeline function, as a Prefect flow where one is asked for."""
    function = _function(name, prefect or "PREFECT_API_URL" in os.environ)
    _refuse_addresses(function, args, kwargs)
    try:
        return function(*args, **kwargs)
    except (EOFError, BrokenPipeError) as error:
        # Typer takes these for the end of its own streams, and ends with the code of a failed check
        raise RuntimeError(f"{type(error).__name__}: {error}") from error


def _refuse_addresses(function: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]) -> None:
    """Datasets may lie in an object store; pages, films, tables and scenes are written to folders."""
    from inspect import signature

    from flows.store.objects import is_address

    given = signature(function).bind(*args, **kwargs).arguments
    folders = set(given) - DATASETS - ({"out"} if function.__name__ in WRITE_DATASETS else set())
    problems = [
        f"{'--out ' if name == 'out' else ''}{given[name]}: must be a folder or file of this machine; only datasets"
        " may lie in an object store"
        for name in sorted(folders)
        if is_address(given[name]) and given[name].startswith("s3:")
    ]
    if problems:
        raise InputError(problems)


def _function(name: str, as_flow: bool) -> Callable[..., Any]:
    # imports are late so that each command loads only the libraries it needs
    if as_flow:
        from flows import prefect_flows

        if hasattr(prefect_flows, name):
            function: Callable[..., Any] = getattr(prefect_flows, name)
            return function
    from importlib import import_module

    module = {
        "generate": "making.generate",
        "audit": "auditing.audit",
        "verify": "auditing.verify",
        "gc": "auditing.verify",
        "repair": "auditing.repair",
        "sign": "auditing.signing",
        "sql": "reading.query",
        "schema": "reading.query",
        "explain": "auditing.explain",
        "schedule": "scheduled.scheduling",
        "describe": "reading.describe",
        "validate": "reading.describe",
        "preview": "reading.previews",
        "report": "reading.report",
        "freeze": "making.freezing",
        "reproduce": "making.freezing",
        "sheets": "reading.sheets",
        "replay_audit": "making.replay",
        "sensitivity": "studies.vehicle_model",
        "agreement": "studies.vehicle_model",
        "bench": "studies.vehicle_model",
        "calibrate": "measured.calibration",
        "ablation": "studies.ablation",
        "import_measurements": "measured.importing",
        "brake_protocol": "measured.protocol",
        "synthetic_drives": "measured.bus_drives",
        "stop_study": "measured.stop_study",
        "diff": "auditing.dataset_diff",
        "bump_study": "measured.bump_study",
        "close_loop": "measured.closing",
        "close_loop_benchmark": "measured.closing_benchmark",
        "audit_physics": "judging.physics",
        "evaluate": "judging.evaluation",
        "controls": "judging.controls",
        "judge": "judging.foreign",
        "retention": "judging.foreign",
        "scene_from_stereo": "making.reconstruction",
        "scene_import": "making.scenes",
        "render_pose": "making.scenes",
    }[name]
    function = getattr(import_module(f"flows.{module}"), name)
    return function


def show(value: dict[str, Any], as_json: bool) -> None:
    """Print a result: a line a value, a table where the value is a list of rows."""
    if as_json:
        say(json.dumps(value, indent=1))
        return
    for key, entry in value.items():
        if isinstance(entry, list) and entry and isinstance(entry[0], dict):
            _show_table(key, entry)
        else:
            say(f"{key}: {_text(entry)}")


def _show_table(title: str, rows: Sequence[Mapping[str, Any]]) -> None:
    # its import takes longer than many a command
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for column in rows[0]:
        table.add_column(visible(column), overflow="fold")
    for row in rows:
        table.add_row(*(_text(row.get(column)) for column in rows[0]))
    open_console().print(table)


def show_lines(result: dict[str, Any], as_json: bool, module: str) -> None:
    """Print a result in the words that its module's ``as_text`` has for it."""
    if as_json:
        show(result, as_json)
        return
    from importlib import import_module

    say(import_module(module).as_text(result).removesuffix("\n"))


def exit_unless(good: bool) -> None:
    if not good:
        raise typer.Exit(CHECK_FAILED)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, list):
        return ", ".join(_text(item) for item in value)
    return "-" if value is None else visible(str(value))
