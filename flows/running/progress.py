"""Progress for people: a bar with the time left on a terminal, one line a clip elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from flows.running.terminal import escape_controls, open_console, print_lines

Advance = Callable[[str], None]


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Advance]:
    """Yield a function to call with the name of each finished piece of work."""
    if not sys.stderr.isatty():
        done = 0

        def report(name: str) -> None:
            nonlocal done
            done += 1
            print_lines(f"{title} {done}/{total} {escape_controls(name)}", error=True)

        yield report
        return
    columns = (
        TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TextColumn("elapsed"),
        TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(), TextColumn("{task.fields[last]}", markup=False),
    )  # fmt: skip
    with Progress(*columns, console=open_console(error=True)) as bar:
        task = bar.add_task(title, total=total, last="")
        yield lambda name: bar.update(task, advance=1, last=escape_controls(name))
